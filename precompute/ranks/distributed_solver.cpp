#include "precompute/ranks/distributed_solver.h"

#include <fmt/format.h>
#include <petscksp.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/errors.h"
#include "precompute/solver/column_runs.h"
#include "precompute/solver/conjugate_gradients.h"
#include "precompute/solver/petsc_matrix.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {
namespace {

// Of all dofs that are held: their uncoupled rows get the mean of K's diagonal.
double mean_diagonal(MPI_Comm group, const BlockMatrix& own, std::int32_t first_row) {
  double sums[2] = {0, 3.0 * own.rows};
  for (std::int32_t row = 0; row < own.rows; ++row)
    for (auto at = own.first[row]; at < own.first[row + 1]; ++at)
      if (own.column[at] == first_row + row) sums[0] += own.block[at][0] + own.block[at][4] + own.block[at][8];
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, group);
  return sums[0] / sums[1];
}

}  // namespace

struct DistributedSolver::State final : ColumnRuns {
  MPI_Comm group;
  int rank = 0;
  ColumnSolverOptions options;
  std::int64_t dofs = 0, own_dofs = 0, first_dof = 0;
  double norm = 0;                               // largest row sum of |K|
  std::vector<int> gather_counts, gather_begin;  // numbers of x per rank
  Mat matrix = nullptr, block = nullptr;         // K, K (x) I
  PC inner = nullptr;
  Mat dense_in = nullptr, dense_out = nullptr;  // one block, column after column
  std::unique_ptr<ConjugateGradients> ksp;
  Vec b = nullptr, x = nullptr, r = nullptr, d = nullptr;
  std::string description;

  explicit State(MPI_Comm of) : group(of) { MPI_Comm_rank(group, &rank); }
  ~State() override {
    ksp.reset();
    PCDestroy(&inner);
    for (Vec* v : {&b, &x, &r, &d}) VecDestroy(v);
    for (Mat* m : {&block, &matrix, &dense_in, &dense_out}) MatDestroy(m);
  }

  void lay_out(const RowPartition& partition);
  void create_matrix(const BlockMatrix& own, const RowPartition& partition,
                     std::span<const std::array<std::uint8_t, 3>> fixed);
  void create_inner(const RowPartition& partition, std::span<const std::array<double, 3>> nodes);
  void create_iteration();
  void place_loads(std::span<const Load> loads);
  void solve_block(std::span<const Load> loads, std::span<ColumnReport> reports);
  std::vector<double> residual_norms() override;
  std::vector<double> solution_norms() override;
  int correct(std::span<const double> scale, double relative_tolerance, std::string* reason) override;
  std::vector<double> column_norms(Vec v) const;
  void scale_columns(Vec v, std::span<const double> factor) const;
  void gather(double* whole) const;

  static PetscErrorCode apply_inner(PC pc, Vec in, Vec out);
};

void DistributedSolver::State::lay_out(const RowPartition& partition) {
  dofs = 3 * static_cast<std::int64_t>(partition.node_of_row.size());
  own_dofs = 3 * static_cast<std::int64_t>(partition.first_row[rank + 1] - partition.first_row[rank]);
  first_dof = 3 * static_cast<std::int64_t>(partition.first_row[rank]);
  // PETSc and MPI count with 32 bits.
  while (dofs * options.width > std::numeric_limits<PetscInt>::max() && options.width > 8) options.width -= 8;
  for (std::size_t other = 0; other + 1 < partition.first_row.size(); ++other) {
    gather_begin.push_back(3 * options.width * partition.first_row[other]);
    gather_counts.push_back(3 * options.width * (partition.first_row[other + 1] - partition.first_row[other]));
  }
}

void DistributedSolver::State::create_matrix(const BlockMatrix& own, const RowPartition& partition,
                                             std::span<const std::array<std::uint8_t, 3>> fixed) {
  const auto first_row = partition.first_row[rank];
  const double held_diagonal = mean_diagonal(group, own, first_row);
  std::vector<PetscInt> first(static_cast<std::size_t>(own_dofs) + 1, 0), column;
  std::vector<PetscScalar> value;
  column.reserve(own.column.size() * 9);
  value.reserve(own.column.size() * 9);
  for (std::int32_t row = 0; row < own.rows; ++row)
    for (int i = 0; i < 3; ++i) {
      double sum = 0;
      for (auto at = own.first[row]; at < own.first[row + 1]; ++at)
        for (int j = 0; j < 3; ++j) {
          const bool held = fixed[partition.node_of_row[first_row + row]][i] != 0 ||
                            fixed[partition.node_of_row[own.column[at]]][j] != 0;
          const bool diagonal = own.column[at] == first_row + row && i == j;
          column.push_back(3 * own.column[at] + j);
          value.push_back(!held ? own.block[at][3 * i + j] : diagonal ? held_diagonal : 0.0);
          sum += std::abs(value.back());
        }
      norm = std::max(norm, sum);
      first[static_cast<std::size_t>(3 * row + i + 1)] = static_cast<PetscInt>(column.size());
    }
  MPI_Allreduce(MPI_IN_PLACE, &norm, 1, MPI_DOUBLE, MPI_MAX, group);
  check(MatCreate(group, &matrix));
  check(MatSetSizes(matrix, static_cast<PetscInt>(own_dofs), static_cast<PetscInt>(own_dofs), PETSC_DETERMINE,
                    PETSC_DETERMINE));
  check(MatSetBlockSize(matrix, 3));
  check(MatSetType(matrix, MATAIJ));
  check(MatSeqAIJSetPreallocationCSR(matrix, first.data(), column.data(), value.data()));
  check(MatMPIAIJSetPreallocationCSR(matrix, first.data(), column.data(), value.data()));
  check(MatSetOption(matrix, MAT_SPD, PETSC_TRUE));
}

