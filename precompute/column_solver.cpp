#include "precompute/column_solver.h"

#include <fmt/format.h>
#include <petscksp.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/errors.h"
#include "precompute/petsc_session.h"

namespace palpate {
namespace {

constexpr const char* kPrefix = "column_";

// [rows][columns] -> [columns][rows], in tiles that stay in cache.
void transpose(const double* from, double* to, std::int64_t rows, std::int64_t columns) {
  constexpr std::int64_t kTile = 16;
  for (std::int64_t r = 0; r < rows; r += kTile)
    for (std::int64_t c = 0; c < columns; c += kTile)
      for (std::int64_t j = c; j < std::min(c + kTile, columns); ++j)
        for (std::int64_t i = r; i < std::min(r + kTile, rows); ++i) to[j * rows + i] = from[i * columns + j];
}

// Norm of each column of [dofs][width].
std::vector<double> column_norms(const double* x, std::int64_t dofs, int width) {
  std::vector<double> sum(width, 0.0);
  for (std::int64_t i = 0; i < dofs; ++i)
    for (int c = 0; c < width; ++c) sum[c] += x[i * width + c] * x[i * width + c];
  for (double& s : sum) s = std::sqrt(s);
  return sum;
}

// Largest row sum of |K|.
double infinity_norm(const BlockMatrix& matrix) {
  double most = 0;
  for (std::int32_t row = 0; row < matrix.rows; ++row)
    for (int i = 0; i < 3; ++i) {
      double sum = 0;
      for (auto at = matrix.first[row]; at < matrix.first[row + 1]; ++at)
        for (int j = 0; j < 3; ++j) sum += std::abs(matrix.block[at][3 * i + j]);
      most = std::max(most, sum);
    }
  return most;
}

std::string option_or(const char* name, const char* otherwise) {
  char text[128] = {};
  PetscBool given = PETSC_FALSE;
  check(PetscOptionsGetString(nullptr, nullptr, name, text, sizeof text, &given));
  return given ? text : otherwise;
}

}  // namespace

struct ColumnSolver::State {
  const BlockMatrix& matrix;
  ColumnSolverOptions options;
  std::int64_t dofs = 0;
  double norm = 0;
  Mat scalar = nullptr;  // K, entry by entry: what PETSc's preconditioners read
  Mat shell = nullptr;   // K (x) I
  PC inner = nullptr;
  KSP ksp = nullptr;
  Vec b = nullptr, x = nullptr;
  Mat dense_in = nullptr, dense_out = nullptr;  // one block, column after column
  PetscBool rtol_given = PETSC_FALSE;           // then the user decides how far each run goes; restarts do the rest
  std::string description;

  explicit State(const BlockMatrix& m) : matrix(m) {}
  ~State() {
    KSPDestroy(&ksp);
    PCDestroy(&inner);
    MatDestroy(&shell);
    MatDestroy(&scalar);
    MatDestroy(&dense_in);
    MatDestroy(&dense_out);
    VecDestroy(&b);
    VecDestroy(&x);
  }

  void create_scalar_matrix(bool blocked);
  void set_near_nullspace(std::span<const std::array<double, 3>> coordinates);
  void create_inner(std::span<const std::array<double, 3>> coordinates);
  void create_outer();
  void run(double relative_tolerance, int* iterations, std::string* reason);

