#include "precompute/solver/column_solver.h"

#include <fmt/format.h>
#include <petscksp.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <optional>
#include <utility>

#include "formats/errors.h"
#include "precompute/solver/batch_pc.h"
#include "precompute/solver/column_operator.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {
namespace {

std::vector<double> load_norms(std::span<const Load> loads, int width) {
  std::vector<double> sum(static_cast<std::size_t>(width), 0.0);
  for (const auto& load : loads) sum[load.column] += load.value * load.value;
  for (double& s : sum) s = std::sqrt(s);
  return sum;
}

// The power of two next to each norm; 0 for a norm of zero.
std::vector<int> exponents_of(std::span<const double> norms) {
  std::vector<int> result;
  for (const double norm : norms) result.push_back(norm > 0 && std::isfinite(norm) ? std::ilogb(norm) : 0);
  return result;
}

}  // namespace

struct ColumnSolver::State {
  std::unique_ptr<ColumnOperator> op;
  ColumnSolverOptions options;
  KSP ksp = nullptr;
  PC pc = nullptr;
  Vec b = nullptr, x = nullptr, r = nullptr;
  bool guess_by_preconditioner = false, rtol_given = false;

  // Of the batch that is being solved.
  std::vector<double> load;  // ||b|| of each column
  std::span<ColumnReport> reports;
  std::vector<double> goal;  // the residual norm at which CG stops, of each column
  double goal_norm = 0;      // of the whole batch: above it some column is above its goal
  int restarts = 0;
  double worst_before = 0;
  bool tested = false, certified = false;
  std::optional<NotConverged> failure;

  State(std::unique_ptr<ColumnOperator> o, const ColumnSolverOptions& given) : op(std::move(o)), options(given) {}
  ~State() {
    KSPDestroy(&ksp);
    for (Vec* v : {&b, &x, &r}) VecDestroy(v);
  }

  void set_up();
  void set_up_pc();
  void call(PetscErrorCode code) const;
  BatchPreconditioner& preconditioner() const { return batch_preconditioner_of(pc); }
  void solve_batch(std::span<const Load> loads, double* solution);
  void run_ksp();
  std::vector<double> residuals_of(Vec solution);
  std::vector<double> residuals_in_ksp();
  KSPConvergedReason begin_run(std::span<const double> left);
  KSPConvergedReason during_run(std::span<const double> left) const;
  bool all_at_floor(std::vector<double>& floor);
  std::string reason() const;

  static PetscErrorCode test(KSP ksp, PetscInt iteration, PetscReal norm, KSPConvergedReason* reason, void* context);
};

// Where one of our callbacks has thrown, rethrows its exception, which says more than PETSc's error code.
void ColumnSolver::State::call(PetscErrorCode code) const {
  if (op->thrown) std::rethrow_exception(std::exchange(op->thrown, nullptr));
  check(code);
}

void ColumnSolver::State::set_up() {
  static const bool registered = (register_batch_pcs(), true);
  static_cast<void>(registered);
  const Mat k = op->batch_matrix();
  check(KSPCreate(op->communicator(), &ksp));
  check(KSPSetType(ksp, KSPCG));
  check(KSPSetNormType(ksp, KSP_NORM_UNPRECONDITIONED));
  check(KSPSetOperators(ksp, k, k));
  check(KSPGetPC(ksp, &pc));
  check(PCSetOperators(pc, k, k));
  const char* ours = !options.cholesky ? kPcMultigrid : options.single ? kPcSingle : kPcSupernodal;
  set_batch_pc_type(pc, op->whole() ? ours : options.cholesky ? PCCHOLESKY : PCGAMG);
  b = op->create_vector();
  x = op->create_vector();
  r = op->create_vector();
  set_up_pc();
  options.form.reset();
  op->forget_form();
  check(KSPSetTolerances(ksp, options.tolerance, 1e-300, PETSC_DEFAULT, PETSC_DEFAULT));
  check(KSPSetConvergenceTest(ksp, test, this, nullptr));
  check(KSPSetInitialGuessKnoll(ksp, preconditioner().is_exact() ? PETSC_TRUE : PETSC_FALSE));
  PetscBool given = PETSC_FALSE;
  check(PetscOptionsHasName(nullptr, nullptr, "-ksp_rtol", &given));
  rtol_given = given == PETSC_TRUE;
  call(KSPSetFromOptions(ksp));
  check(KSPGetInitialGuessKnoll(ksp, &given));
  guess_by_preconditioner = given == PETSC_TRUE;
  call(KSPSetUp(ksp));
}

void ColumnSolver::State::set_up_pc() {
  call(PCSetFromOptions(pc));
  if (!is_batch_pc(pc))
    throw InputError("-batch_pc_type: expected no such option; -column_pc_type chooses the preconditioner");
  call(PCSetUp(pc));
}

