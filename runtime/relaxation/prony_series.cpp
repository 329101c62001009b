#include "runtime/relaxation/prony_series.h"

#include "runtime/base/exponential.h"

namespace palpate {

bool PronySeries::set(const palpate_relaxation_def& wanted) {
  if (wanted.terms < 1 || wanted.terms > kMaxTerms) return false;
  terms_ = wanted.terms;
  double sum = 0;
  for (int i = 0; i < terms_; ++i) {
    share_[i] = wanted.share[i], time_[i] = wanted.time[i];
    if (!(share_[i] >= 0 && time_[i] > 0 && std::isfinite(time_[i]))) return false;
    sum += share_[i];
  }
  return sum < 1;
}

Vec3 PronySeries::step(Memory& memory, Vec3 elastic, double dt) const {
  const Vec3 change = elastic - memory.elastic;
  Vec3 force = elastic;
  for (int i = 0; i < terms_; ++i) {
    // F_e' is constant over the step, so h <- h exp(-x) + (1 - exp(-x)) / x dF_e with x = dt / tau.
    const double x = dt / time_[i], lost = one_minus_exp(x);
    Vec3& part = memory.part[i];
    part = (1 - lost) * part + (x > 0 ? lost / x : 1) * change;
    force += -share_[i] * (elastic - part);
  }
  memory.elastic = elastic;
  return force;
}

}  // namespace palpate