  static PetscErrorCode apply_operator(Mat shell, Vec in, Vec out);
  static PetscErrorCode apply_inner(PC pc, Vec in, Vec out);
};

// CHOLMOD wants block size 1; multigrid wants 3, to aggregate nodes and not dofs.
void ColumnSolver::State::create_scalar_matrix(bool blocked) {
  const auto n = static_cast<PetscInt>(dofs);
  std::vector<PetscInt> first(n + 1, 0), column;
  std::vector<PetscScalar> value;
  column.reserve(matrix.column.size() * 9);
  value.reserve(matrix.column.size() * 9);
  for (std::int32_t row = 0; row < matrix.rows; ++row)
    for (int i = 0; i < 3; ++i) {
      for (auto at = matrix.first[row]; at < matrix.first[row + 1]; ++at)
        for (int j = 0; j < 3; ++j) {
          column.push_back(3 * matrix.column[at] + j);
          value.push_back(matrix.block[at][3 * i + j]);
        }
      first[3 * row + i + 1] = static_cast<PetscInt>(column.size());
    }
  check(MatCreate(PETSC_COMM_SELF, &scalar));
  check(MatSetSizes(scalar, n, n, n, n));
  check(MatSetType(scalar, MATSEQAIJ));
  if (blocked) check(MatSetBlockSize(scalar, 3));
  check(MatSeqAIJSetPreallocationCSR(scalar, first.data(), column.data(), value.data()));
  check(MatSetOption(scalar, MAT_SPD, PETSC_TRUE));
}

void ColumnSolver::State::set_near_nullspace(std::span<const std::array<double, 3>> coordinates) {
  Vec places = nullptr;
  check(VecCreateSeq(PETSC_COMM_SELF, static_cast<PetscInt>(dofs), &places));
  check(VecSetBlockSize(places, 3));
  PetscScalar* values = nullptr;
  check(VecGetArray(places, &values));
  for (std::size_t r = 0; r < coordinates.size(); ++r)
    for (int d = 0; d < 3; ++d) values[3 * r + d] = coordinates[r][d];
  check(VecRestoreArray(places, &values));
  MatNullSpace rigid = nullptr;
  check(MatNullSpaceCreateRigidBody(places, &rigid));
  check(MatSetNearNullSpace(scalar, rigid));
  check(MatNullSpaceDestroy(&rigid));
  check(VecDestroy(&places));
}

void ColumnSolver::State::create_inner(std::span<const std::array<double, 3>> coordinates) {
  const std::string type = option_or("-column_pc_type", options.cholesky ? PCCHOLESKY : PCGAMG);
  const bool direct = type == PCCHOLESKY || type == PCLU;
  create_scalar_matrix(!direct);
  if (!direct) set_near_nullspace(coordinates);
  // Chebyshev over Jacobi: the smoothers that PETSc or users would take otherwise (sor, pbjacobi) have diverged.
  if (type == PCGAMG) set_default_petsc_option("-column_mg_levels_pc_type", PCJACOBI);
  check(PCCreate(PETSC_COMM_SELF, &inner));
  check(PCSetOptionsPrefix(inner, kPrefix));
  check(PCSetOperators(inner, scalar, scalar));
  check(PCSetType(inner, type.c_str()));
  if (type == PCCHOLESKY) check(PCFactorSetMatSolverType(inner, MATSOLVERCHOLMOD));
  check(PCSetFromOptions(inner));
  try {
    check(PCSetUp(inner));
    if (type == PCCHOLESKY) check(PCSetUpOnBlocks(inner));
  } catch (const OperationError& error) {
    throw OperationError(fmt::format(
        "the preconditioner \"{}\" cannot be set up for {} degrees of freedom: {}; if memory ran out, try \"-- "
        "-column_pc_type gamg\"",
        type, dofs, error.what()));
  }
  PCFailedReason failed = PC_NOERROR;
  check(PCGetFailedReason(inner, &failed));
  if (failed != PC_NOERROR)
    throw OperationError(
        fmt::format("the preconditioner \"{}\" failed ({}): the stiffness matrix is not positive definite "
                    "to working precision, or memory ran out",
                    type, PCFailedReasons[failed]));
  MatSolverType package = nullptr;
  if (direct) check(PCFactorGetMatSolverType(inner, &package));
  description = fmt::format("{}{}", type, package ? fmt::format(" ({})", package) : "");
}

void ColumnSolver::State::create_outer() {
  const PetscInt rows = static_cast<PetscInt>(dofs), size = rows * options.width;
  check(MatCreateShell(PETSC_COMM_SELF, size, size, size, size, this, &shell));
  check(MatShellSetOperation(shell, MATOP_MULT, reinterpret_cast<void (*)(void)>(apply_operator)));
  check(MatSetOption(shell, MAT_SPD, PETSC_TRUE));
  check(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, size, nullptr, &b));
  check(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, size, nullptr, &x));
  check(MatCreateSeqDense(PETSC_COMM_SELF, rows, options.width, nullptr, &dense_in));
  check(MatCreateSeqDense(PETSC_COMM_SELF, rows, options.width, nullptr, &dense_out));
  check(KSPCreate(PETSC_COMM_SELF, &ksp));
  check(KSPSetType(ksp, KSPCG));
  check(KSPSetNormType(ksp, KSP_NORM_UNPRECONDITIONED));
  check(KSPSetOperators(ksp, shell, shell));
  PC pc = nullptr;
  check(KSPGetPC(ksp, &pc));
  check(PCSetType(pc, PCSHELL));
  check(PCShellSetContext(pc, this));
  check(PCShellSetApply(pc, apply_inner));
  check(KSPSetTolerances(ksp, PETSC_DEFAULT, 1e-300, PETSC_DEFAULT, PETSC_DEFAULT));  // the right-hand side may be tiny
  check(PetscOptionsHasName(nullptr, nullptr, "-ksp_rtol", &rtol_given));
  check(KSPSetFromOptions(ksp));
  check(KSPSetUp(ksp));
  KSPType type = nullptr;
  check(KSPGetType(ksp, &type));
  PetscInt major = 0, minor = 0, patch = 0;
  check(PetscGetVersionNumber(&major, &minor, &patch, nullptr));
  description = fmt::format("PETSc {}.{}.{} {} + {}", major, minor, patch, type, description);
}

