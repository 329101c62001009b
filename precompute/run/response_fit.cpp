#include "precompute/run/response_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "formats/csv_lines.h"
#include "formats/errors.h"
#include "formats/response_check.h"

namespace palpate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kFewestPoints = 4;

[[noreturn]] void bad_line(const std::filesystem::path& file, int line, const std::string& what) {
  throw InputError(fmt::format("{}:{}: {}", file.string(), line, what));
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) {
    const auto from = cell.find_first_not_of(" \t"), to = cell.find_last_not_of(" \t");
    cells.push_back(from == std::string::npos ? "" : cell.substr(from, to - from + 1));
  }
  if (!line.empty() && line.back() == ',') cells.push_back("");
  return cells;
}

double number(const std::filesystem::path& file, int line, const std::string& cell) {
  std::size_t used = 0;
  double value = 0;
  try {
    value = std::stod(cell, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != cell.size() || !std::isfinite(value) || value < 0)
    bad_line(file, line, fmt::format("expected a number that is not negative, found \"{}\"", cell));
  return value;
}

// The Chebyshev polynomials T_0(t) .. T_degree(t).
VectorXd chebyshev(double t, int degree) {
  VectorXd values(degree + 1);
  values[0] = 1;
  if (degree > 0) values[1] = t;
  for (int i = 2; i <= degree; ++i) values[i] = 2 * t * values[i - 1] - values[i - 2];
  return values;
}

// The Bernstein polynomials of that degree on [0, 1].
VectorXd bernstein(double s, int degree) {
  VectorXd values = VectorXd::Zero(degree + 1);
  values[0] = 1;
  for (int k = 1; k <= degree; ++k)
    for (int i = k; i >= 0; --i) values[i] = (1 - s) * values[i] + (i > 0 ? s * values[i - 1] : 0.0);
  return values;
}

double evaluate(const VectorXd& coefficient, double s) {
  return chebyshev(2 * s - 1, static_cast<int>(coefficient.size()) - 1).dot(coefficient);
}

// Least squares in the basis T_i - T_i(-1), i = 1 .. degree, whose polynomials are zero at the origin.
VectorXd solve_free(const VectorXd& s, const VectorXd& y, int degree) {
  MatrixXd basis(s.size(), degree);
  for (Eigen::Index p = 0; p < s.size(); ++p) {
    const VectorXd values = chebyshev(2 * s[p] - 1, degree);
    for (int i = 1; i <= degree; ++i) basis(p, i - 1) = values[i] - (i % 2 ? -1.0 : 1.0);
  }
  const VectorXd free = basis.colPivHouseholderQr().solve(y);
  VectorXd coefficient(degree + 1);
  coefficient[0] = 0;
  for (int i = 1; i <= degree; ++i) {
    coefficient[i] = free[i - 1];
    coefficient[0] -= (i % 2 ? -1.0 : 1.0) * free[i - 1];
  }
  return coefficient;
}

// The x >= 0 that minimises |A x - y| (algorithm NNLS; Lawson and Hanson 1974).
VectorXd solve_not_negative(const MatrixXd& a, const VectorXd& y) {
  const Eigen::Index n = a.cols();
  VectorXd x = VectorXd::Zero(n);
  std::vector<char> passive(n, 0);
  const double small = 1e-13 * (a.transpose() * y).cwiseAbs().maxCoeff();
  for (int outer = 0; outer < 3 * n + 10; ++outer) {
    const VectorXd gradient = a.transpose() * (y - a * x);
    Eigen::Index best = -1;
    for (Eigen::Index i = 0; i < n; ++i)
      if (!passive[i] && gradient[i] > small && (best < 0 || gradient[i] > gradient[best])) best = i;
    if (best < 0) break;
    passive[best] = 1;
    for (;;) {
      std::vector<Eigen::Index> set;
      for (Eigen::Index i = 0; i < n; ++i)
        if (passive[i]) set.push_back(i);
      MatrixXd part(a.rows(), static_cast<Eigen::Index>(set.size()));
      for (std::size_t i = 0; i < set.size(); ++i) part.col(static_cast<Eigen::Index>(i)) = a.col(set[i]);
      const VectorXd z = part.colPivHouseholderQr().solve(y);
      double step = 1;
      for (std::size_t i = 0; i < set.size(); ++i)
        if (z[static_cast<Eigen::Index>(i)] <= 0) {
          const double drop = x[set[i]] - z[static_cast<Eigen::Index>(i)];
          step = std::min(step, drop > 0 ? x[set[i]] / drop : 0.0);
        }
      for (std::size_t i = 0; i < set.size(); ++i) x[set[i]] += step * (z[static_cast<Eigen::Index>(i)] - x[set[i]]);
      if (step >= 1) break;
      for (const auto i : set)
        if (x[i] <= 1e-15) x[i] = 0, passive[i] = 0;
    }
  }
  return x;
}

// Least squares among polynomials whose Bernstein coefficients are sums of increments that are not negative.
VectorXd solve_monotone(const VectorXd& s, const VectorXd& y, int degree) {
  MatrixXd basis(s.size(), degree);
  for (Eigen::Index p = 0; p < s.size(); ++p) {
    const VectorXd values = bernstein(s[p], degree);
    for (int j = 1; j <= degree; ++j) basis(p, j - 1) = values.tail(degree + 1 - j).sum();
  }
  const VectorXd increment = solve_not_negative(basis, y);
  // The same polynomial in the Chebyshev basis, by interpolation at the Chebyshev points; then made exactly zero at the
  // origin.
  const int count = degree + 1;
  MatrixXd at(count, count);
  VectorXd value(count);
  for (int p = 0; p < count; ++p) {
    const double t = -std::cos(std::numbers::pi * (p + 0.5) / count), x = (t + 1) / 2;
    at.row(p) = chebyshev(t, degree);
    const VectorXd values = bernstein(x, degree);
    value[p] = 0;
    for (int j = 1; j <= degree; ++j) value[p] += increment[j - 1] * values.tail(degree + 1 - j).sum();
  }
  VectorXd coefficient = at.colPivHouseholderQr().solve(value);
  coefficient[0] = 0;
  for (int i = 1; i <= degree; ++i) coefficient[0] -= (i % 2 ? -1.0 : 1.0) * coefficient[i];
  return coefficient;
}

// Whether the polynomial with p(0) = 0 grows on [0, 1], as the runtime asks of a stored curve.
bool is_monotone(const VectorXd& coefficient) {
  const auto fault = formats::check_response(coefficient.data(), static_cast<std::size_t>(coefficient.size()), 1).fault;
  return fault == formats::ResponseFault::none || fault == formats::ResponseFault::scale;
}

}  // namespace

