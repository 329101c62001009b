#include "runtime/large/secant_pairs.h"

#include <algorithm>
#include <cmath>

#include "runtime/large/vector_loops.h"

namespace palpate {

bool SecantPairs::create(SceneMemory& memory, std::size_t length, const LargeRows* rows) {
  length_ = length, rows_ = rows;
  for (int i = 0; i < kMost; ++i) {
    moves_[i] = memory.array<float>(length), changes_[i] = memory.array<float>(length);
    local_moves_[i] = memory.array<double>(static_cast<std::size_t>(rows->most()));
  }
  return !memory.failed();
}

void SecantPairs::keep_state(SceneMemory& memory) {
  memory.keep(state_);
  for (int i = 0; i < kMost; ++i) {
    memory.keep_array(moves_[i], length_), memory.keep_array(changes_[i], length_);
    memory.keep_array(local_moves_[i], static_cast<std::size_t>(rows_->most()));
  }
}

void SecantPairs::before_metric(float* p, double* local, double* factor) const {
  for (int age = 0; age < state_.count; ++age) {
    const int i = pair(age);
    factor[age] =
        (dot_product(moves_[i], p, length_) + rows_->times_compliance(local_moves_[i], local)) / state_.curvature[i];
    add_multiple(static_cast<float>(-factor[age]), changes_[i], length_, p);
    for (std::int32_t r = 0; r < rows_->count(); ++r) local[r] -= factor[age] * local_moves_[i][r];
  }
}

void SecantPairs::after_metric(float* p, double* local, const double* factor) const {
  for (int age = state_.count - 1; age >= 0; --age) {
    const int i = pair(age);
    const double back =
        (dot_product(changes_[i], p, length_) + rows_->times_compliance(local_moves_[i], local)) / state_.curvature[i];
    add_multiple(static_cast<float>(factor[age] - back), moves_[i], length_, p);
    for (std::int32_t r = 0; r < rows_->count(); ++r) local[r] += (factor[age] - back) * local_moves_[i][r];
  }
}

int SecantPairs::add(double share, const float* p, const double* local_p, const float* f, const float* after,
                     double energy) {
  State& now = state_;
  const bool full = now.count == kMost;
  const int i = full ? now.first : (now.first + now.count) % kMost;
  for (std::size_t k = 0; k < length_; ++k) {
    moves_[i][k] = -static_cast<float>(share) * p[k];
    changes_[i][k] = after[k] - f[k];
  }
  std::fill(local_moves_[i], local_moves_[i] + rows_->most(), 0.0);
  for (std::int32_t r = 0; r < rows_->count(); ++r) local_moves_[i][r] = -share * local_p[r];
  now.curvature[i] =
      dot_product(moves_[i], changes_[i], length_) + rows_->times_compliance(local_moves_[i], local_moves_[i]);
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
    const int i = pair(age);
    std::fill(local_moves_[i], local_moves_[i] + rows_->most(), 0.0);
    state_.curvature[i] = dot_product(moves_[i], changes_[i], length_);
    if (!(state_.curvature[i] > 0)) return drop();
  }
}

void SecantPairs::drop_before_mark() {
  const std::int32_t old = std::max(0, state_.count - state_.marked);
  state_.first = (state_.first + old) % kMost, state_.count -= old;
  state_.scale = 1, state_.since_scale = 0;
}

}  // namespace palpate
