#include "programs/fit/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "formats/errors.h"
#include "programs/fit/draw.h"

namespace palpate::fit {
namespace {

constexpr double kLeastSpread =
    1e-4;                  // f32 bundles and the interpolation agree to 1e-6; forces are measured to 1e-3 at best
constexpr int kGrid = 24;  // places of the first look for the best parameter, in the bundles' range
constexpr double kShareOfRange = 1e-9;  // to which the parameter is found
constexpr int kProfile = 60;

// Sums over the rows of one spot; what the depth^2 term takes up is taken out of d and F.
struct Sums {
  double dd = 0, df = 0;
  double cubic = 0, force_quadratic = 0;  // coefficients of depth^2 in d and in F
};

// log E, the parameter, and log E + parameter, each with its standard error.
constexpr int kQuantities = 3;
struct Point {
  std::array<double, kQuantities> value{}, error{};
};

class Fitter {
 public:
  Fitter(const Measurements& measurements, const StiffnessModel& model, bool initial_slope)
      : data_(measurements), model_(model), initial_slope_(initial_slope) {}

  int parameter_count() const { return model_.has_parameter() ? 2 : 1; }

  // unit: of each row, whose errors may be alike; weight: how often each unit counts. None: the rows do not push.
  std::optional<Point> estimate(const std::vector<int>& unit, const std::vector<int>& weight) const {
    const std::vector<Sums> sums = sums_of([&](std::size_t r) { return weight[unit[r]]; });
    const double parameter = best_parameter(sums);
    const double young = young_at(sums, parameter);
    if (!(young > 0)) return std::nullopt;
    Point point;
    point.value = {std::log(young), parameter, std::log(young) + parameter};
    point.error = standard_errors(sums, young, parameter, unit, weight);
    return point;
  }

  std::vector<Sums> sums_of(const std::function<int(std::size_t)>& weight) const {
    struct Powers {
      double d2 = 0, d3 = 0, d4 = 0, fd = 0, fd2 = 0;
    };
    std::vector<Powers> powers(model_.spot_count());
    for (std::size_t r = 0; r < data_.rows.size(); ++r) {
      const Row& row = data_.rows[r];
      Powers& p = powers[row.spot];
      const double w = weight(r), d = row.depth, d2 = w * d * d;
      p.d2 += d2, p.d3 += d2 * d, p.d4 += d2 * d * d, p.fd += w * row.force * d, p.fd2 += row.force * d2;
    }
    std::vector<Sums> sums(powers.size());
    for (std::size_t s = 0; s < sums.size(); ++s) {
      const Powers& p = powers[s];
      Sums& sum = sums[s];
      if (initial_slope_ && p.d4 > 0) sum.cubic = p.d3 / p.d4, sum.force_quadratic = p.fd2 / p.d4;
      sum.dd = p.d2 - sum.cubic * p.d3, sum.df = p.fd - sum.cubic * p.fd2;
      if (sum.dd < 1e-9 * p.d2) sum.dd = sum.df = 0;  // one depth: the depth^2 term takes up everything
    }
    return sums;
  }

  double young_at(const std::vector<Sums>& sums, double parameter) const {
    const auto [kf, kk] = normal_sums(sums, parameter);
    return kk > 0 ? kf / kk : 0;
  }

  // What the fit takes off the sum of squares of the forces: the larger, the better.
  double gain(const std::vector<Sums>& sums, double parameter) const {
    const auto [kf, kk] = normal_sums(sums, parameter);
    return kk > 0 && kf > 0 ? kf * kf / kk : 0;
  }

  // The best of a grid, then golden sections between its neighbours.
  double best_parameter(const std::vector<Sums>& sums) const {
    if (!model_.has_parameter()) return model_.low();
    const double range = model_.high() - model_.low();
    const auto at = [&](int i) { return model_.low() + range * i / kGrid; };
    int best = 0;
    double most = -1;
    for (int i = 0; i <= kGrid; ++i)
      if (const double g = gain(sums, at(i)); g > most) most = g, best = i;
    double a = at(std::max(best - 1, 0)), b = at(std::min(best + 1, kGrid));
    const double golden = (std::sqrt(5.0) - 1) / 2;
    double x = b - golden * (b - a), y = a + golden * (b - a), gx = gain(sums, x), gy = gain(sums, y);
    while (b - a > kShareOfRange * range) {
      if (gx >= gy)
        b = y, y = x, gy = gx, x = b - golden * (b - a), gx = gain(sums, x);
      else
        a = x, x = y, gx = gy, y = a + golden * (b - a), gy = gain(sums, y);
    }
    const double inner = (a + b) / 2, edge = best == 0 ? model_.low() : best == kGrid ? model_.high() : inner;
    return gain(sums, edge) >= gain(sums, inner) ? edge : inner;
  }

