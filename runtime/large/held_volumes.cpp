#include "runtime/large/held_volumes.h"

#include <cmath>

#include "runtime/large/vector_loops.h"

namespace palpate {

bool HeldVolumes::create(SceneMemory& memory, std::int32_t most, std::size_t length) {
  most_ = most, length_ = length;
  const auto numbers = static_cast<std::size_t>(most) * length;
  gradient_ = memory.array<float>(numbers), response_ = memory.array<float>(numbers);
  factor_ = memory.array<double>(static_cast<std::size_t>(most) * static_cast<std::size_t>(most));
  return !memory.failed();
}

double HeldVolumes::compliance(std::int32_t i, std::int32_t j) const {
  return dot_product(gradient(i), response(j), length_);
}

// A pivot that is rounding becomes so large that its volume does nothing.
void HeldVolumes::factor(const double* stiffness) {
  constexpr double least_pivot = 1e-6;
  for (std::int32_t i = 0; i < count_; ++i)
    for (std::int32_t j = 0; j <= i; ++j) {
      double sum = 0.5 * (compliance(i, j) + compliance(j, i));
      if (i == j) sum += 1 / stiffness[i];
      const double whole = sum;
      for (std::int32_t k = 0; k < j; ++k) sum -= factor_[i * most_ + k] * factor_[j * most_ + k];
      if (i != j)
        factor_[i * most_ + j] = sum / factor_[j * most_ + j];
      else
        factor_[i * most_ + i] = sum > least_pivot * whole ? std::sqrt(sum) : 1e6 * std::sqrt(std::fabs(whole));
    }
}

void HeldVolumes::solve(double* amounts) const {
  for (std::int32_t i = 0; i < count_; ++i) {
    for (std::int32_t k = 0; k < i; ++k) amounts[i] -= factor_[i * most_ + k] * amounts[k];
    amounts[i] /= factor_[i * most_ + i];
  }
  for (std::int32_t i = count_ - 1; i >= 0; --i) {
    for (std::int32_t k = i + 1; k < count_; ++k) amounts[i] -= factor_[k * most_ + i] * amounts[k];
    amounts[i] /= factor_[i * most_ + i];
  }
}

void HeldVolumes::before(const float* b, double* amounts) const {
  for (std::int32_t i = 0; i < count_; ++i) amounts[i] = dot_product(response(i), b, length_);
  solve(amounts);
}

void HeldVolumes::after(const double* amounts, float* x) const {
  for (std::int32_t i = 0; i < count_; ++i) add_multiple(static_cast<float>(-amounts[i]), response(i), length_, x);
}

}  // namespace palpate
