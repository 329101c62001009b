// A measured compression curve of a cylinder -> the corrections P and Q of the paper (eqs 3-6).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/organ_config.h"

namespace palpate {

// Displacement of the top x (m), force f (N), radial displacement at mid-height d_r (m; empty where not measured), in
// order of x. The origin is part of the curve whether the file lists it or not, and is not listed here.
struct MeasuredCurve {
  std::vector<double> displacement, force, radial;
};

// CSV: a header displacement_mm,force_N[,radial_mm], '#' comments. Errors: InputError with the line for anything
// malformed, negative or not finite, a displacement that does not grow, a force or radial displacement that falls.
MeasuredCurve read_measured_curve(const std::filesystem::path& file);

// A polynomial with p(0) = 0, monotone on [0, range]: sum of coefficient[i] T_i(2 x / range - 1).
struct ResponsePolynomial {
  std::vector<double> coefficient;  // empty: not measured
  double range = 0;
  double rms = 0, largest = 0;  // deviation from the data, relative to the largest datum
  std::string note;             // what had to be done to the request; empty when nothing
  double operator()(double x) const;
};

// Least squares through the origin on the points (x, y), x > 0 ascending. Where the result is not monotone, it is the
// least squares among polynomials of that degree whose Bernstein coefficients grow, which is sufficient for it. Errors:
// InputError for fewer than 4 points. place is for the sentence.
ResponsePolynomial fit_response(const std::vector<double>& x, const std::vector<double>& y, int degree,
                                const std::string& place);

// P corrects the displacement orthogonal to the push, Q the force. Their arguments are what the linear model gives for
// a cylinder pressed by x: d_r^L = nu r x / h (eq. 3) and f^L = s E x / h (eq. 5), s = pi r^2.
struct ResponseFit {
  ResponsePolynomial radial, force;
};
ResponseFit fit_responses(const OrganConfig::Response& response);

}  // namespace palpate
