#include "programs/fit/fit_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace palpate::fit {
namespace {

using Json = nlohmann::ordered_json;

// Of the indenter's radius: linear elasticity is off by 5 % in the force from 9 mm on, under a disc of 10 mm (docs/accuracy.md).
constexpr double kLinearDepth = 0.9;
// The same share of a ball's contact radius, which is about sqrt(R d): 0.9^2 of the ball's radius.
constexpr double kLinearDepthOfBall = 0.81;
// Of the organ's height under a plate: an incompressible neo-Hookean column of strain e is 1 + e times as stiff as a linear one.
constexpr double kLinearStrain = 0.05;
// With a term in depth^2: at twice that depth the curves of brain-cylinder give a modulus that is 8 % too small.
constexpr double kDeeperWithInitialSlope = 2;
constexpr double kRounding = 1e-9;       // of a depth whose unit was converted
constexpr double kFarPlace = 2;          // a place on its own gives so many times the modulus, or a part of it
constexpr double kOtherSupports = 0.02;  // relative: what is left of a modulus after another round is less than that
constexpr double kCoarseInterpolation = 0.05;  // relative, with a bundle left out

std::string file_name(const Measurements& data) {
  return data.file.filename().string();
}

// Of a region: Young's modulus as fitted.
Estimate young_of(const FitReport& report, std::size_t region) {
  if (report.family.parameter == Parameter::ratio && report.family.varied[region]) return report.fit.product;
  Estimate estimate = report.fit.young;
  const double factor = report.family.relative_young(region);
  estimate.value *= factor;
  if (estimate.interval) estimate.interval->low *= factor, estimate.interval->high *= factor;
  return estimate;
}

bool poisson_is_fitted(const FitReport& report, std::size_t region) {
  return report.family.parameter == Parameter::poisson && report.family.varied[region];
}

std::string number_text(const Estimate& estimate) {
  if (!estimate.interval) return fmt::format("{:.3g}, without an interval", estimate.value);
  return fmt::format("{:.3g}, 95 % interval {:.3g} to {:.3g}", estimate.value, estimate.interval->low,
                     estimate.interval->high);
}

std::string drawn(const FitReport& report) {
  return report.fit.over_places ? fmt::format("{} places", report.fit.places.size())
                                : fmt::format("{} rows", report.measurements.rows.size());
}

std::string bundles_text(const BundleFamily& family) {
  return fmt::format("{}", fmt::join(family.files, ", "));
}

Json json_of(const Estimate& estimate) {
  Json out = {{"value", estimate.value}, {"low", nullptr}, {"high", nullptr}};
  if (estimate.interval) out["low"] = estimate.interval->low, out["high"] = estimate.interval->high;
  return out;
}

double linear_share(const Spot& spot) {
  return spot.ball_depth > 0 ? kLinearDepthOfBall : kLinearDepth;
}

// The depth up to which a spot's force grows in proportion, m.
double linear_depth(const FitReport& report, int spot) {
  if (is_plate(report.press)) return kLinearStrain * report.family.plate_height;
  const Spot& pressed = report.measurements.spots[spot];
  return report.family.linear_limit > 0 ? report.family.linear_limit : linear_share(pressed) * pressed.radius;
}

std::string linear_depth_in_words(const FitReport& report) {
  if (is_plate(report.press)) return fmt::format("{:g} of the organ's height", kLinearStrain);
  if (report.family.linear_limit > 0)
    return fmt::format("the {:.3g} mm that the bundle states (accuracy_linear_limit_mm)",
                       1e3 * report.family.linear_limit);
  return fmt::format("{:g} of the indenter's radius", linear_share(report.measurements.spots.front()));
}

void warn_of_depth(const FitReport& report, std::vector<std::string>& warnings) {
  const double factor = report.options.initial_slope ? kDeeperWithInitialSlope : 1;
  double deepest = 0;
  int beyond = 0;
  for (const Row& row : report.measurements.rows) {
    deepest = std::max(deepest, row.depth);
    if (row.depth > factor * (1 + kRounding) * linear_depth(report, row.spot)) ++beyond;
  }
  if (beyond == 0) return;
  warnings.push_back(fmt::format(
      "{}: {} of {} rows are deeper than {}{} (the deepest: {:.3g} mm), beyond which linear elasticity is off by more "
      "than 5 %; leave "
      "them out with --most-depth MM{}",
      report.measurements.file.string(), beyond, report.measurements.rows.size(), factor > 1 ? "twice " : "",
      linear_depth_in_words(report), 1e3 * deepest, factor > 1 ? "" : ", or fit with --initial-slope"));
}

void warn_of_supports(const FitReport& report, std::vector<std::string>& warnings) {
  const double ratio = report.fit.young.value / report.family.regions[0].young;
  if (report.family.soft_supports && std::abs(ratio - 1) > kOtherSupports)
    warnings.push_back(
        fmt::format("{}: it has foundations or springs, and the fit takes them as {:.3g} times as stiff, as it takes "
                    "the tissue; compute the "
                    "bundle with the fitted modulus and fit again, until the modulus changes by less than {:g} %",
                    report.family.files[0], ratio, 100 * kOtherSupports));
}

void warn_of_parameter(const FitReport& report, std::vector<std::string>& warnings) {
  if (!report.fit.parameter) return;
  const Estimate& parameter = *report.fit.parameter;
  const std::string name = parameter_name(report.family);
  const auto& interval = parameter.interval;
  if (report.fit.at_edge)
    warnings.push_back(
        fmt::format("{}: the best value is that of the {} bundle, and may lie beyond; add a bundle there", name,
                    parameter.value == report.model.low() ? "first" : "last"));
  else if (interval && (interval->low <= report.model.low() || interval->high >= report.model.high()))
    warnings.push_back(fmt::format("{}: the interval ends where the bundles end; it may be wider", name));
  const double error = report.model.error_without_one();
  if (error > kCoarseInterpolation)
    warnings.push_back(
        fmt::format("{}: the bundles are far apart: without one of them the others miss its stiffness by up to "
                    "{:.0f} %; add bundles between them",
                    name, 100 * error));
}

void warn_of_interval(const FitReport& report, std::vector<std::string>& warnings) {
  const std::size_t fewest = report.fit.parameter ? kFewestUnitsWithParameter : kFewestUnits;
  if (!report.fit.young.interval)
    warnings.push_back(
        fmt::format("{}: no interval: expected {} places or rows or more whose forces differ from one another's, "
                    "found {}",
                    report.measurements.file.string(), fewest, drawn(report)));
  else if (!report.fit.over_places)
    warnings.push_back(
        fmt::format("{}: the interval holds the scatter of the rows about the fit alone, since {} {} too few to show "
                    "how places differ; expected "
                    "{} or more",
                    report.measurements.file.string(), report.fit.places.size(),
                    report.fit.places.size() == 1 ? "place is" : "places are", fewest));
}

void warn_of_places(const FitReport& report, std::vector<std::string>& warnings) {
  for (const PlaceFit& place : report.fit.places) {
    const double ratio = place.young / report.fit.young.value;
    if (ratio > kFarPlace || ratio < 1 / kFarPlace)
      warnings.push_back(
          fmt::format("place {}: on its own it gives {:.2g} times the fitted modulus; check its position, its zero of "
                      "depth and its units",
                      place.name, ratio));
  }
}

}  // namespace

