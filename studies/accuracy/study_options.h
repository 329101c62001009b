// What the studies have on their command lines in common.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "formats/command_line.h"
#include "studies/accuracy/organ_case.h"

namespace palpate::accuracy {

// Sets the folders that stand for themselves. Options: has source, bin, data and python.
template <typename Options>
void set_folders(Options& options, const char* source) {
  // The pipelines' rules run Open MPI's programs: see pipelines/rules.mk.
  ::setenv("HWLOC_COMPONENTS", "-gl", 0);
  options.source = source, options.data = "data", options.python = "/usr/bin/python3";
  options.bin = std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

// The arguments behind "--" are variables for the pipelines' rules. Returns how many arguments are before it.
inline int take_make_variables(int argc, char** argv, StudyOptions& options) {
  int own = 0;
  while (own < argc && std::strcmp(argv[own], "--") != 0) ++own;
  options.make_variables.assign(argv + std::min(own + 1, argc), argv + argc);
  return own;
}

// Options: has data and python.
template <typename Options>
void add_folders(CLI::App& app, Options& options) {
  app.add_option("--data", options.data, "where the pipelines put their results")->capture_default_str();
  app.add_option("--python", options.python, "a Python with matplotlib, for the report")->capture_default_str();
}

// An organ, its boundary set, the study's folder, mesh sizes, and the places where discs of one radius press.
inline void add_organ_options(CLI::App& app, StudyOptions& options, const std::string& study) {
  app.add_option("organ", options.organ, "a folder of pipelines/")->option_text("ORGAN");
  app.add_option("boundary", options.boundary, "a boundary set of the organ")->option_text("BC");
  app.add_option("-o,--output", options.output, "the study's folder; default DATA/ORGAN/" + study + "/BC")
      ->option_text("FOLDER");
  add_folders(app, options);
  app.add_option("--resolutions", options.resolutions, "mesh sizes of the organ, coarse to fine")
      ->delimiter(',')
      ->option_text("R,R,...");
  app.add_option("--radius", options.radius_mm, "radius of the discs, mm")
      ->check(positive_number())
      ->capture_default_str();
  app.add_option("--sites,--places", options.sites, "number of places that discs press")
      ->check(CLI::Range(1, 50))
      ->capture_default_str();
}

inline constexpr const char* kVariablesBehindDashes =
    "Resumes: FOLDER/points keeps what was measured with the same inputs and programs. Options after -- are variables\n"
    "for the pipeline's rules, for example IMAGE=organ.nrrd SURFACE_OPTIONS_200=...";

}  // namespace palpate::accuracy