PetscErrorCode ColumnSolver::State::apply_operator(Mat shell, Vec in, Vec out) {
  void* context = nullptr;
  const PetscScalar* from = nullptr;
  PetscScalar* to = nullptr;
  PetscFunctionBegin;
  PetscCall(MatShellGetContext(shell, &context));
  PetscCall(VecGetArrayRead(in, &from));
  PetscCall(VecGetArrayWrite(out, &to));
  const auto* state = static_cast<const State*>(context);
  multiply(state->matrix, from, to, state->options.width);
  PetscCall(VecRestoreArrayWrite(out, &to));
  PetscCall(VecRestoreArrayRead(in, &from));
  PetscFunctionReturn(0);
}

PetscErrorCode ColumnSolver::State::apply_inner(PC pc, Vec in, Vec out) {
  void* context = nullptr;
  const PetscScalar* from = nullptr;
  PetscScalar* to = nullptr;
  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &context));
  auto* state = static_cast<State*>(context);
  PetscCall(VecGetArrayRead(in, &from));
  PetscCall(MatDenseGetArrayWrite(state->dense_in, &to));
  transpose(from, to, state->dofs, state->options.width);
  PetscCall(MatDenseRestoreArrayWrite(state->dense_in, &to));
  PetscCall(VecRestoreArrayRead(in, &from));
  PetscCall(MatAssemblyBegin(state->dense_in, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(state->dense_in, MAT_FINAL_ASSEMBLY));
  PetscCall(PCMatApply(state->inner, state->dense_in, state->dense_out));
  PetscCall(MatDenseGetArrayRead(state->dense_out, &from));
  PetscCall(VecGetArrayWrite(out, &to));
  transpose(from, to, state->options.width, state->dofs);
  PetscCall(VecRestoreArrayWrite(out, &to));
  PetscCall(MatDenseRestoreArrayRead(state->dense_out, &from));
  PetscFunctionReturn(0);
}

