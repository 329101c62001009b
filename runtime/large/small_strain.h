// Functions of the change of volume j = J - 1 that keep their relative precision as j goes to zero. They use the four
// operations alone, so that every platform computes the same bits. j must be above -1.
#pragma once

#include "runtime/large/lanes.h"

namespace palpate {

// (1 + j)^(1/3) - 1 by Halley's method on (1 + d)^3 - 1 = j. Single precision from J = 0.01 to 100.
template <class Real>
PALPATE_INLINE Real cube_root_of_one_plus(const Real& j) {
  constexpr int steps = sizeof(Scalar<Real>) == 4 ? 3 : 4;
  Real d = j / (3 + j);
  for (int i = 0; i < steps; ++i) {
    const Real q = 1 + d, miss = d * (3 + d * (3 + d)) - j;
    d = d - q * miss / (2 * q * q * q + 1 + j);
  }
  return d;
}

// j - ln(1 + j). Two cube roots bring 1 + j near to 1, where ln(1 + e) = 2 (s + s^3/3 + s^5/5 + ...) with s = e / (2 + e).
template <class Real>
PALPATE_INLINE Real minus_logarithm_of_one_plus(const Real& j) {
  constexpr int terms = sizeof(Scalar<Real>) == 4 ? 5 : 12;
  const Real d = cube_root_of_one_plus(j), e = cube_root_of_one_plus(d);
  const Real s = e / (2 + e), square = s * s;
  Real series = Real{};
  for (int k = terms; k >= 1; --k) series = square * (series + Scalar<Real>(1) / static_cast<Scalar<Real>>(2 * k + 1));
  const Real of_e = e * s - 2 * s * series;
  const Real of_d = e * e * (3 + e) + 3 * of_e;
  return d * d * (3 + d) + 3 * of_d;
}

// exp(x) - 1, for x from 0 to 32: a Taylor polynomial of x / 64, squared six times.
template <class Real>
PALPATE_INLINE Real exponential_minus_one(const Real& x) {
  constexpr int terms = sizeof(Scalar<Real>) == 4 ? 8 : 15;
  const Real h = x * (Scalar<Real>(1) / 64);
  Real sum = Real{} + 1;
  for (int k = terms; k >= 2; --k) sum = 1 + sum * h * (Scalar<Real>(1) / static_cast<Scalar<Real>>(k));
  Real result = h * sum;
  for (int i = 0; i < 6; ++i) result = result * (2 + result);
  return result;
}

}  // namespace palpate