MeasuredCurve read_measured_curve(const std::filesystem::path& file) {
  CsvLines lines(file, "the measured curve of [response]");
  MeasuredCurve curve;
  bool radial = false, header = false;
  double last[3] = {0, 0, 0};
  while (lines.next()) {
    const int line = lines.number();
    const auto cells = split(lines.text());
    if (!header) {
      radial = cells.size() == 3;
      if (cells.size() < 2 || cells.size() > 3 || cells[0] != "displacement_mm" || cells[1] != "force_N" ||
          (radial && cells[2] != "radial_mm"))
        lines.refuse("the header displacement_mm,force_N[,radial_mm]");
      header = true;
      continue;
    }
    if (cells.size() != (radial ? 3u : 2u))
      bad_line(file, line, fmt::format("expected {} numbers, found {}", radial ? 3 : 2, cells.size()));
    const double x = number(file, line, cells[0]), f = number(file, line, cells[1]);
    const double r = radial ? number(file, line, cells[2]) : 0;
    if (x == 0) {
      if (f != 0 || r != 0) bad_line(file, line, "expected no force and no radial displacement at displacement 0");
      continue;
    }
    if (x <= last[0])
      bad_line(file, line, fmt::format("expected displacements that grow, found {} after {}", x, last[0]));
    if (f < last[1])
      bad_line(file, line,
               fmt::format("expected a force that does not fall, found {} N after {} N; the correction must be "
                           "monotone: smooth the curve or cut it before it softens",
                           f, last[1]));
    if (r < last[2])
      bad_line(file, line,
               fmt::format("expected a radial displacement that does not fall, found {} mm after {} mm", r, last[2]));
    last[0] = x, last[1] = f, last[2] = r;
    curve.displacement.push_back(1e-3 * x);
    curve.force.push_back(f);
    if (radial) curve.radial.push_back(1e-3 * r);
  }
  if (!header)
    throw InputError(
        fmt::format("{}: expected a header displacement_mm,force_N[,radial_mm], found none", file.string()));
  if (curve.force.empty() || curve.force.back() <= 0)
    throw InputError(fmt::format("{}: expected a force above 0 at the last displacement, found none", file.string()));
  if (radial && curve.radial.back() <= 0)
    throw InputError(
        fmt::format("{}: expected a radial displacement above 0 at the last displacement, found none; leave "
                    "the column out where it was not measured",
                    file.string()));
  return curve;
}

