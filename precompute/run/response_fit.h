// The measured curve of a compressed cylinder -> the corrections P and Q of the paper (eqs 3-6).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/organ_config.h"

namespace palpate {

// Of a cylinder that is compressed: displacement of its top x (m), force f (N) and radial displacement at half its
// height d_r (m; empty where it was not measured). x grows. The origin belongs to every curve and is not listed here.
struct MeasuredCurve {
  std::vector<double> displacement, force, radial;
};

// Reads a CSV file with the header displacement_mm,force_N[,radial_mm]; '#' begins a comment. Errors: InputError that
// names the line, for anything malformed, negative or not finite, for a displacement that does not grow and for a force
// or radial displacement that falls.
MeasuredCurve read_measured_curve(const std::filesystem::path& file);

// A polynomial with p(0) = 0 that grows on [0, range]: the sum of coefficient[i] T_i(2 x / range - 1), where T_i are
// Chebyshev polynomials.
struct ResponsePolynomial {
  std::vector<double> coefficient;  // empty: not measured
  double range = 0;
  double rms = 0, largest = 0;  // distance from the data, relative to the largest value
  std::string note;             // where the fit is not the one that was asked for: what was changed
  double operator()(double x) const;
};

// The least-squares polynomial through the origin and near the points (x, y), where x > 0 ascends. Where it falls
// somewhere on [0, range], the result is the least-squares polynomial among those whose Bernstein coefficients grow:
// these polynomials grow everywhere. Errors: InputError for fewer than 4 points; its sentence begins with place.
ResponsePolynomial fit_response(const std::vector<double>& x, const std::vector<double>& y, int degree,
                                const std::string& place);

// P corrects the displacement at right angles to the push, Q corrects the force. Their arguments are what linear
// elasticity gives for a cylinder of height h, radius r and top area s = pi r^2 that is pressed by x: d_r^L = nu r x /
// h (eq. 3) and f^L = s E x / h (eq. 5).
struct ResponseFit {
  ResponsePolynomial radial, force;
};
ResponseFit fit_responses(const OrganConfig::Response& response);

}  // namespace palpate
