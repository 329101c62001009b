#include "precompute/column_solver.h"

#include <fmt/format.h>
#include <petscksp.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <utility>

#include "precompute/block_multigrid.h"
#include "precompute/block_preconditioner.h"
#include "precompute/petsc_preconditioner.h"
#include "precompute/petsc_session.h"

namespace palpate {
namespace {

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
  std::unique_ptr<BlockPreconditioner> preconditioner;
  Mat shell = nullptr;  // K (x) I
  KSP ksp = nullptr;
  Vec b = nullptr, x = nullptr;
  PetscBool rtol_given = PETSC_FALSE;  // then the user decides how far each run goes; restarts do the rest
  std::exception_ptr thrown;           // by the preconditioner, carried through PETSc
  std::string description;

  explicit State(const BlockMatrix& m) : matrix(m) {}
  ~State() {
    KSPDestroy(&ksp);
    MatDestroy(&shell);
    VecDestroy(&b);
    VecDestroy(&x);
  }

  void create_iteration();
  void run(double relative_tolerance, int* iterations, std::string* reason);

  static PetscErrorCode apply_operator(Mat shell, Vec in, Vec out);
  static PetscErrorCode apply_preconditioner(PC pc, Vec in, Vec out);
};

namespace {

// The user's -column_pc_type before everything; else what was chosen for this mesh and memory.
std::unique_ptr<BlockPreconditioner> make_preconditioner(const BlockMatrix& matrix,
                                                         std::span<const std::array<double, 3>> coordinates,
                                                         const ColumnSolverOptions& options) {
  const std::string type = option_or("-column_pc_type", options.cholesky ? PCCHOLESKY : "multigrid");
  if (type == "multigrid") return std::make_unique<BlockMultigrid>(matrix, coordinates, options.width);
  return make_petsc_preconditioner(matrix, coordinates, options.width, type);
}

}  // namespace

void ColumnSolver::State::create_iteration() {
  const PetscInt size = static_cast<PetscInt>(dofs * options.width);
  check(MatCreateShell(PETSC_COMM_SELF, size, size, size, size, this, &shell));
  check(MatShellSetOperation(shell, MATOP_MULT, reinterpret_cast<void (*)(void)>(apply_operator)));
  check(MatSetOption(shell, MAT_SPD, PETSC_TRUE));
  check(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, size, nullptr, &b));
  check(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, size, nullptr, &x));
  check(KSPCreate(PETSC_COMM_SELF, &ksp));
  check(KSPSetType(ksp, KSPCG));
  check(KSPSetNormType(ksp, KSP_NORM_UNPRECONDITIONED));
  check(KSPSetOperators(ksp, shell, shell));
  PC pc = nullptr;
  check(KSPGetPC(ksp, &pc));
  check(PCSetType(pc, PCSHELL));
  check(PCShellSetContext(pc, this));
  check(PCShellSetApply(pc, apply_preconditioner));
  check(KSPSetTolerances(ksp, PETSC_DEFAULT, 1e-300, PETSC_DEFAULT, PETSC_DEFAULT));  // the right-hand side may be tiny
  check(PetscOptionsHasName(nullptr, nullptr, "-ksp_rtol", &rtol_given));
  check(KSPSetFromOptions(ksp));
  check(KSPSetUp(ksp));
  KSPType type = nullptr;
  check(KSPGetType(ksp, &type));
  PetscInt major = 0, minor = 0, patch = 0;
  check(PetscGetVersionNumber(&major, &minor, &patch, nullptr));
  description = fmt::format("PETSc {}.{}.{} {} + {}", major, minor, patch, type, preconditioner->description());
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

PetscErrorCode ColumnSolver::State::apply_preconditioner(PC pc, Vec in, Vec out) {
  void* context = nullptr;
  const PetscScalar* from = nullptr;
  PetscScalar* to = nullptr;
  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &context));
  auto* state = static_cast<State*>(context);
  PetscCall(VecGetArrayRead(in, &from));
  PetscCall(VecGetArrayWrite(out, &to));
  try {
    state->preconditioner->apply(from, to);
  } catch (...) {  // must not pass through C
    state->thrown = std::current_exception();
  }
  PetscCall(VecRestoreArrayWrite(out, &to));
  PetscCall(VecRestoreArrayRead(in, &from));
  PetscFunctionReturn(state->thrown ? PETSC_ERR_LIB : 0);
}

// One run of the iteration on the arrays placed in b and x.
void ColumnSolver::State::run(double relative_tolerance, int* iterations, std::string* reason) {
  if (!rtol_given) check(KSPSetTolerances(ksp, relative_tolerance, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  const PetscErrorCode code = KSPSolve(ksp, b, x);
  if (thrown) std::rethrow_exception(std::exchange(thrown, nullptr));
  check(code);
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
  while (state_->dofs * state_->options.width > std::numeric_limits<PetscInt>::max() && state_->options.width > 8)
    state_->options.width -= 8;
  state_->norm = infinity_norm(matrix);
  state_->preconditioner = make_preconditioner(matrix, coordinates, state_->options);
  state_->create_iteration();
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
std::span<const std::int32_t> ColumnSolver::row_order() const {
  return state_->preconditioner->row_order();
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
