// palpate-precompute: tetrahedra -> tensors -> bundle. Also under mpiexec.
#include <fmt/format.h>
#include <mpi.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "formats/command_line.h"
#include "formats/make_rule.h"
#include "precompute/ranks/rank_group.h"
#include "precompute/run/precompute.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {
namespace {

void define_options(CLI::App& app, PrecomputeOptions& options) {
  app.add_option("mesh", options.mesh, "tetrahedral mesh, MSH 2.2 or 4.1")
      ->required()
      ->option_text("MESH.msh REQUIRED");
  app.add_option("--organ", options.organ, "materials and measured curve")
      ->required()
      ->option_text("organ.toml REQUIRED");
  app.add_option("--boundary", options.boundary, "what is held, what may be touched")
      ->required()
      ->option_text("bc.toml REQUIRED");
  auto* bundle = app.add_option("-o,--output", options.bundle, "the tensor bundle to write")
                     ->option_text("BUNDLE.h5 REQUIRED but for --plan");
  app.add_option("--image", options.image,
                 "the image the mesh came from: its hash is recorded, and label selectors of --boundary read it")
      ->option_text("FILE");
  app.add_option("--tolerance", options.tolerance, "on the true relative residual of every column; default 1e-9")
      ->check([](const std::string& text) {  // CLI11's own sentence shows 1e-15 as 0.000000
        double value = 0;
        return CLI::detail::lexical_cast(text, value) && value >= 1e-15 && value <= 1e-2
                   ? std::string()
                   : "expected a number from 1e-15 to 1e-2, found " + text;
      })
      ->option_text("R");
  app.add_option("--memory", options.memory_gigabytes,
                 "what all ranks on one machine may take, in GB (1e9 bytes); default: what is free")
      ->check(positive_number())
      ->option_text("GB");
  app.add_option("--batch", options.columns_at_a_time, "columns solved at a time; default 96, with multigrid 32")
      ->check(CLI::Range(1, 4096))
      ->option_text("P");
  app.add_option("--store", options.store, "numbers of the stored displacements: f32 (default), f64 or f16")
      ->transform(CLI::CheckedTransformer(std::map<std::string, formats::ElementType>{
          {"f32", formats::ElementType::f32}, {"f64", formats::ElementType::f64}, {"f16", formats::ElementType::f16}}))
      ->option_text("TYPE");
  app.add_option(
         "--low-rank", options.low_rank,
         "store the surface in blocks of low rank, with at most this relative error of a column (1e-3); the disk "
         "holds all columns until they are packed")
      ->option_text("E");
  app.add_flag("--interior", options.interior,
               "store the displacement of the nodes inside the organ too, which shape = \"volume\" of a scene needs");
  app.add_flag("--element-stiffness", options.element_stiffness,
               "measure how much too stiff the element is also where that takes over a tenth of the run");
  app.add_flag("--large-deformation", options.large_deformation,
               "store what a scene with deformation = \"large\" needs; elements p1, p1-anp and p1-ang");
  app.add_flag("--plan", options.plan_only, "say what the run would take and why, and write nothing");
  app.add_option(
         "--ranks-per-operator", options.ranks_per_operator,
         "ranks that divide one operator among them; default: the fewest whose memory holds it; above 1, bundles of "
         "two runs are equal to rounding, and to the byte only with -- -column_pc_type gamg")
      ->check(positive_number())
      ->option_text("G");
  app.add_option("--json", options.json, "what was done and what it took, as JSON; - is standard output")
      ->option_text("FILE");
  app.callback([bundle, &options] {
    if (bundle->empty() && !options.plan_only) throw CLI::RequiredError("--output");
  });
  app.footer(
      "Options after -- go to PETSc: without prefix for the conjugate gradients (-ksp_monitor), with column_ for the\n"
      "preconditioner of the stiffness matrix (-column_pc_type gamg). One that PETSc does not use is an error.\n"
      "Under mpiexec -n N each rank solves its share of the columns; the bundle is the same to the byte for the same\n"
      "--ranks-per-operator.\n"
      "A run that was stopped, killed or failed leaves BUNDLE.h5.part and BUNDLE.h5.journal; the same command "
      "resumes.");
}

int run(int argc, char** argv) {
  int own = 0;
  while (own < argc && std::strcmp(argv[own], "--") != 0) ++own;
  const std::vector<std::string> petsc_options(argv + std::min(own + 1, argc), argv + argc);

  StopSignals signals;
  Ranks ranks(MPI_COMM_WORLD);
  // An error is thrown on all ranks; only rank 0 prints it.
  keep_standard_error();
  if (ranks.rank() != 0 && (!std::freopen("/dev/null", "w", stdout) || !std::freopen("/dev/null", "w", stderr)))
    return 1;
  PrecomputeOptions options;
  MakeRule rule;
  return run_program(
      own, argv, "palpate-precompute", "Computes the elastic response of an organ: tetrahedra -> tensors -> bundle.",
      [&](CLI::App& app) { define_options(app, options), define_make_rule(app, rule); },
      [&] {
        const PetscSession session(petsc_options);
        precompute(options, ranks, signals);
        if (ranks.rank() == 0) write_make_rule(rule);
      });
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::open_standard_streams();  // before MPI opens files of its own
  palpate::block_stop_signals();
  // Open MPI's hwloc would look for X servers by name, for minutes where no name resolves.
  ::setenv("HWLOC_COMPONENTS", "-gl", 0);
  // The threads that write and that wait for signals leave MPI alone.
  int threads = MPI_THREAD_SINGLE;
  if (MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &threads) != MPI_SUCCESS) return 1;
  const int code = palpate::run(argc, argv);
  MPI_Finalize();
  return code;
}
