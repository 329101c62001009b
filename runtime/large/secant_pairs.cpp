#include "runtime/large/secant_pairs.h"

#include <algorithm>
#include <cmath>

#include "runtime/large/vector_loops.h"

namespace palpate {

bool SecantPairs::create(SceneMemory& memory, std::size_t length, const LargeRows* rows) {
  length_ = length, rows_ = rows;
  for (BodyMove& pair : pairs_)
    if (!pair.create(memory, length, rows->most())) return false;
  return true;
}

void SecantPairs::keep_state(SceneMemory& memory) {
  memory.keep(state_);
  for (BodyMove& pair : pairs_) pair.keep(memory, length_, rows_->most());
}

void SecantPairs::before_metric(const BodyMove& p, double* factor) const {
  for (int age = 0; age < state_.count; ++age) {
    const BodyMove& s = pairs_[pair(age)];
    factor[age] = (dot_product(s.move, p.move, length_) + rows_->times_compliance(s.local, p.local)) /
                  state_.curvature[pair(age)];
    add_multiple(static_cast<float>(-factor[age]), s.of_tangent, length_, p.move);
    for (std::int32_t r = 0; r < rows_->count(); ++r) p.local[r] -= factor[age] * s.local[r];
  }
}

void SecantPairs::after_metric(const BodyMove& p, const double* factor) const {
  for (int age = state_.count - 1; age >= 0; --age) {
    const BodyMove& s = pairs_[pair(age)];
    const double back = (dot_product(s.of_tangent, p.move, length_) + rows_->times_compliance(s.local, p.local)) /
                        state_.curvature[pair(age)];
    add_multiple(static_cast<float>(factor[age] - back), s.move, length_, p.move);
    add_multiple(static_cast<float>(factor[age] - back), s.of_metric, length_, p.of_metric);
    for (std::int32_t r = 0; r < rows_->count(); ++r) p.local[r] += (factor[age] - back) * s.local[r];
  }
}

int SecantPairs::add(double share, const BodyMove& p, const float* f, const float* after, double energy) {
  State& now = state_;
  const bool full = now.count == kMost;
  const int i = newest_ = full ? now.first : (now.first + now.count) % kMost;
  const BodyMove& s = pairs_[i];
  for (std::size_t k = 0; k < length_; ++k) {
    s.move[k] = -static_cast<float>(share) * p.move[k];
    s.of_metric[k] = -static_cast<float>(share) * p.of_metric[k];
    s.of_tangent[k] = after[k] - f[k];
  }
  std::fill(s.local, s.local + rows_->most(), 0.0);
  for (std::int32_t r = 0; r < rows_->count(); ++r) s.local[r] = -share * p.local[r];
  now.curvature[i] = dot_product(s.move, s.of_tangent, length_) + rows_->times_compliance(s.local, s.local);
  if (!(now.curvature[i] > 1e-12 * std::abs(energy))) {
    if (full) now.first = (now.first + 1) % kMost, --now.count;
    return -1;
  }
  if (full)
    now.first = (now.first + 1) % kMost;
  else
    ++now.count;
  now.marked = std::min(now.marked + 1, kMost);
  return now.since_scale++ % 10 == 0 ? i : -1;
}

void SecantPairs::set_scale(int pair, double scaled) {
  // The tangent of a compressed body is stiffer than K.
  const double scale = state_.curvature[pair] / scaled;
  state_.scale = scale > kLeastScale ? std::min(scale, 1.0) : kLeastScale;
}

void SecantPairs::forget_local_moves() {
  for (int age = state_.count - 1; age >= 0; --age) {
    const BodyMove& s = pairs_[pair(age)];
    double& curvature = state_.curvature[pair(age)];
    std::fill(s.local, s.local + rows_->most(), 0.0);
    curvature = dot_product(s.move, s.of_tangent, length_);
    if (!(curvature > 0)) return drop();
  }
}

void SecantPairs::take_metric() {
  const std::int32_t old = std::max(0, state_.count - state_.marked);
  state_.first = (state_.first + old) % kMost, state_.count -= old;
  for (int age = 0; age < state_.count; ++age) {
    const BodyMove& s = pairs_[pair(age)];
    std::copy(s.of_tangent, s.of_tangent + length_, s.of_metric);
  }
  state_.scale = 1, state_.since_scale = 0;
}

}  // namespace palpate
