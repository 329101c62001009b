#include "programs/fit/large_report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "programs/fit/fit_report.h"

namespace palpate::fit {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kFarUnit = 2;  // a unit on its own gives so many times the modulus, or a part of it
constexpr double kOtherSupports = 0.02;
constexpr int kFewestTouched = 28;  // nodes under a ball, where kBallError leaves 10 %
constexpr double kBallError =
    0.53;  // a ball's force is too small by this over the root of the number of its nodes (tests: PressedBall)

const char* unit_word(const LargeReport& report, std::size_t count) {
  if (report.fit.of_specimens) return count == 1 ? "specimen" : "specimens";
  return count == 1 ? "place" : "places";
}

Estimate young_of(const LargeReport& report, std::size_t region) {
  const Region &first = report.fit.regions[0], &own = report.fit.regions[region];
  Estimate result = report.fit.curve.shear;
  const double factor = 2 * (1 + first.poisson) * own.young / first.young;
  result.value *= factor;
  if (result.interval) result.interval->low *= factor, result.interval->high *= factor;
  return result;
}

std::string number_text(const Estimate& estimate) {
  if (!estimate.interval) return fmt::format("{:.4g}, without an interval", estimate.value);
  return fmt::format("{:.4g}, 95 % interval {:.4g} to {:.4g}", estimate.value, estimate.interval->low,
                     estimate.interval->high);
}

std::string percent(double share) {
  return fmt::format("{:.2g} %", 100 * share);
}

std::string press_in_words(Press press) {
  return press == Press::plate            ? "a plate that slides"
         : press == Press::sticking_plate ? "a plate that sticks"
         : press == Press::sliding        ? "an indenter that slides"
                                          : "an indenter that sticks";
}

std::string depth_in_words(const LargeReport& report) {
  return fmt::format("to {:.3g} {}", (is_plate(report.press) ? 100 : 1) * report.fit.deepest,
                     is_plate(report.press) ? "% of the height" : "times the indenter's radius");
}

std::string interval_in_words(const LargeReport& report) {
  const CurveFit& curve = report.fit.curve;
  const std::size_t units = report.fit.units.size();
  const std::string drawn =
      curve.unit_part == UnitPart::bootstrap ? fmt::format("bootstrap over {} {}, {} draws", units,
                                                           unit_word(report, units), report.options.curves.repetitions)
      : curve.unit_part == UnitPart::jackknife
          ? fmt::format("Student's t over {} {}, each left out once", units, unit_word(report, units))
          : fmt::format("residuals of one {} that are correlated along the curve", unit_word(report, 1));
  if (curve.unit_part == UnitPart::none) return drawn;
  return fmt::format("{}; and the law's own error, whose residual is {} of the force", drawn, percent(curve.law_error));
}

std::string pair_text(const LargeReport& report, const Untold::Fitted& fitted) {
  const Region& first = report.fit.regions[0];
  std::string text = "E " + modulus_text(2 * (1 + first.poisson) * fitted.shear);
  for (std::size_t k = 0; k < report.fit.curve.constants.size(); ++k) {
    const double value = fitted.constants[static_cast<Eigen::Index>(k)];
    const bool of_shear = report.fit.curve.constants[k].pascals.has_value();
    text += fmt::format(", {} {}", report.fit.curve.constants[k].name,
                        of_shear ? modulus_text(value * fitted.shear) : fmt::format("{:.3g}", value));
  }
  return fmt::format("{}: residual {}", text, percent(fitted.residual));
}

void warn_of_untold(const LargeReport& report, std::vector<std::string>& warnings) {
  for (const Untold& untold : report.fit.curve.untold) {
    const std::string what = untold.range      ? fmt::format("in which range {} lies", untold.constant)
                             : untold.together ? fmt::format("{} from the other constants", untold.constant)
                                               : untold.constant;
    const char* advice = untold.range      ? "measure other ways to press too"
                         : untold.together ? "measure shallower rows and other ways to press too"
                                           : "press deeper";
    warnings.push_back(fmt::format(
        "{}: these curves cannot tell {}: ({}) and ({}) fit nearly alike; {}, or hold it with --hold {}=VALUE",
        report.measurements.file.string(), what, pair_text(report, untold.low), pair_text(report, untold.high), advice,
        untold.constant));
  }
}

Json json_of(const Estimate& estimate) {
  Json out = {{"value", estimate.value}, {"low", nullptr}, {"high", nullptr}};
  if (estimate.interval) out["low"] = estimate.interval->low, out["high"] = estimate.interval->high;
  return out;
}

Json json_of(const HeldOut& held) {
  return {{"name", held.name},         {"rows", held.rows},   {"median", held.median},
          {"residual", held.residual}, {"worst", held.worst}, {"worst_depth_m", held.worst_depth}};
}

// The fitted value of a constant, or the one that is held.
double value_of(const LargeReport& report, const std::string& name) {
  for (const FittedConstant& constant : report.fit.curve.constants)
    if (constant.name == name) return constant.estimate.value;
  return report.family.held().at(name);
}

std::string law_line(const LargeReport& report, double young, double poisson, const std::string& source) {
  const double shear = young / (2 * (1 + poisson));
  switch (report.family.law()) {
    case FittedLaw::neo_hookean:
      return "";
    case FittedLaw::stiffening:
      if (!(value_of(report, "b") > 0)) return "# stiffening: 0, the neo-Hookean law\n";
      return fmt::format("stiffening = {{ value = {:.4g}, source = {} }}\n", value_of(report, "b"), source);
    case FittedLaw::yeoh:
      return fmt::format("yeoh = {{ c2 = {:.6g}, c3 = {:.6g}, unit = \"Pa\", source = {} }}\n",
                         shear * value_of(report, "c2"), shear * value_of(report, "c3"), source);
    case FittedLaw::ogden:
      break;
  }
  const double share = value_of(report, "share");
  return fmt::format(
      "ogden = {{ exponent = {:.4g}, {}source = {} }}\n", value_of(report, "exponent"),
      share > 0 ? fmt::format("share = {:.4g}, second_exponent = {:.4g}, ", share, value_of(report, "second_exponent"))
                : "",
      source);
}

std::string held_line(const HeldOut& held) {
  return fmt::format("{}: {} rows, force off by {} (median), {} (root mean square), at most {:+.2g} % (at {:.3g} mm)",
                     held.name, held.rows, percent(held.median), percent(held.residual), 100 * held.worst,
                     1e3 * held.worst_depth);
}

}  // namespace

