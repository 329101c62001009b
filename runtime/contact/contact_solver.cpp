#include "runtime/contact/contact_solver.h"

#include <algorithm>
#include <cmath>

#include "runtime/dense/dense_rows.h"

namespace palpate {
namespace {

// The targets conflict where one more refinement would still change the scaled forces by more than this share.
constexpr double kConflict = 1e-6;
// LawSolver ends where it misses the laws by this share of the largest target. Its solution is refined where refining would
// move it by more.
constexpr double kSettled = 1e-10;

bool joins(const ContactConstraints& set) {
  return std::any_of(set.constraints, set.constraints + set.constraint_count,
                     [](const ContactConstraint& constraint) { return constraint.joined; });
}

}  // namespace

bool ContactSolver::create(SceneMemory& memory, const Limits& limits) {
  if (!matrix_.create(memory, limits.of) || !factor_.create(memory, &matrix_, limits.operations) ||
      !limit_.create(memory, matrix_.capacity()))
    return false;
  if (limits.of.predicts && !prediction_.create(memory, &matrix_, &factor_, &laws_)) return false;
  const auto rows = static_cast<std::size_t>(matrix_.capacity());
  for (double** array : {&target_, &reaction_, &last_, &coarse_, &softened_}) *array = memory.array<double>(rows);
  work_ = memory.array<double>(3 * rows);
  doubt_ = memory.array<Doubt>(2 * rows / 3);
  list_ = memory.array<std::int32_t>(rows);
  memory.keep(gives_way_);
  memory.keep(decided_);
  memory.keep(residual_);
  memory.keep(energy_);
  memory.keep(most_target_);
  memory.keep(effort_);
  for (double** array : {&target_, &reaction_}) memory.keep_array(*array, rows, matrix_.rows_end());
  return laws_.create(memory, matrix_.capacity(), limits.of.nodes) && shared_.create(memory, limits.of.nodes) &&
         !memory.failed();
}

void ContactSolver::restored(const Tensors& tensors) {
  matrix_.restored(tensors);
  set_limits(matrix_.held().constraints, matrix_.held().count);
}

void ContactSolver::forget() {
  matrix_.forget();
  factor_.forget();
  prediction_.forget();
  gives_way_ = decided_ = 0, energy_ = 0;
}

// ---- what changes ----------------------------------------------------------------------------------------------------

// The compliance between a contact's nodes and all others takes 9 multiply-adds for each pair.
Operations ContactSolver::entries_of(const Changes& changes) const {
  const std::int32_t nodes = matrix_.held().node_count + changes.nodes,
                     constraints = matrix_.held().count + changes.constraints,
                     nodes_of_each = constraints > 0 ? 1 + nodes / constraints : 1;
  const std::int32_t discs = matrix_.held().discs + changes.discs;
  return changes.contacts * (9 * nodes_of_each * nodes / kDense + (discs > 1 ? kOfTwoDiscs * (discs - 1) : 0));
}

Operations ContactSolver::operations_to_renew(const Changes& changes) const {
  if (changes.contacts == 0) return 0;  // in most steps no contact changes
  const Operations rows = matrix_.rows_end() + changes.rows;
  const bool keeps_factor = !gives_way_ && factor_.exists() && factor_.affords(rows);
  return (keeps_factor ? ContactFactor::upkeep_of(rows, changes.contacts - changes.begun, changes.contacts) : 0) +
         entries_of(changes);
}

bool ContactSolver::update(const Tensors& tensors, const ContactConstraints& set, StepWork* work) {
  if (!matrix_.match(tensors, set, reaction_, again_)) return false;
  if (matrix_.changed_contacts() > 0) make_room_for_changes(work);
  matrix_.drop_leaving(reaction_);
  if (matrix_.leaving_count() > 0) factor_.drop_rows();
  if (!matrix_.add_coming(set, reaction_)) return false;
  if (matrix_.leaving_count() > 0 || matrix_.coming_count() > 0) factor_.leave_soft();
  if (!factor_.append(matrix_.coming(), matrix_.coming_count())) return false;
  matrix_.keep(set);
  prediction_.forget();
  return true;
}

// Contacts that go without notice, as with a tool that is not sent any more, are not counted yet.
void ContactSolver::make_room_for_changes(StepWork* work) {
  const Operations paid = work->paid_changes(), unpaid = matrix_.changed_contacts() - paid;
  if (factor_.exists() && !gives_way_ &&
      factor_.affords(factor_.used() - matrix_.leaving_count() + matrix_.joining_rows())) {
    const Operations cost = unpaid > 0 ? ContactFactor::upkeep_of(matrix_.rows_end(), unpaid, 0) : 0;
    if (cost <= work->first_change_left(0)) return work->add(cost);
  }
  factor_.leave();
}

// Where there is room for it, and it is likely to serve. False where the system is not definite.
bool ContactSolver::renew_factor(StepWork* work) {
  const Operations rows = matrix_.rows_end(), cost = squared_rows() * rows / 6 / kDense;
  if (factor_.exists() || gives_way_ || cost + operations_to_solve_for(rows, matrix_.held().count) > work->left())
    return true;
  work->add(cost);
  return factor_.renew();
}

// Whether laws act otherwise than by holding: a contact that released, slipped or came to its limit.
bool ContactSolver::contacts_give_way(const ContactSystem& laws) const {
  const double* const most = limit_.of_laws();
  for (std::int32_t p = 0; p < laws.constraint_count; ++p) {
    const ContactConstraint& constraint = laws.constraints[p];
    if (!may_give_way(constraint)) continue;
    if (gives_way(constraint, reaction(p)).any()) return true;
    for (const std::int32_t row : matrix_.rows_of(p).at)
      if (row >= 0 && std::fabs(reaction_[row]) >= most[row] * (1 - kAtLimit)) return true;
  }
  return false;
}

// ---- solving ---------------------------------------------------------------------------------------------------------

void ContactSolver::take_targets(const ContactConstraints& set) {
  most_target_ = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const Vec3 target = target_of_rows(set, p);
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = matrix_.rows_of(p).at[i]; row >= 0) {
        target_[row] = target[i];
        most_target_ = std::max(most_target_, std::fabs(target_[row]));
      }
  }
}

