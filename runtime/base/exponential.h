// 1 - exp(-x) and the natural logarithm, with the same bits in every build. The C library's functions differ in the last digit
// from one version and one processor to the next.
#pragma once

#include <cmath>

namespace palpate {

// x: 0 or more. Relative error: a few times 4e-16. Halves x until it is small, sums a series, and doubles back with
// q(2x) = q(x) (2 - q(x)).
inline double one_minus_exp(double x) {
  if (!(x < 50)) return 1;
  int halvings = 0;
  while (x > 0.0625) x *= 0.5, ++halvings;
  double sum = 1;  // 1 - x/2 (1 - x/3 (1 - x/4 ...))
  for (int k = 10; k >= 2; --k) sum = 1 - x / k * sum;
  double q = x * sum;
  for (; halvings > 0; --halvings) q = q * (2 - q);
  return q;
}

// x: finite, above 0. Absolute error below 2e-16 (1 + |ln x|). With x = m 2^k: ln m = 2 artanh((m - 1) / (m + 1)).
inline double natural_log(double x) {
  int k = 0;
  double m = std::frexp(x, &k);
  if (m < 0.70710678118654752) m *= 2, --k;
  const double z = (m - 1) / (m + 1), square = z * z;
  double sum = 0;
  for (int n = 11; n >= 0; --n) sum = 1.0 / (2 * n + 1) + square * sum;
  return 2 * z * sum + k * 0.69314718055994531;
}

}  // namespace palpate
