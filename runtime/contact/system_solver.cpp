#include "runtime/contact/system_solver.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// The targets conflict where one more refinement would still change the scaled forces by more than this share.
constexpr double kConflict = 1e-6;

}  // namespace

bool SystemSolver::create(SceneMemory& memory, const RowMatrix* matrix, const Limits& limits) {
  matrix_ = matrix, lasts_ = limits.lasts;
  const auto rows = static_cast<std::size_t>(matrix->capacity);
  for (double** array : {&target_, &reaction_, &last_, &coarse_, &softened_}) *array = memory.array<double>(rows);
  work_ = memory.array<double>(3 * rows);
  doubt_ = memory.array<Doubt>(2 * rows);
  list_ = memory.array<std::int32_t>(rows);
  if (lasts_) {
    memory.keep(gives_way_);
    memory.keep(decided_);
    memory.keep(residual_);
    memory.keep(energy_);
    memory.keep(most_target_);
    memory.keep(effort_);
    for (double** array : {&target_, &reaction_}) memory.keep_array(*array, rows, matrix->rows_end);
  }
  return factor_.create(memory, matrix, limits.operations, limits.lasts) && limit_.create(memory, matrix->capacity) &&
         laws_.create(memory, matrix->capacity, limits.nodes) && !memory.failed();
}

void SystemSolver::forget() {
  factor_.forget();
  gives_way_ = decided_ = 0, energy_ = 0;
}

Vec3 SystemSolver::reaction(std::int32_t p) const {
  while (of_.constraints[p].joined) --p;
  return gather(system(of_), reaction_, p);
}

void SystemSolver::take_rows(const ConstraintRows& of) {
  of_ = of, most_target_ = 0;
  for (std::int32_t row = 0; row < matrix_->rows_end; ++row)
    if (matrix_->scale[row] != 0) most_target_ = std::max(most_target_, std::fabs(target_[row]));
  set_limits();
  if (!lasts_) factor_.shift_rows();
}

void SystemSolver::begin(const ConstraintRows& of) {
  residual_ = {}, effort_ = {}, limited_ = false, decided_ = 0;
  std::copy(reaction_, reaction_ + matrix_->rows_end, last_);
  last_energy_ = lasts_ ? energy_ : INFINITY;
  take_rows(of);
}

// Where there is room for it, and it is likely to serve. False where the system is not definite.
bool SystemSolver::renew_factor(StepWork* work) {
  const Operations cost = squared_rows() * matrix_->rows_end / 6 / kDense;
  if (!lasts_ || factor_.exists() || gives_way_ || cost + least_operations() > work->left()) return true;
  work->add(cost);
  return factor_.renew();
}

// Whether laws act otherwise than by holding: a contact that released, slipped or came to its limit.
bool SystemSolver::contacts_give_way() const {
  const double* const most = limit_.of_laws();
  for (std::int32_t p = 0; p < of_.count; ++p) {
    const ContactConstraint& constraint = of_.constraints[p];
    if (!may_give_way(constraint)) continue;
    if (gives_way(constraint, reaction(p)).any()) return true;
    for (const std::int32_t row : of_.rows[p].at)
      if (row >= 0 && std::fabs(reaction_[row]) >= most[row] * (1 - kAtLimit)) return true;
  }
  return false;
}

// Those that laws let go have a reaction that does not grow with their miss. Returns how many there are.
std::int32_t SystemSolver::find_rows_that_hold(std::int32_t* rows) const {
  std::int32_t count = 0;
  for (std::int32_t p = 0; p < of_.count; ++p) {
    const ContactConstraint& constraint = of_.constraints[p];
    if (constraint.joined) continue;
    const GivesWay gone = gives_way(constraint, reaction(p));
    if (gone.released) continue;
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = of_.rows[p].at[i]; row >= 0 && !(i == 0 ? gone.at_limit : gone.slips))
        rows[count++] = row;
  }
  return count;
}