// The forces and the displacements of the nodes under the reactions. False where a number is not finite.
bool ContactSolver::write_forces(const ContactConstraints& set, Vec3* force, Vec3* modified) const {
  std::fill(force, force + set.node_count, Vec3{});
  spread_reactions(set.constraints, matrix_.rows(), set.constraint_count, set.nodes, reaction_, force);
  bool finite = std::isfinite(residual_.displacement) && std::isfinite(residual_.force);
  const NodeCompliance& compliance = matrix_.compliance();
  for (std::int32_t e = 0; e < set.node_count; ++e) {
    modified[e] = compliance.modified(compliance.slot_of_contact_node(e), force[e]);
    finite = finite && is_finite(force[e]) && is_finite(modified[e]);
  }
  return finite;
}

// Without contact forces; the next step begins anew.
ContactSolver::Outcome ContactSolver::fail(const ContactConstraints& set, Vec3* force, Vec3* modified) {
  forget();
  for (std::int32_t e = 0; e < set.node_count; ++e) force[e] = modified[e] = Vec3{};
  residual_ = {}, effort_ = {};
  return Outcome::unsolved;
}

// Those that laws let go have a reaction that does not grow with their miss. Returns how many there are.
std::int32_t ContactSolver::find_rows_that_hold(const ContactConstraints& set, std::int32_t* rows) const {
  std::int32_t count = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    if (constraint.joined) continue;
    const GivesWay gone = gives_way(constraint, reaction(p));
    if (gone.released) continue;
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = matrix_.rows_of(p).at[i]; row >= 0 && !(i == 0 ? gone.at_limit : gone.slips))
        rows[count++] = row;
  }
  return count;
}

