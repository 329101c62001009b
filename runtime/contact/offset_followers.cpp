// The amounts of an offset that follow the contacts' forces.
#include <algorithm>
#include <cmath>

#include "runtime/contact/offset.h"

namespace palpate {
namespace {

// A pivot of V below this share of its diagonal is rounding: B is stored in single precision, so that the square of its error is 4e-15 of V.
constexpr double kLeastPivot = 1e-10;

}  // namespace

bool Offset::factorise(std::int32_t of, const std::int32_t* which, const double* v, double* factor) {
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

void Offset::follow(std::int32_t of, const std::int32_t* which, const double* v) {
  factorise(of, which, v, factor_);
  follower_count_ = 0, factored_ = of, ++version_;
  for (std::int32_t m = 0; m < of; ++m)
    if (which[m]) follower_[follower_count_++] = m;
}

void Offset::start_from(const double* q, const double* whole) {
  restarted_ = length_of(given_, nullptr);
  for (std::int32_t m = 0; m < count(); ++m) now_[m] = q[m], given_[m] = whole[m] - q[m];
}

void Offset::take_forces(const ContactConstraints& set, const Vec3* force) {
  restarted_ = 0;
  if (!has_given()) return;
  std::copy_n(given_, count(), given_before_);
  std::fill_n(given_, count(), 0.0);
  for (std::int32_t e = 0; e < set.node_count; ++e) subtract_force(set.nodes[e].node, force[e], given_);
  solve(given_);
}

Vec3 Offset::given_by(const double* amounts, std::int32_t node) const {
  return rows_.sum_at(amounts, node);
}

bool Offset::follows(std::int32_t row) const {
  return std::find(follower_, follower_ + follower_count_, row) != follower_ + follower_count_;
}

template <class Number>
void Offset::solve_for(Number* amounts) const {
  const auto l = [&](std::int32_t i, std::int32_t k) { return factor_[i * factored_ + k]; };
  for (std::int32_t i = 0; i < follower_count_; ++i) {
    Number& x = amounts[follower_[i]];
    for (std::int32_t k = 0; k < i; ++k) x = x - l(i, k) * amounts[follower_[k]];
    x = (1 / l(i, i)) * x;
  }
  for (std::int32_t i = follower_count_; i-- > 0;) {
    Number& x = amounts[follower_[i]];
    for (std::int32_t k = i + 1; k < follower_count_; ++k) x = x - l(k, i) * amounts[follower_[k]];
    x = (1 / l(i, i)) * x;
  }
}

void Offset::solve(double* amounts) const {
  solve_for(amounts);
}

void Offset::subtract_force(std::int32_t node, Vec3 force, double* amounts) const {
  for (std::int32_t i = 0; i < follower_count_; ++i) amounts[follower_[i]] -= dot(rows_.at(follower_[i], node), force);
}

void Offset::find_response(std::int32_t node, Vec3* response) const {
  for (std::int32_t i = 0; i < follower_count_; ++i) response[follower_[i]] = rows_.at(follower_[i], node);
  solve_for(response);
}

Mat3 Offset::between(std::int32_t other, const Vec3* response) const {
  Mat3 sum;
  for (std::int32_t i = 0; i < follower_count_; ++i) {
    const Vec3 u = rows_.at(follower_[i], other);
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) sum.m[j][k] += u[j] * response[follower_[i]][k];
  }
  return sum;
}

}  // namespace palpate
