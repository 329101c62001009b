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
#include "precompute/block_residual.h"
#include "precompute/elimination.h"
#include "precompute/petsc_preconditioner.h"
#include "precompute/petsc_session.h"
#include "precompute/supernodal_factor.h"

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
  bool ksp_given = false;              // the user set the iteration, so it runs from zero

  explicit State(const BlockMatrix& m) : matrix(m) {}
  ~State() {
    KSPDestroy(&ksp);
    MatDestroy(&shell);
    VecDestroy(&b);
    VecDestroy(&x);
  }

  void create_iteration();
  bool start(std::span<const Load> loads, double* start_x);
  void run(const double* right, double* solution, double relative_tolerance, int* iterations, std::string* reason);
  void residual(std::span<const Load> loads, const double* solution, double* r) const;
  std::vector<double> rounding_floors(const double* solution, std::span<const double> load) const;
  bool all_at_floor(std::span<ColumnReport> reports, std::span<const double> floor) const;

  static PetscErrorCode apply_operator(Mat shell, Vec in, Vec out);
  static PetscErrorCode apply_preconditioner(PC pc, Vec in, Vec out);
};

namespace {

// What was chosen for this mesh and memory, unless the user names one of ours or PETSc's, or sets PETSc's.
std::unique_ptr<BlockPreconditioner> make_preconditioner(const BlockMatrix& matrix,
                                                         std::span<const std::array<double, 3>> coordinates,
                                                         const ColumnSolverOptions& options) {
  const char* factor = petsc_option_given("-column_") ? PCCHOLESKY : "supernodal";
  const std::string type = option_or("-column_pc_type", options.cholesky ? factor : "multigrid");
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
}

// The conjugate gradients start from K^-1 b where the preconditioner gives it, and most columns end there: their true
// residual is already rounding. Their vectors are made only when a column needs them or the user sets the iteration.
bool ColumnSolver::State::start(std::span<const Load> loads, double* start_x) {
  return !ksp_given && preconditioner->solve(loads, start_x);
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

// One run of the iteration from zero.
void ColumnSolver::State::run(const double* right, double* solution, double relative_tolerance, int* iterations,
                              std::string* reason) {
  if (!ksp) create_iteration();
  if (!rtol_given) check(KSPSetTolerances(ksp, relative_tolerance, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  check(VecPlaceArray(b, right));
  check(VecPlaceArray(x, solution));
  const PetscErrorCode code = KSPSolve(ksp, b, x);
  check(VecResetArray(b));
  check(VecResetArray(x));
  if (thrown) std::rethrow_exception(std::exchange(thrown, nullptr));
  check(code);
  KSPConvergedReason why = KSP_CONVERGED_ITERATING;
  PetscInt done = 0;
  check(KSPGetConvergedReason(ksp, &why));
  check(KSPGetIterationNumber(ksp, &done));
  *iterations = static_cast<int>(done);
  *reason = KSPConvergedReasons[why];
}

// r = b - K x; b alone where there is no x yet.
void ColumnSolver::State::residual(std::span<const Load> loads, const double* solution, double* r) const {
  const std::int64_t size = dofs * options.width;
  if (solution) {
    multiply(matrix, solution, r, options.width);
    for (std::int64_t i = 0; i < size; ++i) r[i] = -r[i];
  } else {
    std::fill_n(r, size, 0.0);
  }
  for (const auto& load : loads) r[load.dof * options.width + load.column] += load.value;
}

// epsilon ||K|| ||x|| / ||b|| of each column: the relative residual that rounding x alone may leave.
std::vector<double> ColumnSolver::State::rounding_floors(const double* solution, std::span<const double> load) const {
  std::vector<double> floor = column_norms(solution, dofs, options.width);
  for (std::size_t c = 0; c < floor.size(); ++c)
    floor[c] = load[c] > 0 ? std::numeric_limits<double>::epsilon() * norm * floor[c] / load[c] : 0.0;
  return floor;
}

// Whether all columns above the tolerance are at what double precision allows; then their reports say so.
bool ColumnSolver::State::all_at_floor(std::span<ColumnReport> reports, std::span<const double> floor) const {
  for (std::size_t c = 0; c < reports.size(); ++c)
    if (!(reports[c].residual <= std::max(options.tolerance, floor[c]))) return false;
  for (std::size_t c = 0; c < reports.size(); ++c)
    if (reports[c].residual > options.tolerance) reports[c].floor = floor[c];
  return true;
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
  KSPType type = KSPCG;
  if (state_->ksp) check(KSPGetType(state_->ksp, &type));
  PetscInt major = 0, minor = 0, patch = 0;
  check(PetscGetVersionNumber(&major, &minor, &patch, nullptr));
  return fmt::format("PETSc {}.{}.{} {} + {}", major, minor, patch, type, state_->preconditioner->description());
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
  const int width = state_->options.width;
  const std::int64_t dofs = state_->dofs, size = dofs * width;
  const double tolerance = state_->options.tolerance;
  const std::vector<double> load = load_norms(loads, width);
  bool started = state_->start(loads, x);
  for (auto& report : reports) report = {0, started ? 1 : 0};
  std::vector<double> right, step;
  std::string reason = "no iteration";
  double before = std::numeric_limits<double>::infinity();

  for (int run = 0;; ++run, started = true) {
    const std::vector<double> left = started ? residual_norms(state_->matrix, loads, x, width) : load;
    int worst = 0;
    for (int c = 0; c < width; ++c) {
      reports[c].residual = load[c] > 0 ? left[c] / load[c] : 0.0;
      if (!(reports[c].residual <= reports[worst].residual)) worst = c;  // a NaN is the worst
    }
    if (reports[worst].residual <= tolerance) break;
    // A correction that no longer halves the residual has met rounding, where the residual is of its size.
    const bool stalled = started && run > 0 && reports[worst].residual > 0.5 * before;
    before = reports[worst].residual;
    if (stalled || run > state_->options.most_restarts || !std::isfinite(reports[worst].residual)) {
      const std::vector<double> floor = state_->rounding_floors(x, load);
      if (state_->all_at_floor(reports, floor)) break;
      if (!stalled || run > state_->options.most_restarts || !std::isfinite(reports[worst].residual))
        throw NotConverged{worst, reports[worst].residual, floor[worst], reason};
    }
    // K d = r for the columns that need it, each scaled to the same weight.
    right.resize(size);
    state_->residual(loads, started ? x : nullptr, right.data());
    std::vector<double> scale(width);
    for (int c = 0; c < width; ++c) scale[c] = reports[c].residual > tolerance ? left[c] : 0.0;
    for (std::int64_t i = 0; i < dofs; ++i)
      for (int c = 0; c < width; ++c) right[i * width + c] = scale[c] > 0 ? right[i * width + c] / scale[c] : 0.0;
    if (started) step.resize(size);
    double* d = started ? step.data() : x;
    const double share = run == 0 ? 0.5 : 0.1;
    int iterations = 0;
    state_->run(right.data(), d, std::clamp(share * tolerance / reports[worst].residual, 1e-12, 0.1), &iterations,
                &reason);
    for (std::int64_t i = 0; i < dofs; ++i)
      for (int c = 0; c < width; ++c)
        x[i * width + c] = (started ? x[i * width + c] : 0.0) + scale[c] * d[i * width + c];
    for (int c = 0; c < width; ++c)
      if (scale[c] > 0) reports[c].iterations += iterations;
  }
  for (int c = 0; c < width; ++c)
    if (load[c] == 0) reports[c] = {};
}

}  // namespace palpate
