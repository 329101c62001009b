#include "runtime/contact/offset_followers.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// A pivot of V below this share of its diagonal is rounding: B is stored in single precision, so that the square of its error is 4e-15 of V.
constexpr double kLeastPivot = 1e-10;

}  // namespace

bool OffsetFollowers::create(SceneMemory& memory, const OffsetRows* rows) {
  rows_ = rows;
  const auto count = static_cast<std::size_t>(rows->count);
  factor_ = memory.array<double>(count * count), row_ = memory.array<std::int32_t>(count);
  return !memory.failed();
}

void OffsetFollowers::keep(SceneMemory& memory) {
  const auto count = static_cast<std::size_t>(rows_->count);
  memory.keep_array(factor_, count * count), memory.keep_array(row_, count);
  memory.keep(count_), memory.keep(factored_);
}

bool OffsetFollowers::factorise(std::int32_t of, const std::int32_t* which, const double* v, double* factor) {
  std::int32_t at[kMostOffsetRows], n = 0;
  for (std::int32_t m = 0; m < of; ++m)
    if (which[m]) at[n++] = m;
  const auto entry = [&](std::int32_t i, std::int32_t j) { return v[at[i] * of + at[j]]; };
  const auto l = [&](std::int32_t i, std::int32_t j) -> double& { return factor[i * of + j]; };
  for (std::int32_t i = 0; i < n; ++i)
    for (std::int32_t j = 0; j <= i; ++j) {
      double sum = 0.5 * (entry(i, j) + entry(j, i));
      for (std::int32_t k = 0; k < j; ++k) sum -= l(i, k) * l(j, k);
      if (i == j && !(sum > kLeastPivot * entry(i, i))) return false;
      l(i, j) = i == j ? std::sqrt(sum) : sum / l(j, j);
    }
  return true;
}

void OffsetFollowers::follow(std::int32_t of, const std::int32_t* which, const double* v) {
  factorise(of, which, v, factor_);
  count_ = 0, factored_ = of;
  for (std::int32_t m = 0; m < of; ++m)
    if (which[m]) row_[count_++] = m;
}

bool OffsetFollowers::follows(std::int32_t row) const {
  return std::find(row_, row_ + count_, row) != row_ + count_;
}

template <class Number>
void OffsetFollowers::solve_for(Number* amounts) const {
  const auto l = [&](std::int32_t i, std::int32_t k) { return factor_[i * factored_ + k]; };
  for (std::int32_t i = 0; i < count_; ++i) {
    Number& x = amounts[row_[i]];
    for (std::int32_t k = 0; k < i; ++k) x = x - l(i, k) * amounts[row_[k]];
    x = (1 / l(i, i)) * x;
  }
  for (std::int32_t i = count_; i-- > 0;) {
    Number& x = amounts[row_[i]];
    for (std::int32_t k = i + 1; k < count_; ++k) x = x - l(k, i) * amounts[row_[k]];
    x = (1 / l(i, i)) * x;
  }
}

void OffsetFollowers::solve(double* amounts) const {
  solve_for(amounts);
}

void OffsetFollowers::subtract_force(std::int32_t node, Vec3 force, double* amounts) const {
  for (std::int32_t i = 0; i < count_; ++i) amounts[row_[i]] -= dot(rows_->at(row_[i], node), force);
}

void OffsetFollowers::find_response(std::int32_t node, Vec3* response) const {
  for (std::int32_t i = 0; i < count_; ++i) response[row_[i]] = rows_->at(row_[i], node);
  solve_for(response);
}

Mat3 OffsetFollowers::between(std::int32_t other, const Vec3* response) const {
  Mat3 sum;
  for (std::int32_t i = 0; i < count_; ++i) {
    const Vec3 u = rows_->at(row_[i], other);
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) sum.m[j][k] += u[j] * response[row_[i]][k];
  }
  return sum;
}

}  // namespace palpate