std::string summary_text(const LargeReport& report) {
  const Measurements& data = report.measurements;
  const LargeFit& fit = report.fit;
  std::string text;
  const auto line = [&](const std::string& name, const std::string& value) {
    text += fmt::format("{:<18}{}\n", name, value);
  };
  line("measurements",
       fmt::format("{}, {} rows of {} {}", data.file.string(), data.rows.size(), fit.units.size() + fit.held_out.size(),
                   unit_word(report, fit.units.size() + fit.held_out.size())));
  if (data.left_out > 0)
    line("left out", fmt::format("{} rows deeper than --most-depth or shallower than --least-depth", data.left_out));
  if (data.without_push > 0) line("left out", fmt::format("{} rows whose force is not above 0", data.without_push));
  line("bundle", report.bundle);
  line("law", fmt::format("{}, under large strain; {}, {}", report.family.name(), press_in_words(report.press),
                          depth_in_words(report)));
  for (std::size_t r = 0; r < fit.regions.size(); ++r)
    line("Young's modulus", fmt::format("{}: {}", fit.regions[r].name, modulus_text(young_of(report, r))));
  for (const FittedConstant& constant : fit.curve.constants)
    line("constant", constant.pascals ? fmt::format("{}: {}", constant.name, modulus_text(*constant.pascals))
                                      : fmt::format("{}: {}", constant.name, number_text(constant.estimate)));
  for (const auto& [name, value] : report.family.held())
    if (value != 0 && !(name == "second_exponent" && value_of(report, "share") == 0))
      line("held", fmt::format("{}: {:g}", name, value));
  line("interval", interval_in_words(report));
  line("residual", fmt::format("{} of the force, root mean square", percent(fit.curve.residual)));
  for (std::size_t u = 0; u < fit.units.size(); ++u)
    line(unit_word(report, 1),
         fmt::format("{}: {} rows, residual {}, on its own {}", fit.units[u], fit.unit_rows[u],
                     percent(fit.curve.unit_residual[u]),
                     modulus_text(fit.curve.unit_shear[u] / fit.curve.shear.value * young_of(report, 0).value)));
  for (const HeldOut& held : fit.held_out) line("predicted", held_line(held));
  if (fit.held_out.size() > 1) line("predicted", held_line(fit.held_out_in_all));
  return text;
}

