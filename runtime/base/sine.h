// Sine and cosine with the same bits in every build. The C library's functions differ in the last digit from one version and one
// processor to the next.
#pragma once

#include <cmath>

namespace palpate {

struct SineCosine {
  double sine = 0, cosine = 1;
};

// x: radian, finite. Error: below 1e-15 (1 + |x|), because each doubling doubles it. Halves x until it is small, sums two series, and doubles back with
// sin(2x) = 2 sin(x) cos(x), cos(2x) = 1 - 2 sin(x)^2.
inline SineCosine sine_cosine(double x) {
  int halvings = 0;
  while (std::fabs(x) > 0.0625) x *= 0.5, ++halvings;
  const double square = x * x;
  double sine = 1, less = 1;  // sin(x) / x, and (1 - cos(x)) / (x^2 / 2)
  for (int k = 10; k >= 2; k -= 2) {
    sine = 1 - square / (k * (k + 1)) * sine;
    less = 1 - square / ((k + 1) * (k + 2)) * less;
  }
  sine *= x;
  double fall = 0.5 * square * less;  // 1 - cos(x), which keeps its digits where cos(x) is near 1
  for (; halvings > 0; --halvings) {
    const double doubled = 2 * sine * sine;
    sine = 2 * sine * (1 - fall);
    fall = doubled;
  }
  return {sine, 1 - fall};
}

}  // namespace palpate
