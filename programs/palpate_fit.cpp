// palpate-fit: finds Young's modulus, and Poisson's ratio or a ratio of moduli, from measured forces.

#include <fmt/format.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <map>

#include "formats/atomic_file.h"
#include "formats/command_line.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "programs/fit/fit_report.h"
#include "programs/fit/large_report.h"

namespace palpate::fit {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<fs::path> inputs;  // bundles, then the measurements
  fs::path json, organ;
  std::optional<Press> law;
  bool plate = false;
  double radius_mm = 0, most_depth_mm = 0, least_depth_mm = 0;
  std::optional<FittedLaw> large;
  std::vector<std::string> hold, holdout;
  std::string source;
  FitOptions fit;
};

// Before anything is computed.
void check_outputs(const Options& options) {
  for (const fs::path& file : {options.json, options.organ})
    if (!file.empty()) check_target(file);
  if (!options.organ.empty() && fs::exists(options.organ))
    throw InputError(
        fmt::format("{}: expected a new file for the lines of organ.toml, found one that exists; name another and "
                    "copy the lines, or remove it",
                    options.organ.string()));
}

ReadOptions read_options(const Options& options) {
  ReadOptions read;
  read.plate = options.plate;
  read.radius = 1e-3 * options.radius_mm;
  if (options.most_depth_mm > 0) read.most_depth = 1e-3 * options.most_depth_mm;
  read.least_depth = 1e-3 * options.least_depth_mm, read.curves = options.large.has_value();
  return read;
}

Press press_of(const Options& options) {
  if (!options.plate) return options.law.value_or(Press::sticking);
  return options.law == Press::sticking ? Press::sticking_plate : Press::plate;
}

// Of --hold NAME=VALUE.
std::map<std::string, double> held_constants(const Options& options) {
  std::map<std::string, double> held;
  for (const std::string& text : options.hold) {
    const auto sign = text.find('=');
    const std::string name = text.substr(0, sign), value = sign == std::string::npos ? "" : text.substr(sign + 1);
    char* end = nullptr;
    const double number = std::strtod(value.c_str(), &end);
    if (value.empty() || *end != '\0' || !std::isfinite(number) || held.count(name))
      throw InputError(fmt::format("--hold: expected NAME=VALUE, each constant once, found {}", text));
    held[name] = number;
  }
  return held;
}

void check_use_of_large(const Options& options) {
  if (options.large) {
    if (options.inputs.size() > 2)
      throw InputError(
          fmt::format("--large: expected one bundle, found {}; it fits a law's constants, not what bundles differ in",
                      options.inputs.size() - 1));
    if (options.fit.initial_slope)
      throw InputError("--large: expected no --initial-slope, found it; the law takes up what is not linear");
  } else if (!options.hold.empty() || !options.holdout.empty()) {
    throw InputError(
        fmt::format("{}: expected --large LAW beside it, found none", options.hold.empty() ? "--holdout" : "--hold"));
  }
}

// The results of either kind of fit.
template <class Report>
void write(const Options& options, const Report& report) {
  for (const std::string& warning : warnings_of(report)) warn(warning);
  fmt::print("{}", summary_text(report));
  if (!options.json.empty()) write_text_atomically(options.json, json_text(report));
  if (options.organ.empty())
    fmt::print("\n{}", organ_lines(report));
  else
    write_text_atomically(options.organ, organ_lines(report));
}

// Each step of Newton's method takes and gives back the same arrays. The C library would give their memory back to the system each time, and the
// system would clear it anew, which takes a quarter of the time.
void keep_memory() {
  mallopt(M_MMAP_THRESHOLD, 1 << 30), mallopt(M_TRIM_THRESHOLD, 1 << 30), mallopt(M_TOP_PAD, 1 << 26);
}

void run_large(const Options& options, const Measurements& measurements, const std::string& source) {
  keep_memory();
  const LawFamily family(*options.large, held_constants(options));
  PressedBundle bundle(options.inputs.front());
  const LargeOptions of_fit{{options.fit.repetitions, options.fit.seed}, options.holdout};
  const Press press = press_of(options);
  const LargeFit fit = fit_large(bundle, measurements, press, family, of_fit);
  write(options, LargeReport{measurements, bundle.file().string(), family, fit, press, of_fit, source});
}

