// A measured correction curve y(x): P or Q. It is odd, zero at zero, and continues as a straight line with the same slope
// outside its measured range.
#pragma once

#include "formats/response_check.h"

namespace palpate {

class ResponseCurve {
 public:
  static constexpr int kMaxCoefficients = formats::kMostResponseCoefficients;

  // coefficients: [count] of the Chebyshev polynomials T_0 .. T_(count-1) on [0, range]. False where one of the numbers cannot be
  // used; formats::check_response says more, and a bundle's curve must pass it. The curve is kept as the quotient y(x)/x, a polynomial of one degree less, which keeps all digits at small x.
  // Source: Cotin, Delingette and Ayache 1999, eqs 3-6.
  bool set(const double* coefficients, int count, double range);

  // y(x)/x: even in x, finite for every finite x.
  double ratio(double x) const;
  double value(double x) const { return x * ratio(x); }
  double range() const { return range_; }
  bool outside(double x) const { return x > range_ || x < -range_; }

  bool exists() const { return count_ > 0; }  // set() was called
  int ratio_count() const { return count_; }
  const double* ratio_coefficients() const { return ratio_; }
  double end_value() const { return end_value_; }
  double end_slope() const { return end_slope_; }

 private:
  double ratio_[kMaxCoefficients] = {};
  int count_ = 0;
  double range_ = 0, end_value_ = 0, end_slope_ = 0;
};

// sum_k c_k T_k(t), by Clenshaw's recurrence.
double chebyshev_sum(const double* c, int count, double t);

}  // namespace palpate
