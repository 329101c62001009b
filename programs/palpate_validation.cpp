// palpate-validation: compares the solver with closed forms and with CalculiX.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>

#include "formats/command_line.h"
#include "precompute/solver/petsc_session.h"
#include "studies/validation/study.h"

namespace {

void define_options(CLI::App& app, palpate::validation::StudyOptions& options) {
  app.add_option("-o,--output", options.output, "the study's folder; default DATA/validation")->option_text("FOLDER");
  app.add_option("--data", options.data, "where the pipelines put their results")->capture_default_str();
  app.add_option("--bin", options.bin, "the programs; default: beside this one")->option_text("DIR");
  app.add_option("--source", options.source, "the repository, for its pipelines")->option_text("DIR");
  app.add_option("--python", options.python, "a Python with matplotlib, for the report")->capture_default_str();
  app.add_option("--organ-mesh", options.organ_meshes,
                 "compare with CalculiX on this mesh of a pipeline too; the pipeline makes it if it is missing; may be "
                 "repeated")
      ->option_text("ORGAN/BC/RESOLUTION");
  app.add_option(
         "--organ-push", options.organ_pushes,
         "compare with CalculiX on this mesh with large strain: a disc of 10 mm radius pushed in by 10, 20 and 30 mm; "
         "may be repeated")
      ->option_text("ORGAN/BC/RESOLUTION");
  app.add_option("--only", options.only, "run only this case; may be repeated")->option_text("CASE");
  app.add_flag("--short", options.brief,
               "only the two coarsest meshes of each case; checks that errors fall and that exact answers are exact");
  app.footer(
      "Resumes: FOLDER/points keeps every measurement of the same program. Exit code 3: an error exceeds its bound, or "
      "its order "
      "of convergence is not that of theory.");
}

}  // namespace

int main(int argc, char** argv) {
  // Open MPI, here and in the programs that are started: see pipelines/rules.mk.
  ::setenv("HWLOC_COMPONENTS", "-gl", 0);
  palpate::validation::StudyOptions options;
  options.source = PALPATE_SOURCE_FOLDER, options.data = "data", options.python = "/usr/bin/python3";
  options.bin = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  return palpate::run_program(
      argc, argv, "palpate-validation", "Checks the solver against closed-form solutions and against CalculiX.",
      [&](CLI::App& app) { define_options(app, options); },
      [&] {
        const palpate::PetscSession session({});
        palpate::validation::run_study(options);
      });
}
