// Processor time for one column with our multigrid, which solves many columns together, compared with PETSc's CG and GAMG, which
// solve one column at a time. The same matrix, in turns in the same run.
//   multigrid_bench MESH.msh organ.toml bc.toml [columns of the reference [widths...]] [-- PETSc options]
#include <fmt/format.h>
#include <petscksp.h>

#include <algorithm>
#include <string>
#include <vector>

#include "bench/petsc_bench.h"
#include "precompute/elements/discretisation.h"
#include "precompute/solver/column_solver.h"
#include "precompute/solver/petsc_matrix.h"
#include "studies/timing/timing.h"

namespace palpate {
namespace {

using studies::processor_seconds;

constexpr double kTolerance = 1e-9;

// Unit forces on dofs spread over the touchable nodes.
std::vector<std::int64_t> loaded_dofs(const ElasticBody& body, const HeldStiffness& held, int count) {
  std::vector<std::int64_t> result;
  for (int i = 0; i < count; ++i) {
    const auto n = body.touchable[static_cast<std::size_t>(i / 3) * 7919 % body.touchable.size()];
    if (!body.fixed[n][i % 3]) result.push_back(3 * static_cast<std::int64_t>(held.row_of_node[n]) + i % 3);
  }
  return result;
}

// KSPCG on AIJ of block size 3, GAMG with the rigid motions, Chebyshev over Jacobi; the true residual at kTolerance.
class OneAtATime {
 public:
  OneAtATime(const HeldStiffness& held, const std::vector<std::array<double, 3>>& coordinates)
      : matrix_(create_petsc_matrix(held.matrix, true)) {
    const double begin = processor_seconds();
    set_rigid_near_nullspace(matrix_, coordinates);
    set_default_petsc_option("-reference_mg_levels_pc_type", PCJACOBI);
    check(KSPCreate(PETSC_COMM_SELF, &ksp_));
    check(KSPSetOptionsPrefix(ksp_, "reference_"));
    check(KSPSetOperators(ksp_, matrix_, matrix_));
    check(KSPSetType(ksp_, KSPCG));
    check(KSPSetNormType(ksp_, KSP_NORM_UNPRECONDITIONED));
    check(KSPSetTolerances(ksp_, 0.5 * kTolerance, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
    PC pc = nullptr;
    check(KSPGetPC(ksp_, &pc));
    check(PCSetType(pc, PCGAMG));
    check(KSPSetFromOptions(ksp_));
    check(KSPSetUp(ksp_));
    check(MatCreateVecs(matrix_, &x_, &b_));
    setup_ = processor_seconds() - begin;
  }
  ~OneAtATime() {
    KSPDestroy(&ksp_);
    MatDestroy(&matrix_);
    VecDestroy(&b_);
    VecDestroy(&x_);
  }
  double setup() const { return setup_; }

  // Solves one column; returns seconds.
  double solve(std::int64_t dof) {
    check(VecSet(b_, 0));
    check(VecSetValue(b_, static_cast<PetscInt>(dof), 1, INSERT_VALUES));
    check(VecAssemblyBegin(b_));
    check(VecAssemblyEnd(b_));
    const double begin = processor_seconds();
    check(KSPSolve(ksp_, b_, x_));
    const double seconds = processor_seconds() - begin;
    PetscInt done = 0;
    check(KSPGetIterationNumber(ksp_, &done));
    iterations = std::max(iterations, static_cast<int>(done));
    return seconds;
  }
  int iterations = 0;

 private:
  Mat matrix_ = nullptr;
  KSP ksp_ = nullptr;
  Vec b_ = nullptr, x_ = nullptr;
  double setup_ = 0;
};

struct Figures {
  double setup = 0, seconds = 0, residual = 0;
  int iterations = 0;
};

// Solves `width` columns together.
Figures measure_batch(const HeldStiffness& held, const std::vector<std::array<double, 3>>& coordinates,
                      const std::vector<std::int64_t>& dofs, int width) {
  ColumnSolverOptions options;
  options.tolerance = kTolerance;
  options.width = width;
  options.cholesky = false;
  Figures figures;
  double begin = processor_seconds();
  ColumnSolver solver(held.matrix, coordinates, options);
  figures.setup = processor_seconds() - begin;
  width = solver.width();
  std::vector<double> b(static_cast<std::size_t>(solver.dofs()) * width, 0.0), x(b.size());
  for (int c = 0; c < width; ++c) b[dofs[static_cast<std::size_t>(c)] * width + c] = 1;
  std::vector<ColumnReport> reports(width);
  begin = processor_seconds();
  solver.solve(b.data(), x.data(), reports);
  figures.seconds = (processor_seconds() - begin) / width;
  for (const auto& report : reports) {
    figures.residual = std::max(figures.residual, report.residual);
    figures.iterations = std::max(figures.iterations, report.iterations);
  }
  if (width == 32) fmt::print("{}\n", solver.description());
  return figures;
}

void run(const std::vector<std::string>& words) {
  const OrganConfig organ = read_organ_config(words[1]);
  const ElasticBody body =
      make_elastic_body(read_mesh(words[0]), organ, read_boundary_config(words[2]), {words[0], words[1], words[2]});
  const Discretisation discretisation = discretise(body, organ.element);
  const HeldStiffness held = remove_held_dofs(discretisation.stiffness, discretisation.fixed);
  const std::vector<std::array<double, 3>> coordinates = row_coordinates(discretisation, held);
  const int columns = words.size() > 3 ? std::stoi(words[3]) : 6;
  std::vector<int> widths;
  for (std::size_t i = 4; i < words.size(); ++i) widths.push_back(std::stoi(words[i]));
  if (widths.empty()) widths = {8, 16, 24, 32, 48};

  OneAtATime reference(held, coordinates);
  const auto dofs = loaded_dofs(body, held, 400);
  fmt::print("{} nodes; one at a time: set-up {:.2f} s\n", body.nodes.size(), reference.setup());
  fmt::print(
      "| width | set-up s | ms per column | one at a time ms | ratio | iterations | one at a time | worst residual "
      "|\n");
  fmt::print("|---|---|---|---|---|---|---|---|\n");
  for (const int width : widths) {
    double seconds = 0;
    for (int c = 0; c < columns; ++c) seconds += reference.solve(dofs[static_cast<std::size_t>(c)]) / columns;
    const Figures figures = measure_batch(held, coordinates, dofs, width);
    fmt::print("| {} | {:.2f} | {:.2f} | {:.1f} | {:.1f} | {} | {} | {:.1e} |\n", width, figures.setup,
               1e3 * figures.seconds, 1e3 * seconds, seconds / figures.seconds, figures.iterations,
               reference.iterations, figures.residual);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  return palpate::bench::petsc_bench(
      argc, argv, 3, "multigrid_bench MESH.msh organ.toml bc.toml [columns [widths...]] [-- PETSc options]",
      palpate::run);
}
