// A measured correction curve, P or Q: odd, zero at zero, continued linearly outside its measured range.
#pragma once

namespace palpate {

class ResponseCurve {
 public:
  static constexpr int kMaxCoefficients = 33;

  // coefficients: Chebyshev T_0 .. T_(count-1) on [0, range]. False when count, range or a number is unusable.
  // The curve is kept as its quotient y(x)/x, a polynomial of one degree less, so that small x loses no digits.
  // Source: DESIGN section 4; Cotin, Delingette and Ayache 1999, eqs 3-6.
  bool set(const double* coefficients, int count, double range);

  // y(x)/x, even in x; finite for every finite x.
  double ratio(double x) const;
  double value(double x) const { return x * ratio(x); }
  double range() const { return range_; }
  bool outside(double x) const { return x > range_ || x < -range_; }

  int ratio_count() const { return count_; }
  const double* ratio_coefficients() const { return ratio_; }
  double end_value() const { return end_value_; }
  double end_slope() const { return end_slope_; }

 private:
  double ratio_[kMaxCoefficients] = {};
  int count_ = 0;
  double range_ = 0, end_value_ = 0, end_slope_ = 0;
};

// sum_k c_k T_k(t) by Clenshaw's recurrence.
double chebyshev_sum(const double* c, int count, double t);

}  // namespace palpate
