#include "programs/fit/large_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/errors.h"

namespace palpate::fit {
namespace {

constexpr double kFloor =
    0.05;  // as in curve_fit.cpp: rows with less than this share of their curve's largest force do not count here

double median_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 ? values[half] : (values[half - 1] + values[half]) / 2;
}

HeldOut errors_of(const std::string& name, const Measurements& data, const std::vector<int>& rows,
                  const std::vector<double>& predicted, double shear) {
  HeldOut result;
  result.name = name;
  double largest = 0, squares = 0, logarithms = 0;
  for (const int r : rows) largest = std::max(largest, data.rows[r].force);
  std::vector<double> sizes;
  for (const int r : rows) {
    if (data.rows[r].force < kFloor * largest) continue;
    const double error = predicted[r] / data.rows[r].force - 1;
    sizes.push_back(std::abs(error)), squares += error * error, logarithms += std::log1p(error);
    if (std::abs(error) >= std::abs(result.worst)) result.worst = error, result.worst_depth = data.rows[r].depth;
  }
  result.rows = static_cast<int>(sizes.size());
  result.median = median_of(sizes), result.residual = std::sqrt(squares / result.rows);
  result.own_shear = shear * std::exp(-logarithms / result.rows);
  return result;
}

std::vector<bool> held_names(const std::vector<std::string>& names, const std::vector<std::string>& held,
                             const Measurements& data, bool specimens) {
  std::vector<bool> result(names.size());
  for (const std::string& name : held) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end())
      throw InputError(fmt::format("{}: --holdout: expected a {} ({}), found {}", data.file.string(),
                                   specimens ? "specimen" : "place", fmt::join(names, ", "), name));
    result[static_cast<std::size_t>(found - names.begin())] = true;
  }
  if (std::find(result.begin(), result.end(), false) == result.end())
    throw InputError(fmt::format("{}: --holdout: expected a {} or more that are left to fit, found none",
                                 data.file.string(), specimens ? "specimen" : "place"));
  return result;
}

}  // namespace

LargeFit fit_large(PressedBundle& bundle, const Measurements& measurements, Press press, const LawFamily& family,
                   const LargeOptions& options) {
  LargeFit result;
  result.regions = bundle.regions(), result.soft_supports = !bundle.soft_supports().empty();
  result.of_specimens = !measurements.specimens.empty();
  const auto& names = result.of_specimens ? measurements.specimens : measurements.places;
  const std::vector<bool> held = held_names(names, options.holdout, measurements, result.of_specimens);
  const auto unit_of = [&](const Row& row) {
    return static_cast<std::size_t>(result.of_specimens ? row.specimen : measurements.spots[row.spot].place);
  };
  std::vector<int> place_of_unit(names.size());
  int last = 0;
  for (const bool of_held : {false, true})
    for (std::size_t n = 0; n < names.size(); ++n)
      if (held[n] == of_held) place_of_unit[n] = last++;

  const LargePress of_all(bundle, measurements, press);
  CurveData data;
  const std::size_t rows = measurements.rows.size();
  std::vector<double> strain(rows);
  std::vector<int> curve(rows);
  for (std::size_t c = 0; c < of_all.curves().size(); ++c)
    for (const int r : of_all.curves()[c].rows)
      strain[r] = measurements.rows[r].depth / of_all.curves()[c].scale, curve[r] = static_cast<int>(c);
  std::vector<Eigen::Index> fitted;
  for (std::size_t n = 0; n < names.size(); ++n)
    if (!held[n]) result.units.push_back(names[n]), result.unit_rows.push_back(0);
  data.units = static_cast<int>(result.units.size());
  for (std::size_t r = 0; r < rows; ++r) {
    const std::size_t unit = unit_of(measurements.rows[r]);
    result.unit_of_row.push_back(place_of_unit[unit]), result.fitted.push_back(!held[unit]);
    if (held[unit]) continue;
    fitted.push_back(static_cast<Eigen::Index>(r));
    ++result.unit_rows[static_cast<std::size_t>(place_of_unit[unit])];
    data.force.push_back(measurements.rows[r].force), data.strain.push_back(strain[r]);
    // A curve of one specimen at one place.
    data.curve.push_back(curve[r] * static_cast<int>(names.size()) + static_cast<int>(unit));
    data.unit.push_back(place_of_unit[unit]);
    result.deepest = std::max(result.deepest, strain[r]);
  }
  const ForceModel model = [&](const std::vector<LawForm>& forms) {
    std::vector<Eigen::VectorXd> forces = of_all.forces(forms);
    for (Eigen::VectorXd& force : forces)
      if (force.size() > 0) force = Eigen::VectorXd(force(fitted));
    return forces;
  };
  result.curve = fit_curves(data, family, model, options.curves, measurements.file.string());
  const Eigen::VectorXd all = result.curve.shear.value * of_all.forces({result.curve.form}).front();
  result.force.assign(all.begin(), all.end());
  result.fewest_touched = of_all.fewest_touched();
  std::vector<int> all_held;
  for (std::size_t n = 0; n < names.size(); ++n) {
    if (!held[n]) continue;
    std::vector<int> own;
    for (std::size_t r = 0; r < rows; ++r)
      if (unit_of(measurements.rows[r]) == n) own.push_back(static_cast<int>(r));
    if (own.empty()) continue;
    result.held_out.push_back(errors_of(names[n], measurements, own, result.force, result.curve.shear.value));
    all_held.insert(all_held.end(), own.begin(), own.end());
  }
  if (!all_held.empty())
    result.held_out_in_all = errors_of("all", measurements, all_held, result.force, result.curve.shear.value);
  return result;
}

}  // namespace palpate::fit