void SystemSolver::measure_stiffness(const MovedAlike* groups, int count, Operations kept, StepWork* work,
                                     double* stiffness) {
  const int size = 3 * count;
  std::fill(stiffness, stiffness + size * size, 0.0);
  Mat3 unframed;
  for (int i = 0; i < 3; ++i) unframed.m[i][i] = 1;
  const auto axes = [&](std::int32_t p) -> const Mat3& {
    return of_.constraints[p].framed ? of_.constraints[p].frame : unframed;
  };
  const auto each_row = [&](int c, auto visit) { groups[c / 3].for_each_row(of_.rows, c % 3, axes, visit); };
  const bool known = factor_.exists() && !decided_;
  const std::int32_t rows = known ? factor_.used() : find_rows_that_hold(list_);
  const auto row_at = [&](std::int32_t at) { return known ? factor_.row_at(at) : list_[at]; };
  const Operations squared = Operations{rows} * rows,
                   cost = (size * squared + (known ? 0 : squared * rows / 6)) / kDense;
  bool made = cost + kept <= work->left();
  if (made) work->add(cost);
  if (made && !known) made = factor_.hold_rows(list_, rows);
  const auto which =
      known && !(limited_ && factor_.has_soft()) ? ContactFactor::Which::exact : ContactFactor::Which::soft;
  double *const unit = work_, *const solved = work_ + matrix_->capacity;
  for (int c = 0; c < size; ++c) {
    std::fill(unit, unit + matrix_->rows_end, 0.0);
    each_row(c, [&](std::int32_t row, double share, double way) {
      unit[row] = way * share * (made ? 1 : matrix_->scale[row] * matrix_->scale[row]);
    });
    for (std::int32_t at = 0; at < rows && made; ++at) solved[at] = matrix_->scale[row_at(at)] * unit[row_at(at)];
    if (made) factor_.solve_scaled(which, solved);
    for (std::int32_t at = 0; at < rows && made; ++at) unit[row_at(at)] = matrix_->scale[row_at(at)] * solved[at];
    for (int r = 0; r < size; ++r)
      if (made || r == c)
        each_row(r, [&](std::int32_t row, double share, double) { stiffness[r * size + c] += share * unit[row]; });
  }
  if (!known) factor_.leave_soft();
}

SystemSolver::Limiting SystemSolver::limit_forces(NodesOfRows& nodes, Operations kept, StepWork* work) {
  constexpr auto all = ReactionLimit::Rows::all;
  const double most = limit_.exceeded(all, reaction_, [&] { return nodes.farthest(reaction_, kept, work); });
  if (most == 0) return Limiting::within;
  const Operations rows = factor_.used(),
                   cost = (squared_rows() * rows / 6 + ContactFactor::kSoftSolves * squared_rows()) / kDense;
  double* const soft = work_;
  if (cost + kept > work->left()) {
    if (least_operations() <= work->left()) return Limiting::no_room;
    std::fill(soft, soft + matrix_->rows_end, 0.0);
    limit_.go_within(all, most, soft, reaction_);
    return Limiting::limited;
  }
  if (!factor_.solve_soft(target_, soft)) return Limiting::limited;  // not finite: solve() says so
  // Counted alike where the factor is kept, so that a restored state defers the same work.
  work->add(cost);
  limit_.go_within(all, most, soft, reaction_);
  return Limiting::limited;
}

// The same for contacts that do not give way, where laws have decided. A law that is missed only after this conflicts with them.
void SystemSolver::limit_grips(NodesOfRows& nodes, const ContactSystem& laws, StepWork* work) {
  constexpr auto beside = ReactionLimit::Rows::beside_laws;
  const Operations look = operations_to_look(laws);
  const double most = limit_.exceeded(beside, reaction_, [&] { return nodes.farthest(reaction_, look, work); });
  if (most == 0) return;
  for (std::int32_t row = 0; row < matrix_->rows_end; ++row)
    softened_[row] = matrix_->scale[row] != 0 && limit_.covers(beside, row)
                         ? ContactFactor::kSoftShift / (matrix_->scale[row] * matrix_->scale[row])
                         : factor_.soft()[row];
  ContactSystem soft = laws;
  soft.soft = softened_;
  double* const met = work_ + 2 * matrix_->capacity;  // N, the reactions that the limit changes
  std::copy(reaction_, reaction_ + matrix_->rows_end, met);
  const LawEffort before = effort_;
  if (2 * look <= work->left())
    solve_laws(soft, ContactFactor::kSoftSolves, look, work);
  else
    std::fill(reaction_, reaction_ + matrix_->rows_end, 0.0);
  effort_.sweeps += before.sweeps, effort_.newton_steps += before.newton_steps, effort_.operations += before.operations;
  std::swap_ranges(reaction_, reaction_ + matrix_->rows_end, met);
  limit_.go_within(beside, most, met, reaction_);
  std::copy(reaction_, reaction_ + matrix_->rows_end, coarse_);
  Doubt* const exact = doubt_ + of_.count;
  std::copy(doubt_, doubt_ + of_.count, exact);
  measure_laws(laws);
  work->add(look);
  for (std::int32_t p = 0; p < of_.count; ++p) {
    doubt_[p].conflict = doubt_[p].conflict || exact[p].conflict || (doubt_[p].inexact && !exact[p].inexact);
    doubt_[p].inexact = exact[p].inexact;
  }
}

// The residual of the matrix, not of the factor. It also shows that updating leaves rounding alone in the factor, however often
// rows come and go (StabilityContacts.OneOfManyMovesEachTick), so the factor is never recomputed for accuracy.
void SystemSolver::measure_residual() {
  residual_ = {}, energy_ = 0;
  for (std::int32_t at = 0; at < factor_.used(); ++at) {
    const std::int32_t row = factor_.row_at(at);
    const double reached = dot_rows(matrix_->rows_end, matrix_->row(row), reaction_), missed = target_[row] - reached;
    energy_ += reaction_[row] * reached;
    residual_.displacement = std::max(residual_.displacement, std::fabs(missed));
    residual_.force = std::max(residual_.force, std::fabs(missed) * matrix_->scale[row] * matrix_->scale[row]);
  }
}