std::vector<std::string> warnings_of(const LargeReport& report) {
  std::vector<std::string> warnings;
  const LargeFit& fit = report.fit;
  const std::string file = report.measurements.file.string();
  warn_of_untold(report, warnings);
  for (const FittedConstant& constant : fit.curve.constants)
    if (constant.at_limit)
      warnings.push_back(fmt::format("{}: {} is where the law {} ends, and the curves ask for more; try another law",
                                     file, constant.name, report.family.name()));
  if (!fit.curve.shear.interval)
    warnings.push_back(fmt::format("{}: no interval: without one of the {} the others do not determine all constants",
                                   file, unit_word(report, 2)));
  else if (fit.curve.unit_part == UnitPart::none)
    warnings.push_back(
        fmt::format("{}: the interval is that of one {}; expected two or more, at best six, to show how {} "
                    "differ",
                    file, unit_word(report, 1), unit_word(report, 2)));
  if (fit.fewest_touched > 0 && fit.fewest_touched < kFewestTouched)
    warnings.push_back(
        fmt::format("{}: the ball touches {} nodes at its deepest row, so that its force is too small, and the fitted "
                    "modulus too large, by about {}; "
                    "take a finer mesh: with {} nodes it is 10 %",
                    report.bundle, fit.fewest_touched, percent(kBallError / std::sqrt(double(fit.fewest_touched))),
                    kFewestTouched));
  for (std::size_t u = 0; u < fit.units.size(); ++u) {
    const double ratio = fit.curve.unit_shear[u] / fit.curve.shear.value;
    if (ratio > kFarUnit || ratio < 1 / kFarUnit)
      warnings.push_back(
          fmt::format("{} {}: on its own it gives {:.2g} times the fitted modulus; check its position, its "
                      "zero of depth and its units",
                      unit_word(report, 1), fit.units[u], ratio));
  }
  if (report.fit.soft_supports) {
    const double ratio = young_of(report, 0).value / fit.regions[0].young;
    if (std::abs(ratio - 1) > kOtherSupports)
      warnings.push_back(fmt::format(
          "{}: it has foundations or springs, and the fit takes them as {:.3g} times as stiff, as it takes the tissue; "
          "compute the bundle with the fitted modulus and fit again, until the modulus changes by less than {:g} %",
          report.bundle, ratio, 100 * kOtherSupports));
  }
  return warnings;
}

