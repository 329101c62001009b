#include "runtime/tissue/response_curve.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kPi = 3.14159265358979323846;

// The cosine of an angle in 0 .. pi, by its series about pi / 2: C libraries' cosines differ in the last digit, even within one
// library from processor to processor.
double cosine(double angle) {
  const double x = kPi / 2 - angle, square = x * x;
  double sum = 1;  // 1 - x^2/(2 3) (1 - x^2/(4 5) (1 - ...))
  for (int k = 27; k >= 3; k -= 2) sum = 1 - square / (k * (k - 1)) * sum;
  return x * sum;
}

}  // namespace

double chebyshev_sum(const double* c, int count, double t) {
  double b1 = 0, b2 = 0;
  for (int k = count - 1; k >= 1; --k) {
    const double b0 = c[k] + 2 * t * b1 - b2;
    b2 = b1;
    b1 = b0;
  }
  return c[0] + t * b1 - b2;
}

bool ResponseCurve::set(const double* coefficients, int count, double range) {
  if (count < 2 || count > kMaxCoefficients || !(range > 0) || !std::isfinite(range)) return false;
  for (int k = 0; k < count; ++k)
    if (!std::isfinite(coefficients[k])) return false;
  range_ = range;
  count_ = count - 1;

  // Interpolates the quotient at its Chebyshev nodes, none of which is x = 0. The fit's rounding error at zero is subtracted
  // first.
  const double at_zero = chebyshev_sum(coefficients, count, -1);
  for (double& c : ratio_) c = 0;
  for (int i = 0; i < count_; ++i) {
    const double t = cosine(kPi * (i + 0.5) / count_);
    const double sample = (chebyshev_sum(coefficients, count, t) - at_zero) / (range * (t + 1) / 2);
    double polynomial = 1, before = t;  // T_0(t), T_-1(t)
    for (int k = 0; k < count_; ++k) {
      ratio_[k] += sample * polynomial * (k == 0 ? 1.0 : 2.0) / count_;
      const double next = 2 * t * polynomial - before;
      before = polynomial, polynomial = next;
    }
  }

  // T_k(1) = 1 and T_k'(1) = k^2, so the value and the slope at the end of the range are plain sums.
  double end = 0, slope = 0;
  for (int k = 0; k < count_; ++k) end += ratio_[k], slope += ratio_[k] * k * k;
  end_value_ = range * end;
  // d/dx (x ratio) at x = range, dt/dx = 2 / range. A rising curve that ends flat may have a slope of minus some rounding.
  end_slope_ = std::max(0.0, end + slope * 2);
  return std::isfinite(end_value_) && std::isfinite(end_slope_);
}

double ResponseCurve::ratio(double x) const {
  const double size = std::fabs(x);
  if (size > range_) return (end_value_ + end_slope_ * (size - range_)) / size;
  return chebyshev_sum(ratio_, count_, 2 * size / range_ - 1);
}

}  // namespace palpate