void ContactSolver::measure_stiffness(const ContactConstraints& set, const MovedAlike* groups, int count,
                                      Operations kept, StepWork* work, double* stiffness) {
  const int size = 3 * count;
  std::fill(stiffness, stiffness + size * size, 0.0);
  const auto each_row = [&](int c, auto visit) {
    for (const std::int32_t p : groups[c / 3].constraint)
      if (p >= 0 && matrix_.rows_of(p).at[c % 3] >= 0) visit(matrix_.rows_of(p).at[c % 3]);
  };
  const bool known = factor_.exists() && !decided_;
  const std::int32_t rows = known ? factor_.used() : find_rows_that_hold(set, list_);
  const auto row_at = [&](std::int32_t at) { return known ? factor_.row_at(at) : list_[at]; };
  const Operations squared = Operations{rows} * rows,
                   cost = (size * squared + (known ? 0 : squared * rows / 6)) / kDense;
  bool made = cost + kept <= work->left();
  if (made) work->add(cost);
  if (made && !known) made = factor_.hold_rows(list_, rows);
  const auto which =
      known && !(limited_ && factor_.has_soft()) ? ContactFactor::Which::exact : ContactFactor::Which::soft;
  double *const unit = work_, *const solved = work_ + matrix_.capacity();
  for (int c = 0; c < size; ++c) {
    std::fill(unit, unit + matrix_.rows_end(), 0.0);
    each_row(c, [&](std::int32_t row) { unit[row] = made ? 1 : matrix_.scale(row) * matrix_.scale(row); });
    for (std::int32_t at = 0; at < rows && made; ++at) solved[at] = matrix_.scale(row_at(at)) * unit[row_at(at)];
    if (made) factor_.solve_scaled(which, solved);
    for (std::int32_t at = 0; at < rows && made; ++at) unit[row_at(at)] = matrix_.scale(row_at(at)) * solved[at];
    for (int r = 0; r < size; ++r)
      if (made || r == c) each_row(r, [&](std::int32_t row) { stiffness[r * size + c] += unit[row]; });
  }
  if (!known) factor_.leave_soft();
}

void ContactSolver::set_limits(const ContactConstraint* constraints, std::int32_t count) {
  limit_.set(matrix_.scales(), matrix_.rows_end(), constraints, matrix_.rows(), count, most_target_);
}

// m, how far the reactions move a contact node at most; below 0: there is no room to tell. kept: operations that come after it.
double ContactSolver::thrown(const ContactConstraints& set, Operations kept, Vec3* force, StepWork* work) const {
  const Operations cost = 9 * Operations{set.node_count} * set.node_count / kDense;
  if (cost + kept > work->left()) return -1;
  work->add(cost);
  return largest_displacement(set, force);
}

