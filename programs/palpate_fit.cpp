// palpate-fit: finds Young's modulus, and Poisson's ratio or a ratio of moduli, from measured forces.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <map>

#include "formats/atomic_file.h"
#include "formats/command_line.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "programs/fit/fit_report.h"

namespace palpate::fit {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<fs::path> inputs;  // bundles, then the measurements
  fs::path json, organ;
  Press press = Press::sticking;
  bool plate = false;
  double radius_mm = 0, most_depth_mm = 0;
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
  return read;
}

void run(const Options& options) {
  check_outputs(options);
  const Press press = options.plate ? Press::plate : options.press;
  const Measurements measurements = read_measurements(options.inputs.back(), read_options(options));
  const bool balls = !measurements.spots.empty() && measurements.spots.front().ball_depth > 0;
  if (balls && options.fit.initial_slope)
    throw InputError(
        fmt::format("{}: --initial-slope is for flat ends, whose force grows in proportion to the depth; for a ball "
                    "leave it out and leave deep rows out with --most-depth",
                    measurements.file.string()));
  const BundleFamily family = press_bundles({options.inputs.begin(), options.inputs.end() - 1}, measurements, press);
  const StiffnessModel model(family.values, family.stiffness);
  const Fit fit = fit_forces(measurements, model, options.fit);
  const std::string source =
      options.source.empty() ? fmt::format("{}", fmt::join(measurements.sources, "; ")) : options.source;
  const FitReport report{measurements, family, model, fit, press, options.fit, source};

  if (!measurements.unused.empty())
    note(fmt::format("{}: columns that are not read: {}", measurements.file.string(),
                     fmt::join(measurements.unused, ", ")));
  for (const std::string& warning : warnings_of(report)) warn(warning);
  fmt::print("{}", summary_text(report));
  if (!options.json.empty()) write_text_atomically(options.json, json_text(report));
  if (options.organ.empty())
    fmt::print("\n{}", organ_lines(report));
  else
    write_text_atomically(options.organ, organ_lines(report));
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
  auto* law = app.add_option("--law", options.press, "how the indenter holds the surface; default: sticking")
                  ->option_text("sticking|sliding")
                  ->transform(CLI::CheckedTransformer(
                      std::map<std::string, Press>{{"sticking", Press::sticking}, {"sliding", Press::sliding}}));
  auto* plate =
      app.add_flag("--plate", options.plate,
                   "a smooth plate presses all touchable nodes at once, along the axis that they look along; the file "
                   "then has columns for neither place nor radius");
  plate->excludes(law);
  app.add_option("--radius", options.radius_mm,
                 "the radius of the indenter's flat end, mm, where the file has no column for it")
      ->check(positive_number())
      ->excludes(plate)
      ->option_text("MM");
  app.add_option("--most-depth", options.most_depth_mm, "leave out rows that are deeper, mm")
      ->check(positive_number())
      ->option_text("MM");
  app.add_flag("--initial-slope", options.fit.initial_slope,
               "fit the slope at depth 0: a term in depth squared at each place takes up what is not linear");
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
