#include "precompute/solver/column_solver.h"

#include <fmt/format.h>
#include <petscksp.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <utility>

#include "precompute/solver/block_multigrid.h"
#include "precompute/solver/block_preconditioner.h"
#include "precompute/solver/block_residual.h"
#include "precompute/solver/column_runs.h"
#include "precompute/solver/conjugate_gradients.h"
#include "precompute/solver/elimination.h"
#include "precompute/solver/petsc_preconditioner.h"
#include "precompute/solver/petsc_session.h"
#include "precompute/solver/supernodal_factor.h"

namespace palpate {
namespace {

std::vector<double> load_norms(std::span<const Load> loads, int width) {
  std::vector<double> sum(width, 0.0);
  for (const auto& load : loads) sum[load.column] += load.value * load.value;
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

}  // namespace

struct ColumnSolver::State final : ColumnRuns {
  const BlockMatrix& matrix;
  ColumnSolverOptions options;
  std::int64_t dofs = 0;
  double norm = 0;
  std::unique_ptr<BlockPreconditioner> preconditioner;
  Mat shell = nullptr;  // K (x) I
  std::unique_ptr<ConjugateGradients> ksp;
  Vec b = nullptr, x = nullptr;
  std::exception_ptr thrown;    // by the preconditioner, carried through PETSc
  bool ksp_given = false;       // the user set the iteration, so it runs from zero
  std::span<const Load> loads;  // b and x of the block in work
  double* solution = nullptr;
  std::vector<double> right, step;  // made when a column needs a run

  explicit State(const BlockMatrix& m) : matrix(m) {}
  ~State() override {
    ksp.reset();
    MatDestroy(&shell);
    VecDestroy(&b);
    VecDestroy(&x);
  }

  void create_iteration();
  void solve_block(std::span<const Load> loads, double* solution, std::span<ColumnReport> reports);
  std::vector<double> residual_norms() override;
  std::vector<double> solution_norms() override;
  int correct(std::span<const double> scale, double relative_tolerance, std::string* reason) override;
  void scaled_residual(std::span<const double> scale, double* r) const;
  int run(const double* from, double* to, double relative_tolerance, std::string* reason);

  static PetscErrorCode apply_operator(Mat shell, Vec in, Vec out);
  static PetscErrorCode apply_preconditioner(PC pc, Vec in, Vec out);
};

namespace {

// What was chosen for this mesh and memory, unless the user names one of ours or PETSc's, or sets PETSc's.
std::unique_ptr<BlockPreconditioner> make_preconditioner(const BlockMatrix& matrix,
                                                         std::span<const std::array<double, 3>> coordinates,
                                                         const ColumnSolverOptions& options) {
  const char* factor = petsc_option_given("-column_") ? PCCHOLESKY : "supernodal";
  const std::string type = petsc_option_or("-column_pc_type", options.cholesky ? factor : "multigrid");
  if (type == "supernodal")
    return std::make_unique<SupernodalFactor>(
        matrix,
        options.elimination ? options.elimination : std::make_shared<const Elimination>(analyse_elimination(matrix)),
        options.width);
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
  ksp = std::make_unique<ConjugateGradients>(PETSC_COMM_SELF, shell, apply_preconditioner, this);
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

// The conjugate gradients start from K^-1 b where the preconditioner gives it, and most columns end there: their true
// residual is already rounding. Their vectors are made only when a column needs them or the user sets the iteration.
void ColumnSolver::State::solve_block(std::span<const Load> b_of_block, double* x_of_block,
                                      std::span<ColumnReport> reports) {
  loads = b_of_block;
  solution = x_of_block;
  const bool started = !ksp_given && preconditioner->solve(loads, solution);
  if (!started) std::fill_n(solution, dofs * options.width, 0.0);
  for (auto& report : reports) report = {0, started ? 1 : 0};
  run_until_converged(*this, options, norm, load_norms(loads, options.width), reports);
}

std::vector<double> ColumnSolver::State::residual_norms() {
  return palpate::residual_norms(matrix, loads, solution, options.width);
}

std::vector<double> ColumnSolver::State::solution_norms() {
  std::vector<double> sum(options.width, 0.0);
  for (std::int64_t i = 0; i < dofs; ++i)
    for (int c = 0; c < options.width; ++c) sum[c] += solution[i * options.width + c] * solution[i * options.width + c];
  for (double& s : sum) s = std::sqrt(s);
  return sum;
}

int ColumnSolver::State::correct(std::span<const double> scale, double relative_tolerance, std::string* reason) {
  const int width = options.width;
  right.resize(dofs * width);
  step.resize(dofs * width);
  scaled_residual(scale, right.data());
  const int iterations = run(right.data(), step.data(), relative_tolerance, reason);
  for (std::int64_t i = 0; i < dofs; ++i)
    for (int c = 0; c < width; ++c) solution[i * width + c] += scale[c] * step[i * width + c];
  return iterations;
}

// r = (b - K x) / scale, 0 where the scale is.
void ColumnSolver::State::scaled_residual(std::span<const double> scale, double* r) const {
  const int width = options.width;
  multiply(matrix, solution, r, width);
  for (std::int64_t i = 0; i < dofs * width; ++i) r[i] = -r[i];
  for (const auto& load : loads) r[load.dof * width + load.column] += load.value;
  for (std::int64_t i = 0; i < dofs; ++i)
    for (int c = 0; c < width; ++c) r[i * width + c] = scale[c] > 0 ? r[i * width + c] / scale[c] : 0.0;
}

// One run of the iteration from zero.
int ColumnSolver::State::run(const double* from, double* to, double relative_tolerance, std::string* reason) {
  if (!ksp) create_iteration();
  check(VecPlaceArray(b, from));
  check(VecPlaceArray(x, to));
  const PetscErrorCode code = ksp->run(b, x, relative_tolerance);
  check(VecResetArray(b));
  check(VecResetArray(x));
  if (thrown) std::rethrow_exception(std::exchange(thrown, nullptr));
  check(code);
  *reason = ksp->reason();
  return ksp->iterations();
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
  state_->ksp_given = petsc_option_given("-ksp_");
  if (state_->ksp_given) state_->create_iteration();
}

ColumnSolver::~ColumnSolver() = default;
int ColumnSolver::width() const {
  return state_->options.width;
}
std::int64_t ColumnSolver::dofs() const {
  return state_->dofs;
}
std::string ColumnSolver::description() const {
  return fmt::format("{} {} + {}", petsc_version(), state_->ksp ? state_->ksp->type() : KSPCG,
                     state_->preconditioner->description());
}
double ColumnSolver::reciprocal_condition() const {
  return state_->preconditioner->reciprocal_condition();
}
std::span<const std::int32_t> ColumnSolver::row_order() const {
  return state_->preconditioner->row_order();
}

void ColumnSolver::solve(const double* b, double* x, std::span<ColumnReport> reports) {
  std::vector<Load> loads;
  const int width = state_->options.width;
  for (std::int64_t i = 0; i < state_->dofs; ++i)
    for (int c = 0; c < width; ++c)
      if (b[i * width + c] != 0) loads.push_back({i, c, b[i * width + c]});
  solve(loads, x, reports);
}

void ColumnSolver::solve(std::span<const Load> loads, double* x, std::span<ColumnReport> reports) {
  state_->solve_block(loads, x, reports);
}

}  // namespace palpate
