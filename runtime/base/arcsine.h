// The arcsine of 0 .. 1, with the same bits in every build. The C library's function differs in the last digit from one version and one
// processor to the next.
#pragma once

#include <cmath>

namespace palpate {

// x: 0 .. 1. Result: radian. Absolute error below 3e-8.
// Source: Abramowitz and Stegun 1964, Handbook of Mathematical Functions, 4.4.46.
inline double arcsine(double x) {
  constexpr double a[] = {1.5707963050, -0.2145988016, 0.0889789874, -0.0501743046,
                          0.0308918810, -0.0170881256, 0.0066700901, -0.0012624911};
  double sum = a[7];
  for (int k = 6; k >= 0; --k) sum = a[k] + x * sum;
  return 1.5707963267948966 - std::sqrt(1 - x) * sum;
}

}  // namespace palpate