// A basic string of TOML.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      out += '\\', out += c;
    else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      out += ' ';
    else
      out += c;
  }
  return out + '"';
}

Unit unit_of(double pascals) {
  return pascals < 1e3   ? Unit{1, "Pa"}
         : pascals < 1e6 ? Unit{1e3, "kPa"}
         : pascals < 1e9 ? Unit{1e6, "MPa"}
                         : Unit{1e9, "GPa"};
}

std::string modulus_text(double pascals) {
  const Unit unit = unit_of(pascals);
  return fmt::format("{:.4g} {}", pascals / unit.pascals, unit.name);
}

std::string modulus_text(const Estimate& estimate) {
  if (!estimate.interval) return modulus_text(estimate.value) + ", without an interval";
  const Unit unit = unit_of(estimate.value);
  return fmt::format("{}, 95 % interval {:.4g} to {:.4g} {}", modulus_text(estimate.value),
                     estimate.interval->low / unit.pascals, estimate.interval->high / unit.pascals, unit.name);
}

std::string parameter_name(const BundleFamily& family) {
  if (family.parameter != Parameter::ratio) return "Poisson's ratio";
  std::string varied;
  for (std::size_t r = 0; r < family.regions.size(); ++r)
    if (family.varied[r]) varied += (varied.empty() ? "" : ", ") + family.regions[r].name;
  return fmt::format("modulus of {} over that of {}", varied, family.regions[0].name);
}