// Whether the residual of each column that misses the tolerance is as small as double precision allows. If so, the reports of
// these columns get that floor.
bool ColumnSolver::State::all_at_floor(std::vector<double>& floor) {
  floor = op->column_norms(x);
  for (std::size_t c = 0; c < floor.size(); ++c)
    floor[c] = load[c] > 0 ? std::numeric_limits<double>::epsilon() * op->infinity_norm() * floor[c] / load[c] : 0.0;
  for (std::size_t c = 0; c < reports.size(); ++c)
    if (!(reports[c].residual <= std::max(options.tolerance, floor[c]))) return false;
  for (std::size_t c = 0; c < reports.size(); ++c)
    if (reports[c].residual > options.tolerance) reports[c].floor = floor[c];
  return true;
}

// Before the first iteration of a run. left: ||b - K x|| of each column, the true residual. If all columns meet the tolerance,
// they are certified; else left sets the goal of each column for this run.
KSPConvergedReason ColumnSolver::State::begin_run(std::span<const double> left) {
  std::size_t worst = 0;
  for (std::size_t c = 0; c < reports.size(); ++c) {
    reports[c].residual = load[c] > 0 ? left[c] / load[c] : 0.0;
    if (!(reports[c].residual <= reports[worst].residual)) worst = c;  // a NaN is the worst
  }
  const double residual = reports[worst].residual;
  certified = residual <= options.tolerance;
  if (certified) return KSP_CONVERGED_RTOL;
  // A run of CG that has not halved the residual has stalled. Whether rounding is the reason, all_at_floor() tells.
  const bool stalled = residual > 0.5 * worst_before;
  const bool given_up = restarts > options.most_restarts || !std::isfinite(residual);
  worst_before = residual;
  if (stalled || given_up) {
    std::vector<double> floor;
    certified = all_at_floor(floor);
    if (certified) return KSP_CONVERGED_ATOL;
    if (given_up) {
      failure = NotConverged{static_cast<int>(worst), residual, floor[worst], ""};
      return std::isfinite(residual) ? KSP_DIVERGED_ITS : KSP_DIVERGED_NANORINF;
    }
  }
  // Rounding makes the residual that CG updates differ from the true one, so a run aims below the tolerance.
  const double share = restarts == 0 ? 0.5 : 0.1;
  PetscReal rtol = 0;
  check(KSPGetTolerances(ksp, &rtol, nullptr, nullptr, nullptr));
  double squares = 0;
  for (std::size_t c = 0; c < reports.size(); ++c) {
    op->finished[c] = reports[c].residual <= options.tolerance;
    goal[c] = left[c] * (rtol_given ? rtol : std::clamp(share * options.tolerance / residual, 1e-12, 0.1));
    const double end = op->finished[c] ? left[c] : goal[c];  // CG does not change a finished column
    squares += end * end;
  }
  goal_norm = std::sqrt(squares);
  return KSP_CONVERGED_ITERATING;
}

KSPConvergedReason ColumnSolver::State::during_run(std::span<const double> left) const {
  for (std::size_t c = 0; c < left.size(); ++c)
    if (!op->finished[c] && !(left[c] <= goal[c]))
      return std::isfinite(left[c]) ? KSP_CONVERGED_ITERATING : KSP_DIVERGED_NANORINF;
  return KSP_CONVERGED_RTOL;
}

// The column norms of the residual that CG updates.
std::vector<double> ColumnSolver::State::residuals_in_ksp() {
  if (auto known = op->take_residual_norms(); !known.empty()) return known;
  Vec residual = nullptr;
  check(KSPBuildResidual(ksp, nullptr, r, &residual));
  op->take_residual_norms();  // of the x of this iteration, where PETSc has multiplied it for the residual
  return op->column_norms(residual);
}

// ||b - K x|| of each column.
std::vector<double> ColumnSolver::State::residuals_of(Vec solution) {
  call(MatMult(op->batch_matrix(), solution, r));
  if (auto known = op->take_residual_norms(); !known.empty()) return known;
  check(VecAYPX(r, -1.0, b));
  return op->column_norms(r);
}

// norm: of the residual of the whole batch. Its columns are measured only where all of them may have met their goals.
PetscErrorCode ColumnSolver::State::test(KSP, PetscInt iteration, PetscReal norm, KSPConvergedReason* reason,
                                         void* context) {
  auto& state = *static_cast<State*>(context);
  try {
    if (iteration == 0) {
      state.tested = true;
      *reason = state.begin_run(state.residuals_in_ksp());
    } else {
      *reason = norm > state.goal_norm ? KSP_CONVERGED_ITERATING : state.during_run(state.residuals_in_ksp());
    }
  } catch (...) {
    state.op->thrown = std::current_exception();
    return PETSC_ERR_LIB;
  }
  return 0;
}

std::string ColumnSolver::State::reason() const {
  KSPConvergedReason why = KSP_CONVERGED_ITERATING;
  check(KSPGetConvergedReason(ksp, &why));
  return KSPConvergedReasons[why];
}

