// large_study ORGAN BC: large deformation against converged solutions, and its times; make -f Makefile.data large-deformation.
#include <CLI/CLI.hpp>

#include "formats/command_line.h"
#include "formats/errors.h"
#include "studies/accuracy/study_options.h"
#include "studies/large/study.h"

namespace palpate::large {
namespace {

void define(CLI::App& app, LargeStudyOptions& options) {
  accuracy::add_organ_options(app, options.organ, "large-deformation");
  for (const char* name : {"organ", "boundary"}) app.get_option(name)->required();
  app.add_option("--poisson", options.poisson, "Poisson's ratios of all tissue")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 0.4999))
      ->option_text("NU,NU,...");
  app.add_option("--depths", options.depths_mm, "depths of the moves, mm, growing")
      ->delimiter(',')
      ->check(positive_number())
      ->option_text("D,D,...");
  app.add_option("--speed", options.speed_mm_s, "of the discs, mm/s; a touch each millisecond")
      ->check(positive_number())
      ->capture_default_str();
  app.add_option("--threads", options.threads,
                 "moves measured beside one another; more than one is sooner ready and shows longer times")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app.add_option("--composed", options.composed,
                 "places where jaws draw the organ and where a copy of it presses it; 0 for none of both")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.footer(accuracy::kVariablesBehindDashes);
}

int run(int argc, char** argv) {
  LargeStudyOptions options;
  accuracy::set_folders(options.organ, PALPATE_SOURCE_FOLDER);
  const int own = accuracy::take_make_variables(argc, argv, options.organ);
  options.organ.resolutions = {"600", "1700"}, options.organ.sites = 20;
  return run_program(
      own, argv, "large_study", "Compares large deformation with converged solutions, on your own organ.",
      [&](CLI::App& app) { define(app, options); }, [&] { run_study(options); });
}

}  // namespace
}  // namespace palpate::large

int main(int argc, char** argv) {
  return palpate::large::run(argc, argv);
}
