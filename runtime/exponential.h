// 1 - exp(-x), the same to the bit in every build: libraries' expm1 differ in the last digit.
#pragma once

namespace palpate {

// x of 0 and above. Relative error below 4e-16 times a few. Halved until it is small, then a series, then doubled back:
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

}  // namespace palpate