  // Depth and force of a row without what the depth^2 term of its spot takes up.
  std::pair<double, double> cleared(const Row& row, const Sums& sum) const {
    const double d2 = row.depth * row.depth;
    return {row.depth - sum.cubic * d2, row.force - sum.force_quadratic * d2};
  }

 private:
  std::pair<double, double> normal_sums(const std::vector<Sums>& sums, double parameter) const {
    double kf = 0, kk = 0;
    for (std::size_t s = 0; s < sums.size(); ++s) {
      const double k = model_.stiffness(s, parameter);
      kf += k * sums[s].df, kk += k * k * sums[s].dd;
    }
    return {kf, kk};
  }

  // Of Gauss-Newton's normal equations in (log E, parameter): H^-1 (sum over units of g g^T) H^-1.
  std::array<double, kQuantities> standard_errors(const std::vector<Sums>& sums, double young, double parameter,
                                                  const std::vector<int>& unit, const std::vector<int>& weight) const {
    std::vector<std::array<double, 2>> j(sums.size());
    double h00 = 0, h01 = 0, h11 = 0;
    for (std::size_t s = 0; s < sums.size(); ++s) {
      j[s] = {young * model_.stiffness(s, parameter), young * model_.slope(s, parameter)};
      h00 += j[s][0] * j[s][0] * sums[s].dd, h01 += j[s][0] * j[s][1] * sums[s].dd,
          h11 += j[s][1] * j[s][1] * sums[s].dd;
    }
    std::vector<std::array<double, 2>> score(weight.size());
    for (std::size_t r = 0; r < data_.rows.size(); ++r) {
      const Row& row = data_.rows[r];
      const auto [d, f] = cleared(row, sums[row.spot]);
      const double error = d * (f - j[row.spot][0] * d);
      for (int p = 0; p < 2; ++p) score[unit[r]][p] += j[row.spot][p] * error;
    }
    // The columns of H^-1 for the three quantities.
    const double determinant = h00 * h11 - h01 * h01;
    std::array<std::array<double, 2>, kQuantities> columns{};
    if (!model_.has_parameter())
      columns[0] = columns[2] = {1 / h00, 0};
    else if (determinant > 1e-14 * h00 * h11)
      columns[0] = {h11 / determinant, -h01 / determinant}, columns[1] = {-h01 / determinant, h00 / determinant},
      columns[2] = {columns[0][0] + columns[1][0], columns[0][1] + columns[1][1]};
    std::array<double, kQuantities> result{};
    double units = 0;
    for (std::size_t u = 0; u < weight.size(); ++u) {
      units += weight[u];
      for (int q = 0; q < kQuantities; ++q) {
        const double part = columns[q][0] * score[u][0] + columns[q][1] * score[u][1];
        result[q] += weight[u] * part * part;
      }
    }
    const double spent = parameter_count();
    for (double& value : result) value = std::sqrt(value * units / std::max(units - spent, 1.0));
    return result;
  }

