#include "runtime/large/soft_mode.h"

#include <algorithm>
#include <cmath>

#include "runtime/large/vector_loops.h"

namespace palpate {
namespace {

// A move of the method with less than this share of the curvature that the metric gives it shows a soft mode; and the mode is followed while its
// quotient is below kFollows.
constexpr double kSoft = 0.75, kFollows = 0.8;
// Steps from one look at the mode to the next: kMostWaits at most, and kWaits times the quotient, so that a very soft mode is looked at in each
// step. A look also comes before the quotient falls by a fourth, if it goes on falling as it did since the last look.
constexpr double kMostWaits = 8, kWaits = 20;
// Below this quotient the state's balance is not stable, or so nearly neutral that it moves far under a small force.
constexpr double kHolds = 0.03;
// The way along the mode to where its force vanishes, by the quotient, as a share of the state's norm in the energy: beyond, the state is not the
// solution.
constexpr double kFar = 0.025;
// The move for a difference of two gradients has this share of the state's norm in the energy.
constexpr double kDifference = 0.01;

// The eigenvector of the least eigenvalue of a symmetric matrix: the largest column of a high power of (bound - a).
void least_eigenvector(double a[3][3], double out[3]) {
  double bound = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) bound += std::abs(a[i][j]);
  double power[3][3], next[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) power[i][j] = (i == j ? 1 : 0) - a[i][j] / bound;
  constexpr int doublings = 24;
  for (int step = 0; step < doublings; ++step) {
    double trace = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        next[i][j] = 0;
        for (int k = 0; k < 3; ++k) next[i][j] += power[i][k] * power[k][j];
        if (i == j) trace += next[i][j];
      }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) power[i][j] = next[i][j] / trace;
  }
  int largest = 0;
  for (int i = 1; i < 3; ++i)
    if (power[i][i] > power[largest][largest]) largest = i;
  for (int i = 0; i < 3; ++i) out[i] = power[i][largest] / std::sqrt(power[largest][largest]);
}

}  // namespace

bool SoftMode::create(SceneMemory& memory, HyperelasticEnergy* energy, const BodyMetric* metric, LargeRows* rows) {
  energy_ = energy, metric_ = metric, rows_ = rows;
  return mode_.create(memory, energy->length(), rows->most()) && last_.create(memory, energy->length(), rows->most());
}

void SoftMode::keep(SceneMemory& memory) {
  memory.keep(state_);
  for (BodyMove* move : {&mode_, &last_}) move->keep(memory, energy_->length(), rows_->most());
}

void SoftMode::forget_local_moves() {
  for (const BodyMove* move : {&mode_, &last_}) std::fill(move->local, move->local + rows_->most(), 0.0);
}

double SoftMode::in_metric(const BodyMove& a, const BodyMove& b) const {
  return dot_product(a.move, b.of_metric, energy_->length()) + rows_->times_compliance(a.local, b.local);
}
double SoftMode::in_tangent(const BodyMove& a, const BodyMove& b) const {
  return dot_product(a.move, b.of_tangent, energy_->length()) + rows_->times_compliance(a.local, b.local);
}

// a <- scale a + factor b, whatever a was where scale is 0.
void SoftMode::combine(double scale, const BodyMove& a, double factor, const BodyMove& b) const {
  const auto sum = [&](float* to, const float* from) {
    for (std::size_t i = 0; i < energy_->length(); ++i)
      to[i] = (scale != 0 ? static_cast<float>(scale) * to[i] : 0.0f) + static_cast<float>(factor) * from[i];
  };
  sum(a.move, b.move), sum(a.of_metric, b.of_metric), sum(a.of_tangent, b.of_tangent);
  for (std::int32_t r = 0; r < rows_->count(); ++r)
    a.local[r] = (scale != 0 ? scale * a.local[r] : 0) + factor * b.local[r];
}

// To the unit norm in the metric. Where nothing is left, zero.
void SoftMode::normalise(const BodyMove& a) const {
  const double squared = in_metric(a, a);
  combine(squared > 0 ? 1 / std::sqrt(squared) : 0, a, 0, a);
}