void run(const Options& options) {
  check_use_of_large(options);
  check_outputs(options);
  const Press press = press_of(options);
  const Measurements measurements = read_measurements(options.inputs.back(), read_options(options));
  if (!measurements.unused.empty())
    note(fmt::format("{}: columns that are not read: {}", measurements.file.string(),
                     fmt::join(measurements.unused, ", ")));
  const std::string source =
      options.source.empty() ? fmt::format("{}", fmt::join(measurements.sources, "; ")) : options.source;
  if (options.large) {
    run_large(options, measurements, source);
    return;
  }
  const bool balls = !measurements.spots.empty() && measurements.spots.front().ball_depth > 0;
  if (balls && options.fit.initial_slope)
    throw InputError(
        fmt::format("{}: --initial-slope is for flat ends, whose force grows in proportion to the depth; for a ball "
                    "leave it out and leave deep rows out with --most-depth",
                    measurements.file.string()));
  const BundleFamily family = press_bundles({options.inputs.begin(), options.inputs.end() - 1}, measurements, press);
  const StiffnessModel model(family.values, family.stiffness);
  const Fit fit = fit_forces(measurements, model, options.fit);
  write(options, FitReport{measurements, family, model, fit, press, options.fit, source});
}

void define(CLI::App& app, Options& options) {
  app.add_option("FILES", options.inputs,
                 "a bundle, or several of one mesh with other Poisson's ratios or another ratio of two regions' "
                 "moduli; then the measured forces")
      ->required()
      ->expected(2, 100)
      ->option_text("BUNDLE.h5... MEASUREMENTS.csv REQUIRED");
  app.add_option("--json", options.json, "all results as JSON, from which programs/fit/plot.py draws")
      ->option_text("FILE.json");
  app.add_option("--organ", options.organ, "a new file for the lines of organ.toml; default: print them")
      ->option_text("FILE.toml");
  app.add_option("--law", options.law, "how the indenter holds the surface; default: sticking, of a plate sliding")
      ->option_text("sticking|sliding")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, Press>{{"sticking", Press::sticking}, {"sliding", Press::sliding}}));
  auto* plate =
      app.add_flag("--plate", options.plate,
                   "a plate presses all touchable nodes at once, along the axis that they look along; the file "
                   "then has columns for neither place nor radius");
  app.add_option("--radius", options.radius_mm,
                 "the radius of the indenter's flat end, mm, where the file has no column for it")
      ->check(positive_number())
      ->excludes(plate)
      ->option_text("MM");
  app.add_option("--most-depth", options.most_depth_mm, "leave out rows that are deeper, mm")
      ->check(positive_number())
      ->option_text("MM");
  app.add_option("--least-depth", options.least_depth_mm, "leave out rows that are shallower, mm")
      ->check(positive_number())
      ->option_text("MM");
  app.add_flag("--initial-slope", options.fit.initial_slope,
               "fit the slope at depth 0: a term in depth squared at each place takes up what is not linear");
  app.add_option("--large", options.large,
                 "fit the modulus and the other constants of this law to whole curves, by the body's solution under "
                 "large strain; a column specimen says which rows are of one specimen")
      ->option_text("neo-hookean|stiffening|yeoh|ogden")
      ->transform(CLI::CheckedTransformer(std::map<std::string, FittedLaw>{{"neo-hookean", FittedLaw::neo_hookean},
                                                                           {"stiffening", FittedLaw::stiffening},
                                                                           {"yeoh", FittedLaw::yeoh},
                                                                           {"ogden", FittedLaw::ogden}}));
  app.add_option("--hold", options.hold,
                 "with --large: a constant that is not fitted: b, c2, c3 (over the shear modulus), exponent, share or "
                 "second_exponent, with which a second term of Ogden's law is fitted")
      ->allow_extra_args(false)
      ->option_text("NAME=VALUE ...");
  app.add_option("--holdout", options.holdout,
                 "with --large: specimens, or places, that are not fitted but predicted; their errors are stated")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->option_text("NAME,...");
  app.add_option("--source", options.source,
                 "where the measurements are from, for organ.toml; default: the column source");
  app.add_option("--draws", options.fit.repetitions, "draws of the bootstrap")
      ->check(CLI::Range(200, 1000000))
      ->capture_default_str();
  app.add_option("--seed", options.fit.seed, "of the bootstrap's draws")->capture_default_str();
}

}  // namespace
}  // namespace palpate::fit

int main(int argc, char** argv) {
  palpate::fit::Options options;
  return palpate::run_program(
      argc, argv, "palpate-fit", "Finds the stiffness of an organ from forces measured on it.",
      [&](CLI::App& app) { palpate::fit::define(app, options); }, [&] { palpate::fit::run(options); });
}