double ResponsePolynomial::operator()(double x) const {
  return evaluate(Eigen::Map<const VectorXd>(coefficient.data(), static_cast<Eigen::Index>(coefficient.size())),
                  x / range);
}

ResponsePolynomial fit_response(const std::vector<double>& x, const std::vector<double>& y, int degree,
                                const std::string& place) {
  const int points = static_cast<int>(x.size());
  if (points < kFewestPoints)
    throw InputError(
        fmt::format("{}: expected at least {} points beside the origin, found {}", place, kFewestPoints, points));
  ResponsePolynomial result;
  result.range = x.back();
  if (points < degree) {
    result.note = fmt::format("degree {} lowered to {}, the number of points", degree, points);
    degree = points;
  }
  const double scale = y.back();
  VectorXd s(points), v(points);
  for (int p = 0; p < points; ++p) s[p] = x[p] / result.range, v[p] = y[p] / scale;
  VectorXd coefficient = solve_free(s, v, degree);
  if (!is_monotone(coefficient)) {
    coefficient = solve_monotone(s, v, degree);
    result.note += fmt::format("{}constrained to be monotone", result.note.empty() ? "" : "; ");
  }
  double squares = 0;
  for (int p = 0; p < points; ++p) {
    const double error = std::abs(evaluate(coefficient, s[p]) - v[p]);
    squares += error * error;
    result.largest = std::max(result.largest, error);
  }
  result.rms = std::sqrt(squares / points);
  for (const double c : coefficient) result.coefficient.push_back(scale * c);
  return result;
}

ResponseFit fit_responses(const OrganConfig::Response& response) {
  const MeasuredCurve curve = read_measured_curve(response.curve);
  const double area = std::numbers::pi * response.radius * response.radius;
  std::vector<double> linear_force, linear_radial;
  for (const double x : curve.displacement) {
    linear_force.push_back(area * response.young * x / response.height);
    linear_radial.push_back(response.poisson * response.radius * x / response.height);
  }
  if (curve.displacement.back() >= response.height)
    throw InputError(fmt::format("{}: the last displacement ({} mm) is not less than the cylinder's height ({} mm)",
                                 response.curve.string(), 1e3 * curve.displacement.back(), 1e3 * response.height));
  ResponseFit fit;
  fit.force = fit_response(linear_force, curve.force, response.degree, response.curve.string() + ": force");
  if (!curve.radial.empty()) {
    if (response.poisson <= 0)
      throw InputError(fmt::format("{}: radial data need a Poisson's ratio above 0 in [response], found {}",
                                   response.curve.string(), response.poisson));
    fit.radial = fit_response(linear_radial, curve.radial, response.degree, response.curve.string() + ": radial");
  }
  return fit;
}

}  // namespace palpate
