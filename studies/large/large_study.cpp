// large_study ORGAN BC: large deformation against converged solutions, and its times; make -f Makefile.data large-deformation.
#include <CLI/CLI.hpp>
#include <cstdlib>
#include <cstring>

#include "formats/command_line.h"
#include "formats/errors.h"
#include "studies/large/study.h"

namespace palpate::large {
namespace {

void define(CLI::App& app, LargeStudyOptions& options) {
  accuracy::StudyOptions& organ = options.organ;
  app.add_option("organ", organ.organ, "a folder of pipelines/")->option_text("ORGAN REQUIRED")->required();
  app.add_option("boundary", organ.boundary, "a boundary set of the organ")->option_text("BC REQUIRED")->required();
  app.add_option("-o,--output", organ.output, "the study's folder; default DATA/ORGAN/large-deformation/BC")
      ->option_text("FOLDER");
  app.add_option("--data", organ.data, "where the pipelines put their results")->capture_default_str();
  app.add_option("--python", organ.python, "a Python with matplotlib, for the report")->capture_default_str();
  app.add_option("--resolutions", organ.resolutions, "mesh sizes of the organ, coarse to fine")
      ->delimiter(',')
      ->option_text("R,R,...");
  app.add_option("--places", organ.sites, "number of places where the discs move")
      ->check(CLI::Range(1, 50))
      ->capture_default_str();
  app.add_option("--radius", organ.radius_mm, "radius of the discs, mm")
      ->check(positive_number())
      ->capture_default_str();
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
  app.footer(
      "Resumes: FOLDER/points keeps every move measured with the same inputs and program. Options after -- are "
      "variables\n"
      "for the pipeline's rules, for example IMAGE=organ.nrrd SURFACE_OPTIONS_200=...");
}

int run(int argc, char** argv) {
  int own = 0;
  while (own < argc && std::strcmp(argv[own], "--") != 0) ++own;
  LargeStudyOptions options;
  options.organ.source = PALPATE_SOURCE_FOLDER, options.organ.data = "data", options.organ.python = "/usr/bin/python3";
  options.organ.bin = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  options.organ.resolutions = {"600", "1700"}, options.organ.sites = 20;
  options.organ.make_variables.assign(argv + std::min(own + 1, argc), argv + argc);
  return run_program(
      own, argv, "large_study", "Compares large deformation with converged solutions, on your own organ.",
      [&](CLI::App& app) { define(app, options); }, [&] { run_study(options); });
}

}  // namespace
}  // namespace palpate::large

int main(int argc, char** argv) {
  // The pipelines' rules run Open MPI's programs: see pipelines/rules.mk.
  ::setenv("HWLOC_COMPONENTS", "-gl", 0);
  return palpate::large::run(argc, argv);
}
