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

// exp(x) - 1, and exp(x) - 1 - x, whose digits stay too as x goes to zero. x from -32 to 32, as above.
template <class Real>
struct ExponentialRests {
  Real of_one, of_line;
};
template <class Real>
PALPATE_INLINE ExponentialRests<Real> exponential_rests(const Real& x) {
  constexpr int terms = sizeof(Scalar<Real>) == 4 ? 8 : 15;
  const Real h = x * (Scalar<Real>(1) / 64);
  Real sum = Real{} + 1;
  for (int k = terms; k >= 3; --k) sum = 1 + sum * h * (Scalar<Real>(1) / static_cast<Scalar<Real>>(k));
  Real line = Scalar<Real>(0.5) * h * h * sum, one = h + line;
  for (int i = 0; i < 6; ++i) line = 2 * line + one * one, one = one * (2 + one);
  return {one, line};
}

// ln(1 + y), for 1 + y from 4e-4 to 3000. Powers of two bring 1 + y near to 1 unless it is there; then as above.
template <class Real>
PALPATE_INLINE Real logarithm_of_one_plus(const Real& y) {
  using Number = Scalar<Real>;
  constexpr int terms = sizeof(Number) == 4 ? 4 : 11;
  constexpr Number log_of_2 = Number(0.6931471805599453);
  Real e = y, powers = Real{};
  PALPATE_ROLLED
  for (int power = 8; power > 0; power /= 2) {
    const auto factor = static_cast<Number>(1 << power);
    const Real most = Real{} + (power == 1 ? Number(1.45) : static_cast<Number>(1 << power / 2)), one = Real{} + 1;
    const Real large = e > most - one ? one : Real{}, small = (1 + e) * most < one ? one : Real{};
    const Real scale = 1 + large * (1 / factor - 1) + small * (factor - 1);
    e = scale * e + (scale - 1);
    powers = powers + static_cast<Number>(power) * (large - small);
  }
  const Real s = e / (2 + e), square = s * s;
  Real series = Real{};
  for (int k = terms; k >= 1; --k) series = square * (series + Number(1) / static_cast<Number>(2 * k + 1));
  return log_of_2 * powers + 2 * (s + s * series);
}

}  // namespace palpate