Estimate parameter_estimate(const FitReport& report) {
  Estimate estimate = *report.fit.parameter;
  if (report.family.parameter != Parameter::ratio) return estimate;
  estimate.value = std::exp(estimate.value);
  if (estimate.interval)
    estimate.interval = Interval{std::exp(estimate.interval->low), std::exp(estimate.interval->high)};
  return estimate;
}

std::string summary_text(const FitReport& report) {
  const Measurements& data = report.measurements;
  std::string text;
  const auto line = [&](const std::string& name, const std::string& value) {
    text += fmt::format("{:<18}{}\n", name, value);
  };
  line("measurements", fmt::format("{}, {} rows at {} {}", data.file.string(), data.rows.size(), data.places.size(),
                                   data.places.size() == 1 ? "place" : "places"));
  if (data.left_out > 0)
    line("left out", fmt::format("{} rows deeper than --most-depth or shallower than --least-depth", data.left_out));
  line("bundles", bundles_text(report.family));
  for (std::size_t r = 0; r < report.family.regions.size(); ++r)
    line("Young's modulus", fmt::format("{}: {}", report.family.regions[r].name, modulus_text(young_of(report, r))));
  if (report.fit.parameter) {
    line("parameter", fmt::format("{}: {}", parameter_name(report.family), number_text(parameter_estimate(report))));
    std::string values;
    for (const double value : report.family.values)
      values += fmt::format("{}{:.4g}", values.empty() ? "" : ", ",
                            report.family.parameter == Parameter::ratio ? std::exp(value) : value);
    const std::size_t count = report.family.values.size();
    line("interpolation",
         fmt::format("compliance between {}: {}{}", values, count == 2 ? "a straight line" : "parabolas",
                     count > 2 ? fmt::format("; without one, the others miss it by up to {:.2g} %",
                                             100 * report.model.error_without_one())
                               : ""));
  }
  if (report.fit.young.interval)
    line("interval", fmt::format("bootstrap over {}, {} draws", drawn(report), report.options.repetitions));
  line("residual", fmt::format("{:.3g} N root mean square, {:.2g} % of the largest force", report.fit.residual,
                               100 * report.fit.residual / report.fit.largest_force));
  for (const PlaceFit& place : report.fit.places)
    line("place", fmt::format("{}: {} rows, on its own {}", place.name, place.rows, modulus_text(place.young)));
  return text;
}

std::vector<std::string> warnings_of(const FitReport& report) {
  std::vector<std::string> warnings = report.family.warnings;
  warn_of_depth(report, warnings);
  warn_of_supports(report, warnings);
  warn_of_parameter(report, warnings);
  warn_of_interval(report, warnings);
  warn_of_places(report, warnings);
  return warnings;
}