// By a difference of two gradients. False where the body cannot move so far.
bool SoftMode::find_tangent(const At& at, const BodyMove& a, float* trial) const {
  const std::size_t length = energy_->length();
  const double step = kDifference * std::sqrt(std::abs(at.energy) + energy_->noise());
  std::copy(at.u, at.u + length, trial);
  add_multiple(static_cast<float>(step), a.move, length, trial);
  if (!(energy_->evaluate(trial, a.of_tangent).least_volume > 0)) return false;
  for (std::size_t i = 0; i < length; ++i) a.of_tangent[i] = (a.of_tangent[i] - at.f[i]) / static_cast<float>(step);
  return true;
}

void SoftMode::take_if_softer(const BodyMove& pair, double curvature) {
  const double expected = in_metric(pair, pair);
  if (!(curvature < (state_.follows ? std::min(state_.quotient, kSoft) : kSoft) * expected)) return;
  if (state_.follows) std::swap(mode_, last_);
  combine(0, mode_, 1, pair);
  if (!state_.follows) combine(0, last_, 0, mode_);
  state_.follows = 1, state_.quotient = curvature / expected;
}

// K^-1 of the residual of the mode, free and beside the mode.
void SoftMode::find_residual(const BodyMove& residual) const {
  const double quotient = in_tangent(mode_, mode_);
  for (std::size_t i = 0; i < energy_->length(); ++i)
    residual.of_metric[i] = mode_.of_tangent[i] - static_cast<float>(quotient) * mode_.of_metric[i];
  for (std::int32_t r = 0; r < rows_->count(); ++r) residual.local[r] = (1 - quotient) * mode_.local[r];
  std::copy(residual.of_metric, residual.of_metric + energy_->length(), residual.move);
  metric_->solve(residual.move);
  rows_->project(residual.move, residual.local, residual.of_metric);
  normalise(residual);
  combine(1, residual, -in_metric(mode_, residual), mode_);
  normalise(residual);
}

// The mode becomes the softest move in the space of it, the residual and the last change.
void SoftMode::combine_softest(const BodyMove& residual) {
  normalise(last_);
  for (int i = 0; i < 2; ++i) {
    combine(1, last_, -in_metric(mode_, last_), mode_);
    combine(1, last_, -in_metric(residual, last_), residual);
    normalise(last_);
  }
  const BodyMove* const basis[] = {&mode_, &residual, &last_};
  double a[3][3], share[3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) a[i][j] = a[j][i] = in_tangent(*basis[i], *basis[j]);
  if (!(in_metric(last_, last_) > 0.5)) a[2][2] = std::abs(a[0][0]) + std::abs(a[1][1]);
  least_eigenvector(a, share);
  combine(share[2], last_, share[1], residual);
  combine(share[0], mode_, 1, last_);
}

std::int32_t SoftMode::follow(const At& at, const BodyMove& work, float* trial) {
  if (state_.follows == 0 || --state_.follows > 0) return 0;
  state_.follows = 1;
  for (const BodyMove* move : {&mode_, &last_}) rows_->project(move->move, move->local, move->of_metric);
  normalise(mode_);
  if (!find_tangent(at, mode_, trial)) return 0;
  find_residual(work);
  if (!find_tangent(at, work, trial)) return 1;
  combine_softest(work);
  const double quotient = in_tangent(mode_, mode_),
               left = dot_product(at.f, mode_.move, energy_->length()) +
                      rows_->times_compliance(at.local, mode_.local) - rows_->work_of_applied(mode_.move),
               distance = std::abs(left) / (std::abs(quotient) * std::sqrt(2 * std::abs(at.energy) + energy_->noise()));
  // The metric takes a part that has turned for one that is sheared. A mode that is not soft in the stiffness at rest, turned with the state, is held; in
  // that its norm is this root.
  double turned = 1;
  const bool is_doubted = quotient < kHolds || distance > kFar;
  if (is_doubted) {
    std::copy(mode_.move, mode_.move + energy_->length(), trial);
    turned = std::min(1.0, energy_->turned_shear(at.u, trial));
  }
  state_.unheld = is_doubted && (quotient < kSoft * turned || distance * std::sqrt(turned) > kFar);
  const double fall = std::max(state_.quotient - quotient, 1e-3),
               wait = std::clamp(std::min(kWaits * quotient, quotient / (4 * fall)), 1.0, kMostWaits);
  state_.follows = quotient < kFollows ? static_cast<std::int32_t>(wait) : 0;
  state_.quotient = state_.follows ? quotient : 1;
  return is_doubted ? 3 : 2;
}

}  // namespace palpate
