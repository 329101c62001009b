// Memory and processor time with the operator divided among ranks, compared with one rank that holds all of it.
//   mpiexec -n G distributed_bench MESH.msh organ.toml bc.toml [columns at a time [batches]] [-- PETSc options]
#include <fmt/format.h>
#include <mpi.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bench/petsc_bench.h"
#include "precompute/elements/discretisation.h"
#include "precompute/ranks/divided_operator.h"
#include "studies/timing/timing.h"

namespace palpate {
namespace {

using studies::processor_seconds;

double peak_megabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1e3;
}

void run(const std::vector<std::string>& words) {
  int rank = 0, count = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &count);
  const OrganConfig organ = read_organ_config(words[1]);
  const ElasticBody body =
      make_elastic_body(read_mesh(words[0]), organ, read_boundary_config(words[2]), {words[0], words[1], words[2]});
  const double read_megabytes = peak_megabytes();
  ColumnSolverOptions options;
  options.width = words.size() > 3 ? std::stoi(words[3]) : 32;
  const int batches = words.size() > 4 ? std::stoi(words[4]) : 3;

  double begin = processor_seconds();
  const RowPartition partition = partition_rows(body.nodes, body.fixed, count);
  std::unique_ptr<ColumnSolver> solver;
  {
    BlockMatrix own = assemble_own_rows(
        body, partition, rank, [&](const ElasticBody& part) { return discretise(part, organ.element).stiffness; });
    solver = divided_column_solver(MPI_COMM_WORLD, std::move(own), partition, body.nodes, body.fixed, options);
  }
  const double set_up = processor_seconds() - begin;
  std::vector<double> x(rank == 0 ? static_cast<std::size_t>(solver->dofs() * solver->width()) : 0);
  std::vector<ColumnReport> reports(solver->width());
  begin = processor_seconds();
  double worst = 0;
  for (int batch = 0; batch < batches; ++batch) {
    std::vector<Load> loads;
    for (std::int32_t c = 0; c < solver->width(); ++c) {
      const auto n = body.touchable[static_cast<std::size_t>(c / 3 + batch * 41) * 7919 % body.touchable.size()];
      loads.push_back({3 * static_cast<std::int64_t>(partition.row_of_node[n]) + c % 3, c, 1.0});
    }
    solver->solve(loads, x.data(), reports);
    for (const auto& report : reports) worst = std::max(worst, report.residual);
  }
  const double seconds = (processor_seconds() - begin) / (batches * solver->width());
  for (int r = 0; r < count; ++r) {
    MPI_Barrier(MPI_COMM_WORLD);
    if (r != rank) continue;
    fmt::print("| {} of {} | {:.0f} | {:.0f} | {:.2f} | {:.2f} | {} | {:.1e} | {} |\n", rank + 1, count, read_megabytes,
               peak_megabytes(), set_up, 1e3 * seconds, reports[0].iterations, worst, solver->description());
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  return palpate::bench::petsc_bench(
      argc, argv, 3, "distributed_bench MESH.msh organ.toml bc.toml [width [batches]] [-- PETSc options]",
      palpate::run);
}