void ColumnSolver::State::run_ksp() {
  std::string ended = "no iteration";
  for (restarts = 0;; ++restarts) {
    check(KSPSetInitialGuessKnoll(ksp, restarts == 0 && guess_by_preconditioner ? PETSC_TRUE : PETSC_FALSE));
    check(KSPSetInitialGuessNonzero(ksp, restarts > 0 ? PETSC_TRUE : PETSC_FALSE));
    tested = false;
    call(KSPSolve(ksp, b, x));
    if (!tested) begin_run(residuals_of(x));  // the user's -ksp_ options have replaced our convergence test
    PetscInt iterations = 0;
    check(KSPGetIterationNumber(ksp, &iterations));
    for (std::size_t c = 0; c < reports.size(); ++c)
      if (!op->finished[c]) reports[c].iterations += static_cast<int>(iterations);
    if (certified) return;
    if (failure) {
      failure->reason = ended;
      return;
    }
    ended = reason();
  }
}

void ColumnSolver::State::solve_batch(std::span<const Load> loads, double* solution) {
  load = load_norms(loads, op->width());
  // CG uses one step length for the whole batch, so the columns are scaled to norms near 1; a power of two changes no digit.
  // Unit forces have the norm 1 already.
  const std::vector<int> exponent = exponents_of(load);
  const bool scaled = std::any_of(exponent.begin(), exponent.end(), [](int e) { return e != 0; });
  std::vector<Load> unit;
  if (scaled) {
    unit.assign(loads.begin(), loads.end());
    for (Load& l : unit) l.value = std::ldexp(l.value, -exponent[l.column]);
    for (std::size_t c = 0; c < load.size(); ++c) load[c] = std::ldexp(load[c], -exponent[c]);
  }
  op->set_loads(b, scaled ? std::span<const Load>(unit) : loads);
  op->finished.assign(load.size(), 0);
  goal.assign(load.size(), 0.0);
  worst_before = std::numeric_limits<double>::infinity();
  certified = false;
  failure.reset();
  restarts = 0;
  op->begin(x, solution);
  try {
    run_ksp();
  } catch (...) {
    op->end(x, solution);
    throw;
  }
  op->end(x, solution);
  if (failure) throw *failure;
  for (std::size_t c = 0; c < reports.size(); ++c)
    if (load[c] == 0) reports[c] = {};
  if (scaled && op->has_result())
    for (std::int64_t i = 0; i < op->dofs(); ++i)
      for (std::size_t c = 0; c < load.size(); ++c)
        solution[i * op->width() + static_cast<std::int64_t>(c)] =
            std::ldexp(solution[i * op->width() + static_cast<std::int64_t>(c)], exponent[c]);
}

ColumnSolver::ColumnSolver(const BlockMatrix& matrix, std::span<const std::array<double, 3>> coordinates,
                           const ColumnSolverOptions& options)
    : ColumnSolver(whole_operator({matrix,
                                   {coordinates.begin(), coordinates.end()},
                                   options.elimination,
                                   options.node_of_row,
                                   options.form,
                                   options.machine},
                                  options.width),
                   options) {}

ColumnSolver::ColumnSolver(std::unique_ptr<ColumnOperator> op, const ColumnSolverOptions& options)
    : state_(std::make_unique<State>(std::move(op), options)) {
  state_->set_up();
}

ColumnSolver::~ColumnSolver() = default;
int ColumnSolver::width() const {
  return state_->op->width();
}
std::int64_t ColumnSolver::dofs() const {
  return state_->op->dofs();
}
bool ColumnSolver::has_result() const {
  return state_->op->has_result();
}
std::string ColumnSolver::description() const {
  const std::string preconditioner = state_->preconditioner().description();
  int ranks = 1;
  MPI_Comm_size(state_->op->communicator(), &ranks);
  const std::string divided = ranks > 1 ? fmt::format(", operator divided among {} ranks", ranks) : "";
  KSPType type = nullptr;
  check(KSPGetType(state_->ksp, &type));
  return fmt::format("{} {} + {}{}", petsc_version(), type, preconditioner, divided);
}
double ColumnSolver::reciprocal_condition() const {
  return state_->preconditioner().reciprocal_condition();
}
std::span<const std::int32_t> ColumnSolver::row_order() const {
  return state_->preconditioner().row_order();
}

void ColumnSolver::solve(const double* b, double* x, std::span<ColumnReport> reports) {
  std::vector<Load> loads;
  for (std::int64_t i = 0; i < dofs(); ++i)
    for (int c = 0; c < width(); ++c)
      if (b[i * width() + c] != 0) loads.push_back({i, c, b[i * width() + c]});
  solve(loads, x, reports);
}

void ColumnSolver::solve(std::span<const Load> loads, double* x, std::span<ColumnReport> reports) {
  for (auto& report : reports) report = {};
  state_->reports = reports;
  state_->solve_batch(loads, x);
}

}  // namespace palpate