ContactSolver::Limiting ContactSolver::limit_forces(const ContactConstraints& set, Operations kept, Vec3* force,
                                                    StepWork* work) {
  constexpr auto all = ReactionLimit::Rows::all;
  const double most = limit_.exceeded(all, reaction_, [&] { return thrown(set, kept, force, work); });
  if (most == 0) return Limiting::within;
  const Operations rows = factor_.used(),
                   cost = (squared_rows() * rows / 6 + ContactFactor::kSoftSolves * squared_rows()) / kDense;
  double* const soft = work_;
  if (cost + kept > work->left()) {
    if (operations_to_solve_for(matrix_.rows_end(), set.constraint_count) <= work->left()) return Limiting::no_room;
    std::fill(soft, soft + matrix_.rows_end(), 0.0);
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
void ContactSolver::limit_grips(const ContactSystem& laws, const ContactConstraints& set, Vec3* force, StepWork* work) {
  constexpr auto beside = ReactionLimit::Rows::beside_laws;
  const Operations look = operations_to_look(laws);
  const double most = limit_.exceeded(beside, reaction_, [&] { return thrown(set, look, force, work); });
  if (most == 0) return;
  for (std::int32_t row = 0; row < matrix_.rows_end(); ++row)
    softened_[row] = matrix_.scale(row) != 0 && limit_.covers(beside, row)
                         ? ContactFactor::kSoftShift / (matrix_.scale(row) * matrix_.scale(row))
                         : factor_.soft()[row];
  ContactSystem soft = laws;
  soft.soft = softened_;
  double* const met = work_ + 2 * matrix_.capacity();  // N, the reactions that the limit changes
  std::copy(reaction_, reaction_ + matrix_.rows_end(), met);
  const LawEffort before = effort_;
  if (2 * look <= work->left())
    solve_laws(soft, ContactFactor::kSoftSolves, look, work);
  else
    std::fill(reaction_, reaction_ + matrix_.rows_end(), 0.0);
  effort_.sweeps += before.sweeps, effort_.newton_steps += before.newton_steps, effort_.operations += before.operations;
  std::swap_ranges(reaction_, reaction_ + matrix_.rows_end(), met);
  limit_.go_within(beside, most, met, reaction_);
  std::copy(reaction_, reaction_ + matrix_.rows_end(), coarse_);
  Doubt* const exact = doubt_ + laws.constraint_count;
  std::copy(doubt_, doubt_ + laws.constraint_count, exact);
  measure_laws(laws);
  work->add(look);
  for (std::int32_t p = 0; p < laws.constraint_count; ++p) {
    doubt_[p].conflict = doubt_[p].conflict || exact[p].conflict || (doubt_[p].inexact && !exact[p].inexact);
    doubt_[p].inexact = exact[p].inexact;
  }
}

// The residual of the matrix, not of the factor. It also shows that updating leaves rounding alone in the factor, however often
// rows come and go (StabilityContacts.OneOfManyMovesEachTick), so the factor is never recomputed for accuracy.
void ContactSolver::measure_residual() {
  residual_ = {}, energy_ = 0;
  for (std::int32_t at = 0; at < factor_.used(); ++at) {
    const std::int32_t row = factor_.row_at(at);
    const double reached = dot_rows(matrix_.rows_end(), matrix_.row(row), reaction_), missed = target_[row] - reached;
    energy_ += reaction_[row] * reached;
    residual_.displacement = std::max(residual_.displacement, std::fabs(missed));
    residual_.force = std::max(residual_.force, std::fabs(missed) * matrix_.scale(row) * matrix_.scale(row));
  }
}

double ContactSolver::change_norm(const ContactConstraints& set) const {
  if (again_ || set.constraint_count != last_constraints_) return -1;
  double* const change = work_;
  std::fill(change, change + matrix_.rows_end(), 0.0);
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    if (!matrix_.is_kept(p)) return -1;
    for (const std::int32_t i : matrix_.rows_of(p).at)
      if (i >= 0) change[i] = reaction_[i] - last_[i];
  }
  return energy_norm(matrix_, change);
}

ContactSystem ContactSolver::system(const ContactConstraint* constraints, std::int32_t count) const {
  ContactSystem system;
  system.matrix = matrix_.numbers(), system.stride = matrix_.stride(), system.rows_end = matrix_.rows_end();
  system.soft = factor_.soft(), system.target = target_, system.most = limit_.of_laws();
  system.constraints = constraints, system.rows = matrix_.rows(), system.constraint_count = count;
  return system;
}

ContactPrediction::Solution ContactSolver::solution() const {
  return {system_held(), reaction_, kSettled * most_target_, decided_ != 0};
}

Operations ContactSolver::operations_to_look(const ContactSystem& laws) {
  return LawSolver::operations_to_look(laws) / kDense + 1;
}

// From the reactions of the last step. kept: operations that come after it.
void ContactSolver::solve_laws(const ContactSystem& laws, int most_solves, Operations kept, StepWork* work) {
  const double most = most_target_;
  std::copy(last_, last_ + matrix_.rows_end(), reaction_);
  laws_.solve_without_shift(laws, kSettled * most, kMet * most, most_solves,
                            std::max<Operations>(0, work->left() - kept) * kDense, reaction_, coarse_, last_energy_);
  effort_ = laws_.effort();
  work->add(effort_.operations / kDense);
}

// The residual counts what the laws miss without the shift and the limits. A law that the shifted and limited system of the last
// refinement misses too is not solved; one that it does not miss conflicts.
void ContactSolver::measure_laws(const ContactSystem& laws) {
  const double tolerance = kMet * most_target_ + kLeastMiss;
  double *const ahead = work_, *const shifted = work_ + matrix_.capacity();
  find_ahead(laws, reaction_, ahead);
  energy_ = 0;
  for (std::int32_t row = 0; row < matrix_.rows_end(); ++row) {
    if (matrix_.scale(row) == 0) continue;
    shifted[row] = ahead[row] - factor_.soft()[row] * coarse_[row];
    ahead[row] -= factor_.soft()[row] * reaction_[row];
    energy_ += reaction_[row] * (ahead[row] + target_[row]);
  }
  ContactSystem unlimited = laws;
  unlimited.most = nullptr;
  residual_ = law_residual(unlimited, reaction_, ahead);
  const auto is_missed = [&](const ContactSystem& system, std::int32_t p, const double* by) {
    const Vec3 off = missed_by_law(laws.constraints[p], own_compliance(laws, p), gather(laws, reaction_, p),
                                   gather(laws, by, p), most_of(system, p));
    return std::max({std::fabs(off.x), std::fabs(off.y), std::fabs(off.z)}) > tolerance;
  };
  for (std::int32_t p = 0; p < laws.constraint_count; ++p) {
    doubt_[p].inexact = is_missed(laws, p, shifted);
    doubt_[p].conflict = !doubt_[p].inexact && is_missed(unlimited, p, ahead);
  }
}

bool ContactSolver::prepare(const Tensors& tensors, const ContactConstraints& set, StepWork* work) {
  again_ = false, last_constraints_ = matrix_.held().count;
  residual_ = {}, effort_ = {}, shares_ = false, decided_ = 0;
  if (!update(tensors, set, work)) {
    forget();
    return false;
  }
  std::copy(reaction_, reaction_ + matrix_.rows_end(), last_);
  last_energy_ = energy_;
  return true;
}

ContactSolver::Outcome ContactSolver::take_reactions(const ContactConstraints& set, const LawEffort& effort,
                                                     Vec3* force, Vec3* modified) {
  take_targets(set);
  set_limits(set.constraints, set.constraint_count);
  effort_ = effort, gives_way_ = decided_ = 1;
  measure_laws(system(set.constraints, set.constraint_count));
  return write_forces(set, force, modified) ? Outcome::solved : fail(set, force, modified);
}

ContactSolver::Outcome ContactSolver::solve(const Tensors& tensors, const ContactConstraints& set, Vec3* force,
                                            Vec3* modified, StepWork* work, bool again) {
  again_ = again, last_constraints_ = matrix_.held().count;
  for (std::int32_t e = 0; e < set.node_count; ++e) force[e] = modified[e] = Vec3{};
  residual_ = {}, effort_ = {}, shares_ = limited_ = false, decided_ = 0;
  if (!update(tensors, set, work)) return fail(set, force, modified);
  take_targets(set);
  std::copy(reaction_, reaction_ + matrix_.rows_end(), last_);
  last_energy_ = energy_;
  set_limits(set.constraints, set.constraint_count);
  if (!renew_factor(work)) return fail(set, force, modified);
  const ContactSystem laws = system(set.constraints, set.constraint_count);
  const bool have_laws = std::any_of(set.constraints, set.constraints + set.constraint_count, may_give_way);
  // Of the laws, or of a second solution without a soft factor.
  const Operations least = operations_to_solve_for(matrix_.rows_end(), set.constraint_count);
  bool obeys = false;
  Outcome outcome = Outcome::solved;
  Limiting limiting = Limiting::within;
  if (const Operations cost = 3 * squared_rows() / kDense;
      factor_.exists() && cost + (have_laws ? least : 0) <= work->left()) {
    work->add(cost);
    outcome = factor_.solve(target_, reaction_) > kConflict ? Outcome::regularised : Outcome::solved;
    obeys = obeys_laws(laws, reaction_);
    if (obeys) limiting = limit_forces(set, have_laws ? least : 0, force, work);
    limited_ = limiting == Limiting::limited;
    if (limited_) outcome = Outcome::regularised, obeys = obeys_laws(laws, reaction_);
    measure_residual();
  }
  gives_way_ = 0;
  if (!obeys || limiting == Limiting::no_room) {
    decide_by_laws(laws, set, obeys && !have_laws, force, work);
    outcome = Outcome::solved;
  }
  return write_forces(set, force, modified) ? outcome : fail(set, force, modified);
}

// solved: reaction_ is the solution, and only grips are to be brought within their limit.
void ContactSolver::decide_by_laws(const ContactSystem& laws, const ContactConstraints& set, bool solved, Vec3* force,
                                   StepWork* work) {
  ContactSystem through = laws;
  constexpr Operations most_shared = SharedNodes::kMostNodes;
  const Operations nodes = std::min<Operations>(set.node_count, most_shared),
                   to_take = 60 * (nodes * nodes + set.node_count) / kDense,
                   least = operations_to_solve_for(matrix_.rows_end(), set.constraint_count);
  // Through the nodes there is no way from one disc to another beyond the mesh, and none to a row that constraints share.
  shares_ = !matrix_.couples() && !joins(set) && to_take + least <= work->left() &&
            shared_.take(matrix_.compliance(), set, factor_.used());
  if (shares_) {
    through.shared = &shared_;
    work->add(shared_.operations_to_take() / kDense);
  }
  decided_ = 1;
  if (solved) {
    std::fill(doubt_, doubt_ + set.constraint_count, Doubt{});
  } else {
    const Operations look = operations_to_look(through);
    solve_laws(through, ContactFactor::kMostSolves, 2 * look, work);
    measure_laws(through);
    work->add(look);
  }
  limit_grips(through, set, force, work);
  gives_way_ = contacts_give_way(laws);
}

}  // namespace palpate