// One run of the iteration on the arrays placed in b and x.
void ColumnSolver::State::run(double relative_tolerance, int* iterations, std::string* reason) {
  if (!rtol_given) check(KSPSetTolerances(ksp, relative_tolerance, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  check(KSPSolve(ksp, b, x));
  KSPConvergedReason why = KSP_CONVERGED_ITERATING;
  PetscInt done = 0;
  check(KSPGetConvergedReason(ksp, &why));
  check(KSPGetIterationNumber(ksp, &done));
  *iterations = static_cast<int>(done);
  *reason = KSPConvergedReasons[why];
}

ColumnSolver::ColumnSolver(const BlockMatrix& matrix, std::span<const std::array<double, 3>> coordinates,
                           const ColumnSolverOptions& options)
    : state_(std::make_unique<State>(matrix)) {
  state_->options = options;
  state_->options.width = (std::max(options.width, 1) + 7) / 8 * 8;
  state_->dofs = 3 * static_cast<std::int64_t>(matrix.rows);
  // PETSc counts with 32 bits.
  const auto most = std::numeric_limits<PetscInt>::max();
  if (static_cast<std::int64_t>(matrix.column.size()) > most / 9)
    throw OperationError(
        fmt::format("the stiffness matrix has {} numbers, more than the {} that this PETSc can count; a "
                    "coarser mesh is needed",
                    9 * matrix.column.size(), most));
  while (state_->dofs * state_->options.width > most && state_->options.width > 8) state_->options.width -= 8;
  state_->norm = infinity_norm(matrix);
  state_->create_inner(coordinates);
  state_->create_outer();
}

ColumnSolver::~ColumnSolver() = default;
int ColumnSolver::width() const {
  return state_->options.width;
}
std::int64_t ColumnSolver::dofs() const {
  return state_->dofs;
}
std::string ColumnSolver::description() const {
  return state_->description;
}

void ColumnSolver::solve(const double* b, double* x, std::span<ColumnReport> reports) {
  const int width = state_->options.width;
  const std::int64_t dofs = state_->dofs, size = dofs * width;
  const double tolerance = state_->options.tolerance;
  const std::vector<double> loads = column_norms(b, dofs, width);
  std::vector<double> residual(size), step;
  std::string reason;
  int iterations = 0;
  check(VecPlaceArray(state_->b, b));
  check(VecPlaceArray(state_->x, x));
  state_->run(0.5 * tolerance, &iterations, &reason);
  check(VecResetArray(state_->b));
  check(VecResetArray(state_->x));
  for (auto& report : reports) report = {0, iterations};

  for (int restart = 0;; ++restart) {
    multiply(state_->matrix, x, residual.data(), width);
    for (std::int64_t i = 0; i < size; ++i) residual[i] = b[i] - residual[i];
    const std::vector<double> left = column_norms(residual.data(), dofs, width);
    int worst = 0;
    for (int c = 0; c < width; ++c) {
      reports[c].residual = loads[c] > 0 ? left[c] / loads[c] : 0.0;
      if (!(reports[c].residual <= reports[worst].residual)) worst = c;  // a NaN is the worst
    }
    if (reports[worst].residual <= tolerance) break;
    const double x_norm = column_norms(x, dofs, width)[worst];
    if (restart == state_->options.most_restarts || !std::isfinite(reports[worst].residual))
      throw NotConverged{worst, reports[worst].residual,
                         std::numeric_limits<double>::epsilon() * state_->norm * x_norm / loads[worst], reason};
    // K d = r for the columns that need it, each scaled to the same weight.
    for (int c = 0; c < width; ++c) {
      const double scale = reports[c].residual > tolerance ? 1 / left[c] : 0.0;
      for (std::int64_t i = 0; i < dofs; ++i) residual[i * width + c] *= scale;
    }
    step.resize(size);
    check(VecPlaceArray(state_->b, residual.data()));
    check(VecPlaceArray(state_->x, step.data()));
    state_->run(std::clamp(0.1 * tolerance / reports[worst].residual, 1e-12, 0.1), &iterations, &reason);
    check(VecResetArray(state_->b));
    check(VecResetArray(state_->x));
    for (int c = 0; c < width; ++c) {
      if (!(reports[c].residual > tolerance)) continue;
      reports[c].iterations += iterations;
      for (std::int64_t i = 0; i < dofs; ++i) x[i * width + c] += left[c] * step[i * width + c];
    }
  }
  for (int c = 0; c < width; ++c)
    if (loads[c] == 0) reports[c] = {};
}

}  // namespace palpate
