// The measured curve of a compressed cylinder -> the corrections P and Q of the paper (eqs 3-6).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/organ_config.h"

namespace palpate {

// The compression test of a cylinder: displacement x of its top (m), force f (N) and radial displacement d_r at half its
// height (m; empty where it was not measured). x ascends. Every curve begins at the origin, which is not listed here.
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
  std::string note;             // what was changed, if the fit is not the one that was asked for
  double operator()(double x) const;
};

// The least-squares polynomial through the origin and near the points (x, y), where x > 0 ascends. Where it falls
// somewhere on [0, range], the result is the least-squares polynomial among those whose Bernstein coefficients grow:
// these polynomials grow everywhere. Errors: InputError for fewer than 4 points; its sentence begins with place.
ResponsePolynomial fit_response(const std::vector<double>& x, const std::vector<double>& y, int degree,
                                const std::string& place);

// P corrects the displacement at right angles to the push, Q corrects the force. Their arguments are what linear elasticity
// predicts for a cylinder of height h, radius R and top area A = pi R^2 that is pressed by x: d_r^lin = nu R x / h (eq. 3) for
// P, f^lin = A E x / h (eq. 5) for Q.
struct ResponseFit {
  ResponsePolynomial radial, force;
};
ResponseFit fit_responses(const OrganConfig::Response& response);

}  // namespace palpate