ContactSystem SystemSolver::system(const ConstraintRows& of) const {
  ContactSystem system;
  system.matrix = matrix_->numbers, system.stride = matrix_->stride, system.rows_end = matrix_->rows_end;
  system.soft = factor_.soft(), system.target = target_, system.most = limit_.of_laws();
  system.constraints = of.constraints, system.rows = of.rows, system.constraint_count = of.count;
  return system;
}

// From the reactions of the last step. kept: operations that come after it.
void SystemSolver::solve_laws(const ContactSystem& laws, int most_solves, Operations kept, StepWork* work) {
  const double most = most_target_;
  std::copy(last_, last_ + matrix_->rows_end, reaction_);
  laws_.solve_without_shift(laws, kSettled * most, kMet * most, most_solves,
                            std::max<Operations>(0, work->left() - kept) * kDense, reaction_, coarse_, last_energy_);
  effort_ = laws_.effort();
  work->add(effort_.operations / kDense);
}

// The residual counts what the laws miss without the shift and the limits. A law that the shifted and limited system of the last
// refinement misses too is not solved; one that it does not miss conflicts.
void SystemSolver::measure_laws(const ContactSystem& laws) {
  const double tolerance = kMet * most_target_ + kLeastMiss;
  double *const ahead = work_, *const shifted = work_ + matrix_->capacity;
  find_ahead(laws, reaction_, ahead);
  energy_ = 0;
  for (std::int32_t row = 0; row < matrix_->rows_end; ++row) {
    if (matrix_->scale[row] == 0) continue;
    shifted[row] = ahead[row] - factor_.soft()[row] * coarse_[row];
    ahead[row] -= factor_.soft()[row] * reaction_[row];
    energy_ += reaction_[row] * (ahead[row] + target_[row]);
  }
  ContactSystem unlimited = laws;
  unlimited.most = nullptr;
  residual_ = law_residual(unlimited, reaction_, ahead);
  const auto is_missed = [&](const ContactSystem& system, std::int32_t p, const double* by) {
    const Vec3 off = missed_by_law(of_.constraints[p], own_compliance(laws, p), gather(laws, reaction_, p),
                                   gather(laws, by, p), most_of(system, p));
    return std::max({std::fabs(off.x), std::fabs(off.y), std::fabs(off.z)}) > tolerance;
  };
  for (std::int32_t p = 0; p < of_.count; ++p) {
    doubt_[p].inexact = is_missed(laws, p, shifted);
    doubt_[p].conflict = !doubt_[p].inexact && is_missed(unlimited, p, ahead);
  }
}

void SystemSolver::take_reactions(const ConstraintRows& of, const LawEffort& effort) {
  take_rows(of);
  effort_ = effort, gives_way_ = decided_ = 1;
  measure_laws(system(of));
}

SystemSolver::Outcome SystemSolver::solve(NodesOfRows& nodes, StepWork* work) {
  if (!renew_factor(work)) return Outcome::unsolved;
  const ContactSystem laws = system(of_);
  // Of the laws, or of a second solution without a soft factor.
  const Operations least = has_laws_ ? least_operations() : 0;
  bool obeys = false;
  Outcome outcome = Outcome::solved;
  Limiting limiting = Limiting::within;
  if (const Operations cost = 3 * squared_rows() / kDense; lasts_ && factor_.exists() && cost + least <= work->left()) {
    work->add(cost);
    outcome = factor_.solve(target_, reaction_) > kConflict ? Outcome::regularised : Outcome::solved;
    obeys = !has_laws_ || obeys_laws(laws, reaction_);
    if (obeys) limiting = limit_forces(nodes, least, work);
    limited_ = limiting == Limiting::limited;
    if (limited_) outcome = Outcome::regularised, obeys = !has_laws_ || obeys_laws(laws, reaction_);
    measure_residual();
  }
  gives_way_ = 0;
  if (!obeys || limiting == Limiting::no_room) {
    decide_by_laws(nodes, obeys && !has_laws_, work);
    outcome = Outcome::solved;
  }
  return outcome;
}

// solved: reaction_ is the solution, and only grips are to be brought within their limit.
void SystemSolver::decide_by_laws(NodesOfRows& nodes, bool solved, StepWork* work) {
  ContactSystem laws = system(of_);
  laws.shared = nodes.share(factor_.used(), least_operations(), work);
  decided_ = 1;
  if (solved) {
    std::fill(doubt_, doubt_ + of_.count, Doubt{});
  } else {
    const Operations look = operations_to_look(laws);
    solve_laws(laws, ContactFactor::kMostSolves, 2 * look, work);
    measure_laws(laws);
    work->add(look);
  }
  limit_grips(nodes, laws, work);
  gives_way_ = contacts_give_way();
}

}  // namespace palpate