std::string json_text(const FitReport& report) {
  const Measurements& data = report.measurements;
  Json out = {{"program_version", PALPATE_VERSION},
              {"measurements", data.file.string()},
              {"measurements_sha256", data.sha256},
              {"source", report.source},
              {"bundles", report.family.files},
              {"press", report.press == Press::plate            ? "plate"
                        : report.press == Press::sticking_plate ? "sticking plate"
                        : report.press == Press::sliding        ? "sliding"
                                                                : "sticking"},
              {"initial_slope", report.options.initial_slope},
              {"rows", data.rows.size()},
              {"rows_left_out", data.left_out},
              {"level", 0.95},
              {"drawn", report.fit.over_places ? "places" : "rows"},
              {"draws", report.options.repetitions},
              {"seed", report.options.seed}};
  out["regions"] = Json::array();
  for (std::size_t r = 0; r < report.family.regions.size(); ++r)
    out["regions"].push_back({{"name", report.family.regions[r].name}, {"young_Pa", json_of(young_of(report, r))}});
  if (report.fit.parameter) {
    const auto shown = [&](double value) {
      return report.family.parameter == Parameter::ratio ? std::exp(value) : value;
    };
    out["parameter"] = {{"name", report.family.parameter == Parameter::poisson ? "poisson" : "ratio"},
                        {"meaning", parameter_name(report.family)},
                        {"fitted", json_of(parameter_estimate(report))},
                        {"at_edge", report.fit.at_edge},
                        {"interpolation_error", report.model.error_without_one()},
                        {"of_bundles", Json::array()},
                        {"profile", Json::array()}};
    for (const double value : report.family.values) out["parameter"]["of_bundles"].push_back(shown(value));
    for (std::size_t i = 0; i < report.fit.profile_parameter.size(); ++i)
      out["parameter"]["profile"].push_back(
          {{"value", shown(report.fit.profile_parameter[i])}, {"residual_N", report.fit.profile_residual[i]}});
  }
  out["residual_N"] = report.fit.residual;
  out["largest_force_N"] = report.fit.largest_force;
  out["places"] = Json::array();
  for (const PlaceFit& place : report.fit.places)
    out["places"].push_back({{"name", place.name}, {"rows", place.rows}, {"young_Pa", place.young}});
  out["forces"] = Json::array();
  for (std::size_t r = 0; r < data.rows.size(); ++r)
    out["forces"].push_back({{"place", data.spots[data.rows[r].spot].place},
                             {"depth_m", data.rows[r].depth},
                             {"measured_N", data.rows[r].force},
                             {"fitted_N", report.fit.fitted_force[r]}});
  out["warnings"] = warnings_of(report);
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string organ_lines(const FitReport& report) {
  const Measurements& data = report.measurements;
  const std::string from = fmt::format("palpate-fit of {} (sha256 {})", file_name(data), data.sha256);
  const std::string said = report.source.empty() ? "" : "; " + report.source;
  std::string text = fmt::format("# palpate-fit {}: {} rows at {} {} of {}, sha256 {},\n# on {}.\n", PALPATE_VERSION,
                                 data.rows.size(), data.places.size(), data.places.size() == 1 ? "place" : "places",
                                 file_name(data), data.sha256, bundles_text(report.family));
  for (std::size_t r = 0; r < report.family.regions.size(); ++r) {
    const Estimate young = young_of(report, r);
    const Unit unit = unit_of(young.value);
    text += fmt::format("\n[[region]]\nname = {}\n", quoted(report.family.regions[r].name));
    text += fmt::format("# Young's modulus {}{}\n", modulus_text(young),
                        young.interval ? fmt::format(" (bootstrap over {})", drawn(report)) : "");
    text += fmt::format("young = {{ value = {:.4g}, unit = \"{}\", source = {} }}\n", young.value / unit.pascals,
                        unit.name, quoted(fmt::format("{}, {}{}", from, modulus_text(young), said)));
    if (poisson_is_fitted(report, r))
      text += fmt::format("poisson = {{ value = {:.4g}, source = {} }}\n", report.fit.parameter->value,
                          quoted(fmt::format("{}, {}{}", from, number_text(*report.fit.parameter), said)));
    else
      text += fmt::format("poisson = {{ value = {:.10g}, source = {} }}\n", report.family.regions[r].poisson,
                          quoted(fmt::format("that of {}, on which young was fitted", bundles_text(report.family))));
  }
  return text;
}

}  // namespace palpate::fit