void DistributedSolver::State::create_inner(const RowPartition& partition,
                                            std::span<const std::array<double, 3>> nodes) {
  std::vector<std::array<double, 3>> coordinates;
  for (auto row = partition.first_row[rank]; row < partition.first_row[rank + 1]; ++row)
    coordinates.push_back(nodes[partition.node_of_row[row]]);
  set_rigid_near_nullspace(matrix, coordinates);
  const std::string type = petsc_option_or("-column_pc_type", options.cholesky ? PCCHOLESKY : PCGAMG);
  // Chebyshev over Jacobi: the smoothers that PETSc would take otherwise have diverged.
  if (type == PCGAMG) set_default_petsc_option("-column_mg_levels_pc_type", PCJACOBI);
  check(PCCreate(group, &inner));
  check(PCSetOptionsPrefix(inner, "column_"));
  check(PCSetOperators(inner, matrix, matrix));
  check(PCSetType(inner, type.c_str()));
  const bool factor = type == PCCHOLESKY || type == PCLU;
  if (factor) check(PCFactorSetMatSolverType(inner, MATSOLVERMUMPS));
  check(PCSetFromOptions(inner));
  try {
    check(PCSetUp(inner));
    if (!factor) check(PCSetUpOnBlocks(inner));
  } catch (const OperationError& error) {
    throw OperationError(
        fmt::format("the preconditioner \"{}\" of {} degrees of freedom cannot be set up on this group "
                    "of ranks: {}; if memory ran out, raise --ranks-per-operator or use more machines",
                    type, dofs, error.what()));
  }
  PCFailedReason failed = PC_NOERROR;
  check(PCGetFailedReason(inner, &failed));
  if (failed != PC_NOERROR)
    throw OperationError(
        fmt::format("the preconditioner \"{}\" failed ({}): the stiffness matrix is not positive definite "
                    "to working precision, or memory ran out; with more memory, or a larger "
                    "--ranks-per-operator, it may hold",
                    type, PCFailedReasons[failed]));
  MatSolverType package = nullptr;
  if (factor) check(PCFactorGetMatSolverType(inner, &package));
  description = fmt::format("{}{}", type, package ? fmt::format(" ({})", package) : "");
  const auto local = static_cast<PetscInt>(own_dofs);
  check(MatCreateDense(group, local, PETSC_DECIDE, PETSC_DETERMINE, options.width, nullptr, &dense_in));
  check(MatCreateDense(group, local, PETSC_DECIDE, PETSC_DETERMINE, options.width, nullptr, &dense_out));
}

void DistributedSolver::State::create_iteration() {
  check(MatCreateMAIJ(matrix, options.width, &block));
  check(MatCreateVecs(block, &x, &b));
  check(VecDuplicate(b, &r));
  check(VecDuplicate(b, &d));
  ksp = std::make_unique<ConjugateGradients>(group, block, apply_inner, this);
  description = fmt::format("{} {} + {}, operator divided among {} ranks", petsc_version(), ksp->type(), description,
                            gather_counts.size());
}

