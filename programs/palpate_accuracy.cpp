// palpate-accuracy ORGAN BC: measures what each choice costs in accuracy and in time on this organ. choose: picks a setting.
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "formats/errors.h"
#include "studies/accuracy/choose_program.h"
#include "studies/accuracy/study.h"
#include "studies/accuracy/study_options.h"

namespace palpate::accuracy {
namespace {

void define_study(CLI::App& app, StudyOptions& options) {
  add_organ_options(app, options, "accuracy");
  app.add_option("--bin", options.bin, "the programs that are measured; default: beside this one")->option_text("DIR");
  app.add_option("--source", options.source, "the repository, for its pipelines")->option_text("DIR");
  app.get_option("--resolutions")->description("mesh sizes of the organ, coarse to fine; default: all it has");
  app.add_option(
         "--axes", options.axes,
         "what is varied: mesh (with element and contact), scenes, storage, tolerance, poisson, depth; default: all")
      ->delimiter(',')
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(kAxes), std::end(kAxes))))
      ->option_text("A,A,...");
  app.add_option("--memory", options.memory_gigabytes, "most memory of a precompute, GB; default: what is free")
      ->check(positive_number());
  app.add_option("--most-seconds", options.most_seconds,
                 "most predicted time of a precompute with p2-p0, and of any on a mesh that p2-p0 does not fit, s")
      ->check(positive_number())
      ->capture_default_str();
  app.add_option("--repeats", options.repeats, "runs of a precompute that takes less than 3 s; the median counts")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("--samples", options.samples, "number of surface points where the displacement is compared")
      ->check(CLI::Range(1, 5000))
      ->capture_default_str();
  app.footer(
      std::string("Compares with p2-p0 on the finest mesh that --memory and --most-seconds allow, or with p1-anp "
                  "on a finer one if\nits estimated error is smaller.\n") +
      kVariablesBehindDashes);
}

// A number and the text behind it; -1 where there is none.
std::pair<double, std::string> number_and_unit(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return {end == text.c_str() ? -1 : value, end};
}

// "20mm", "2cm", "0.02m"; mm.
double length_in_mm(const char* option, const std::string& text) {
  const auto [value, unit] = number_and_unit(text);
  const double scale = unit == "mm" ? 1 : unit == "cm" ? 10 : unit == "m" ? 1000 : 0;
  if (!(value > 0) || scale == 0)
    throw CLI::ValidationError(option, "expected a length above 0 with its unit, such as 20mm; found " + text);
  return scale * value;
}

// "2%" or "0.02".
double number_or_percent(const char* option, const std::string& text) {
  const auto [value, unit] = number_and_unit(text);
  const bool percent = unit == "%";
  if (!(value > 0) || !(percent || unit.empty()))
    throw CLI::ValidationError(option, "expected a number above 0, or one and %, such as 2%; found " + text);
  return percent ? value / 100 : value;
}

CLI::App* define_choose(CLI::App& app, ChooseOptions& options) {
  CLI::App* choose = app.add_subcommand(
      "choose", "Prints the cheapest measured setting within limits, or which limit rules all settings out");
  const auto limit = [choose, &options](const char* option, const char* field, const char* what) {
    choose->add_option_function<std::string>(
        option,
        [&options, option, field](const std::string& text) {
          options.limits.push_back({field, std::string(option) + " " + text, number_or_percent(option, text)});
        },
        what);
  };
  limit("--force-error", "force_error", "largest error of the tool's force, relative: 2% or 0.02");
  limit("--field-error", "field_error", "largest error of the surface's displacement, relative");
  limit("--touch-us", "touch_us", "longest haptic step (touch), median, us");
  limit("--touch-us-99", "touch_us_99", "longest haptic step, 99th percentile, us");
  limit("--shape-us", "shape_us", "longest update of the surface (shape), median, us");
  limit("--bundle-mb", "bundle_MB", "largest bundle, 1e6 bytes");
  limit("--precompute-s", "precompute_s", "longest precompute with packing, s");
  limit("--precompute-gb", "precompute_GB", "most memory of the precompute, 1e9 bytes");
  choose
      ->add_option_function<std::string>(
          "--depth", [&options](const std::string& text) { options.depth_mm = length_in_mm("--depth", text); },
          "the deepest push: also chooses the deformation (linear, response, large) whose errors there are within "
          "limits, 5% where none is given")
      ->option_text("LENGTH");
  choose->add_option("--least", options.least, "the figure to minimise among the settings within the limits")
      ->check(CLI::IsMember({"precompute_s", "bundle_MB", "touch_us", "shape_us", "force_error", "field_error"}))
      ->capture_default_str();
  choose->add_option("--study", options.study, "the study's folder; default: the only one below --data");
  choose->add_option("--data", options.data, "where the pipelines put their results")->capture_default_str();
  choose->add_option("--source", options.source, "the repository, for its pipelines");
  choose->add_option("-o,--output", options.output, "writes organ.toml, effects.toml, measured.json and bake.sh there");
  return choose;
}

CLI::App* define_check(CLI::App& app, CheckOptions& options) {
  CLI::App* check = app.add_subcommand(
      "check", "Measures a baked bundle again; exit code 3 if an error exceeds the one in its certificate");
  check->add_option("bundle", options.bundle, "a bundle made by bake.sh")
      ->required()
      ->option_text("BUNDLE.h5 REQUIRED");
  check->add_option("--study", options.study, "the study's folder; default: the only one below --data");
  check->add_option("--data", options.data, "where the pipelines put their results")->capture_default_str();
  return check;
}

int run(int argc, char** argv) {
  StudyOptions study;
  set_folders(study, PALPATE_SOURCE_FOLDER);
  const int own = take_make_variables(argc, argv, study);
  ChooseOptions choosing;
  choosing.source = study.source, choosing.data = study.data;
  CheckOptions checking;
  checking.data = study.data;
  CLI::App *chooser = nullptr, *checker = nullptr;
  return run_program(
      own, argv, "palpate-accuracy", "Shows what accuracy costs in time, on your own organ.",
      [&](CLI::App& app) {
        define_study(app, study);
        chooser = define_choose(app, choosing);
        checker = define_check(app, checking);
      },
      [&] {
        if (chooser->parsed()) return choose(choosing);
        if (checker->parsed()) return check(checking);
        if (study.organ.empty() || study.boundary.empty())
          throw InputError("expected ORGAN and BC, or choose, or check; see palpate-accuracy --help");
        run_study(study);
      });
}

}  // namespace
}  // namespace palpate::accuracy

int main(int argc, char** argv) {
  return palpate::accuracy::run(argc, argv);
}