std::string json_text(const LargeReport& report) {
  const Measurements& data = report.measurements;
  const LargeFit& fit = report.fit;
  const CurveFit& curve = fit.curve;
  Json out = {{"program_version", PALPATE_VERSION},
              {"measurements", data.file.string()},
              {"measurements_sha256", data.sha256},
              {"source", report.source},
              {"bundles", {report.bundle}},
              {"law", report.family.name()},
              {"press", report.press == Press::plate            ? "plate"
                        : report.press == Press::sticking_plate ? "sticking plate"
                        : report.press == Press::sliding        ? "sliding"
                                                                : "sticking"},
              {"rows", data.rows.size()},
              {"rows_left_out", data.left_out + data.without_push},
              {"level", 0.95},
              {"units", fit.of_specimens ? "specimens" : "places"},
              {"interval", curve.unit_part == UnitPart::bootstrap   ? "bootstrap"
                           : curve.unit_part == UnitPart::jackknife ? "jackknife"
                                                                    : "correlated residuals"},
              {"draws", report.options.curves.repetitions},
              {"seed", report.options.curves.seed}};
  out["regions"] = Json::array();
  for (std::size_t r = 0; r < fit.regions.size(); ++r)
    out["regions"].push_back({{"name", fit.regions[r].name}, {"young_Pa", json_of(young_of(report, r))}});
  out["shear_Pa"] = json_of(curve.shear);
  out["constants"] = Json::array();
  for (const FittedConstant& constant : curve.constants) {
    out["constants"].push_back(
        {{"name", constant.name}, {"fitted", json_of(constant.estimate)}, {"at_limit", constant.at_limit}});
    if (constant.pascals) out["constants"].back()["fitted_Pa"] = json_of(*constant.pascals);
  }
  out["held"] = Json::object();
  for (const auto& [name, value] : report.family.held()) out["held"][name] = value;
  out["residual"] = curve.residual, out["law_error"] = curve.law_error;
  out["untold"] = Json::array();
  for (const Untold& untold : curve.untold) {
    const auto end = [&](const Untold::Fitted& of) -> Json {
      return {{"shear_Pa", of.shear},
              {"constants", std::vector<double>(of.constants.begin(), of.constants.end())},
              {"residual", of.residual}};
    };
    out["untold"].push_back({{"constant", untold.constant},
                             {"together", untold.together},
                             {"range", untold.range},
                             {"low", end(untold.low)},
                             {"high", end(untold.high)}});
  }
  out["places"] = Json::array();
  for (std::size_t u = 0; u < fit.units.size(); ++u)
    out["places"].push_back({{"name", fit.units[u]},
                             {"rows", fit.unit_rows[u]},
                             {"young_Pa", curve.unit_shear[u] / curve.shear.value * young_of(report, 0).value},
                             {"residual", curve.unit_residual[u]}});
  for (const HeldOut& held : fit.held_out)
    out["places"].push_back({{"name", held.name},
                             {"rows", held.rows},
                             {"young_Pa", held.own_shear / curve.shear.value * young_of(report, 0).value},
                             {"held_out", true}});
  out["held_out"] = Json::array();
  for (const HeldOut& held : fit.held_out) out["held_out"].push_back(json_of(held));
  if (!fit.held_out.empty()) out["held_out_in_all"] = json_of(fit.held_out_in_all);
  out["forces"] = Json::array();
  for (std::size_t r = 0; r < data.rows.size(); ++r)
    out["forces"].push_back({{"place", fit.unit_of_row[r]},
                             {"depth_m", data.rows[r].depth},
                             {"measured_N", data.rows[r].force},
                             {"fitted_N", fit.force[r]},
                             {"held_out", !fit.fitted[r]}});
  out["warnings"] = warnings_of(report);
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string organ_lines(const LargeReport& report) {
  const Measurements& data = report.measurements;
  const std::string from = fmt::format("palpate-fit --large {} of {} (sha256 {})", report.family.name(),
                                       data.file.filename().string(), data.sha256);
  const std::string said = report.source.empty() ? "" : "; " + report.source;
  std::string text = fmt::format(
      "# palpate-fit {}: the law {} under large strain, {}, {};\n# {} rows of {} {} of {}, sha256 {},\n# on {}.\n",
      PALPATE_VERSION, report.family.name(), press_in_words(report.press), depth_in_words(report), data.rows.size(),
      report.fit.units.size(), unit_word(report, report.fit.units.size()), data.file.filename().string(), data.sha256,
      report.bundle);
  for (std::size_t r = 0; r < report.fit.regions.size(); ++r) {
    const Region& region = report.fit.regions[r];
    const Estimate young = young_of(report, r);
    const Unit unit = unit_of(young.value);
    text += fmt::format("\n[[region]]\nname = {}\n", quoted(region.name));
    text += fmt::format("# Young's modulus {}\n", modulus_text(young));
    text += fmt::format("young = {{ value = {:.4g}, unit = \"{}\", source = {} }}\n", young.value / unit.pascals,
                        unit.name, quoted(fmt::format("{}, {}{}", from, modulus_text(young), said)));
    text += fmt::format("poisson = {{ value = {:.10g}, source = {} }}\n", region.poisson,
                        quoted(fmt::format("that of {}, on which young was fitted", report.bundle)));
    std::string constants;
    for (const FittedConstant& constant : report.fit.curve.constants)
      constants += fmt::format("; {}{} {}", constant.name, constant.pascals ? " over the shear modulus" : "",
                               number_text(constant.estimate));
    text += law_line(report, young.value, region.poisson, quoted(from + constants + said));
  }
  return text;
}

}  // namespace palpate::fit