// Entries of [own dofs][width] to the local columns of a dense matrix, the inner preconditioner, and back.
PetscErrorCode DistributedSolver::State::apply_inner(PC pc, Vec in, Vec out) {
  void* context = nullptr;
  const PetscScalar* from = nullptr;
  PetscScalar* to = nullptr;
  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &context));
  auto* state = static_cast<State*>(context);
  PetscCall(VecGetArrayRead(in, &from));
  PetscCall(MatDenseGetArrayWrite(state->dense_in, &to));
  transpose(from, to, state->own_dofs, state->options.width);
  PetscCall(MatDenseRestoreArrayWrite(state->dense_in, &to));
  PetscCall(VecRestoreArrayRead(in, &from));
  PetscCall(MatAssemblyBegin(state->dense_in, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(state->dense_in, MAT_FINAL_ASSEMBLY));
  PetscCall(PCMatApply(state->inner, state->dense_in, state->dense_out));
  PetscCall(MatDenseGetArrayRead(state->dense_out, &from));
  PetscCall(VecGetArrayWrite(out, &to));
  transpose(from, to, state->options.width, state->own_dofs);
  PetscCall(VecRestoreArrayWrite(out, &to));
  PetscCall(MatDenseRestoreArrayRead(state->dense_out, &from));
  PetscFunctionReturn(0);
}

void DistributedSolver::State::place_loads(std::span<const Load> loads) {
  PetscScalar* values = nullptr;
  check(VecGetArrayWrite(b, &values));
  std::fill_n(values, own_dofs * options.width, 0.0);
  for (const Load& load : loads)
    if (load.dof >= first_dof && load.dof < first_dof + own_dofs)
      values[(load.dof - first_dof) * options.width + load.column] += load.value;
  check(VecRestoreArrayWrite(b, &values));
}

void DistributedSolver::State::solve_block(std::span<const Load> loads, std::span<ColumnReport> reports) {
  place_loads(loads);
  check(VecSet(x, 0.0));
  for (auto& report : reports) report = {};
  run_until_converged(*this, options, norm, column_norms(b), reports);
}

std::vector<double> DistributedSolver::State::residual_norms() {
  check(MatMult(block, x, r));
  check(VecAYPX(r, -1.0, b));
  return column_norms(r);
}

std::vector<double> DistributedSolver::State::solution_norms() {
  return column_norms(x);
}

// From the residual that residual_norms() has left in r.
int DistributedSolver::State::correct(std::span<const double> scale, double relative_tolerance, std::string* reason) {
  std::vector<double> down(scale.begin(), scale.end());
  for (double& s : down) s = s > 0 ? 1 / s : 0.0;
  scale_columns(r, down);
  check(ksp->run(r, d, relative_tolerance));
  scale_columns(d, scale);
  check(VecAXPY(x, 1.0, d));
  *reason = ksp->reason();
  return ksp->iterations();
}

std::vector<double> DistributedSolver::State::column_norms(Vec v) const {
  std::vector<double> sum(options.width, 0.0);
  const PetscScalar* values = nullptr;
  check(VecGetArrayRead(v, &values));
  for (std::int64_t i = 0; i < own_dofs; ++i)
    for (int c = 0; c < options.width; ++c) sum[c] += values[i * options.width + c] * values[i * options.width + c];
  check(VecRestoreArrayRead(v, &values));
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), options.width, MPI_DOUBLE, MPI_SUM, group);
  for (double& s : sum) s = std::sqrt(s);
  return sum;
}

void DistributedSolver::State::scale_columns(Vec v, std::span<const double> factor) const {
  PetscScalar* values = nullptr;
  check(VecGetArray(v, &values));
  for (std::int64_t i = 0; i < own_dofs; ++i)
    for (int c = 0; c < options.width; ++c) values[i * options.width + c] *= factor[c];
  check(VecRestoreArray(v, &values));
}

void DistributedSolver::State::gather(double* whole) const {
  const PetscScalar* values = nullptr;
  check(VecGetArrayRead(x, &values));
  MPI_Gatherv(values, gather_counts[rank], MPI_DOUBLE, whole, gather_counts.data(), gather_begin.data(), MPI_DOUBLE, 0,
              group);
  check(VecRestoreArrayRead(x, &values));
}

DistributedSolver::DistributedSolver(MPI_Comm group, BlockMatrix own, const RowPartition& partition,
                                     std::span<const std::array<double, 3>> nodes,
                                     std::span<const std::array<std::uint8_t, 3>> fixed,
                                     const ColumnSolverOptions& options)
    : state_(std::make_unique<State>(group)) {
  state_->options = options;
  state_->options.width = std::max(options.width, 1);
  state_->lay_out(partition);
  state_->create_matrix(own, partition, fixed);
  own = {};
  state_->create_inner(partition, nodes);
  state_->create_iteration();
}

DistributedSolver::~DistributedSolver() = default;
int DistributedSolver::width() const {
  return state_->options.width;
}
std::int64_t DistributedSolver::dofs() const {
  return state_->dofs;
}
bool DistributedSolver::has_result() const {
  return state_->rank == 0;
}
std::string DistributedSolver::description() const {
  return state_->description;
}

void DistributedSolver::solve(std::span<const Load> loads, double* x, std::span<ColumnReport> reports) {
  state_->solve_block(loads, reports);
  state_->gather(x);
}

}  // namespace palpate