  const Measurements& data_;
  const StiffnessModel& model_;
  bool initial_slope_;
};

// The 95 % quantile of |value* - value| / error* over draws of units with replacement. A draw without a spread counts as infinite.
std::array<double, kQuantities> studentised_quantiles(const Fitter& fitter, const Point& fitted,
                                                      const std::vector<int>& unit, std::size_t units,
                                                      const FitOptions& options) {
  std::mt19937_64 generator(options.seed);
  std::array<std::vector<double>, kQuantities> distances;
  std::vector<int> weight(units);
  for (int b = 0; b < options.repetitions; ++b) {
    std::fill(weight.begin(), weight.end(), 0);
    for (std::size_t u = 0; u < units; ++u) ++weight[draw(generator, units)];
    const std::optional<Point> drawn = fitter.estimate(unit, weight);
    for (int q = 0; q < kQuantities; ++q) {
      const double distance = drawn ? std::abs(drawn->value[q] - fitted.value[q]) : 1;
      const double error = drawn ? drawn->error[q] : 0;
      distances[q].push_back(error > 0 ? distance / error : distance > 0 ? INFINITY : 0);
    }
  }
  std::array<double, kQuantities> result{};
  for (int q = 0; q < kQuantities; ++q) {
    const auto rank =
        distances[q].begin() + static_cast<std::ptrdiff_t>(0.95 * (static_cast<double>(options.repetitions) - 1));
    std::nth_element(distances[q].begin(), rank, distances[q].end());
    result[q] = *rank;
  }
  return result;
}

void check_can_tell(const Measurements& data, const StiffnessModel& model) {
  if (model.has_parameter() && model.spread_between_spots() < kLeastSpread)
    throw InputError(
        fmt::format("{}: expected places whose stiffness the bundles change by different factors, found {} that all "
                    "change by the same "
                    "factor (to {:.1g}): forces there cannot tell the bundles apart from another Young's modulus; "
                    "measure at places of "
                    "other thickness or support or with another radius, or give one bundle",
                    data.file.string(), data.spots.size(), kLeastSpread));
}

void add_intervals(const Fitter& fitter, const Point& fitted, const std::vector<int>& unit, std::size_t units,
                   const StiffnessModel& model, const FitOptions& options, Fit& fit) {
  const auto quantile = studentised_quantiles(fitter, fitted, unit, units, options);
  const auto interval = [&](int q) -> std::optional<Interval> {
    const double half = quantile[q] * fitted.error[q];
    if (!std::isfinite(half)) return std::nullopt;
    return Interval{fitted.value[q] - half, fitted.value[q] + half};
  };
  const auto modulus = [&](int q) -> std::optional<Interval> {
    const auto logarithm = interval(q);
    if (!logarithm) return std::nullopt;
    return Interval{std::exp(logarithm->low), std::exp(logarithm->high)};
  };
  fit.young.interval = modulus(0), fit.product.interval = modulus(2);
  if (!fit.parameter) return;
  fit.parameter->interval = interval(1);
  if (auto& i = fit.parameter->interval)
    i->low = std::max(i->low, model.low()), i->high = std::min(i->high, model.high());
}

void add_places(const Measurements& data, const StiffnessModel& model, const std::vector<Sums>& sums, double parameter,
                Fit& fit) {
  std::vector<double> kf(data.places.size()), kk(data.places.size());
  for (std::size_t s = 0; s < sums.size(); ++s) {
    const double k = model.stiffness(s, parameter);
    kf[data.spots[s].place] += k * sums[s].df, kk[data.spots[s].place] += k * k * sums[s].dd;
  }
  for (std::size_t p = 0; p < data.places.size(); ++p)
    fit.places.push_back({data.places[p], 0, kk[p] > 0 ? kf[p] / kk[p] : 0});
  for (const Row& row : data.rows) ++fit.places[data.spots[row.spot].place].rows;
}

void add_residuals(const Fitter& fitter, const Measurements& data, const StiffnessModel& model,
                   const std::vector<Sums>& sums, double parameter, Fit& fit) {
  double squares = 0;
  for (const Row& row : data.rows) {
    const auto [d, f] = fitter.cleared(row, sums[row.spot]);
    const double error = f - fit.young.value * model.stiffness(row.spot, parameter) * d;
    squares += error * error;
    fit.fitted_force.push_back(row.force - error);
    fit.largest_force = std::max(fit.largest_force, std::abs(row.force));
  }
  const double count = static_cast<double>(data.rows.size());
  fit.residual = std::sqrt(squares / count);
  for (int i = 0; model.has_parameter() && i <= kProfile; ++i) {
    const double at = model.low() + (model.high() - model.low()) * i / kProfile;
    const double there = squares + fitter.gain(sums, parameter) - fitter.gain(sums, at);
    fit.profile_parameter.push_back(at), fit.profile_residual.push_back(std::sqrt(std::max(there, 0.0) / count));
  }
}

}  // namespace

Fit fit_forces(const Measurements& data, const StiffnessModel& model, const FitOptions& options) {
  check_can_tell(data, model);
  const Fitter fitter(data, model, options.initial_slope);
  const std::size_t fewest = model.has_parameter() ? kFewestUnitsWithParameter : kFewestUnits;
  Fit fit;
  fit.over_places = data.places.size() >= fewest;
  std::vector<int> unit(data.rows.size());
  for (std::size_t r = 0; r < unit.size(); ++r)
    unit[r] = fit.over_places ? data.spots[data.rows[r].spot].place : static_cast<int>(r);
  const std::size_t units = fit.over_places ? data.places.size() : data.rows.size();
  const std::optional<Point> fitted = fitter.estimate(unit, std::vector<int>(units, 1));
  if (!fitted)
    throw InputError(fmt::format(
        "{}: expected forces that grow with the depth, found a Young's modulus that is not above 0{}; a push counts as "
        "a "
        "positive force",
        data.file.string(), options.initial_slope ? " (--initial-slope needs two depths or more at a place)" : ""));

  const double parameter = fitted->value[1];
  fit.young.value = std::exp(fitted->value[0]), fit.product.value = std::exp(fitted->value[2]);
  if (model.has_parameter()) {
    fit.parameter = Estimate{parameter, {}};
    fit.at_edge = parameter == model.low() || parameter == model.high();
  }
  if (units >= fewest) add_intervals(fitter, *fitted, unit, units, model, options, fit);
  const std::vector<Sums> sums = fitter.sums_of([](std::size_t) { return 1; });
  add_places(data, model, sums, parameter, fit);
  add_residuals(fitter, data, model, sums, parameter, fit);
  return fit;
}

}  // namespace palpate::fit
