// palpate-validation: compares the solver with closed forms and with CalculiX.
#include <CLI/CLI.hpp>

#include "precompute/solver/petsc_session.h"
#include "studies/accuracy/study_options.h"
#include "studies/validation/study.h"

namespace {

void define_options(CLI::App& app, palpate::validation::StudyOptions& options) {
  app.add_option("-o,--output", options.output, "the study's folder; default DATA/validation")->option_text("FOLDER");
  palpate::accuracy::add_folders(app, options);
  app.add_option("--bin", options.bin, "the programs; default: beside this one")->option_text("DIR");
  app.add_option("--source", options.source, "the repository, for its pipelines")->option_text("DIR");
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
      "its order of convergence is not that of theory.");
}

}  // namespace

int main(int argc, char** argv) {
  palpate::validation::StudyOptions options;
  palpate::accuracy::set_folders(options, PALPATE_SOURCE_FOLDER);
  return palpate::run_program(
      argc, argv, "palpate-validation", "Checks the solver against closed-form solutions and against CalculiX.",
      [&](CLI::App& app) { define_options(app, options); },
      [&] {
        const palpate::PetscSession session({});
        palpate::validation::run_study(options);
      });
}
