#include "runtime/contact/contact_solver.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

bool joins(const ContactConstraints& set) {
  return std::any_of(set.constraints, set.constraints + set.constraint_count,
                     [](const ContactConstraint& constraint) { return constraint.joined; });
}

class NodesOfContacts final : public NodesOfRows {
 public:
  // force: [node_count] scratch.
  NodesOfContacts(const ContactMatrix& matrix, const ContactConstraints& set, Vec3* force, SharedNodes* shared)
      : matrix_(matrix), set_(set), force_(force), shared_(shared) {}
  bool shares() const { return shares_; }

  double farthest(const double* reaction, Operations kept, StepWork* work) override {
    return matrix_.largest_displacement(set_, reaction, force_, kept, work);
  }
  // Through the nodes there is no way from one disc to another beyond the mesh, and none to a row that constraints share.
  const SharedNodes* share(std::int32_t rows, Operations kept, StepWork* work) override {
    constexpr Operations most_shared = SharedNodes::kMostNodes;
    const Operations nodes = std::min<Operations>(set_.node_count, most_shared),
                     to_take = 60 * (nodes * nodes + set_.node_count) / kDense;
    shares_ = !matrix_.couples() && !joins(set_) && to_take + kept <= work->left() &&
              shared_->take(matrix_.compliance(), set_, rows);
    if (!shares_) return nullptr;
    work->add(shared_->operations_to_take() / kDense);
    return shared_;
  }

 private:
  const ContactMatrix& matrix_;
  const ContactConstraints& set_;
  Vec3* force_;
  SharedNodes* shared_;
  bool shares_ = false;
};

}  // namespace

bool ContactSolver::create(SceneMemory& memory, const Limits& limits) {
  if (!matrix_.create(memory, limits.of)) return false;
  work_ = memory.array<double>(2 * static_cast<std::size_t>(matrix_.rows().capacity));
  if (!system_.create(memory, &matrix_.rows(), {limits.of.nodes, limits.operations, true})) return false;
  if (limits.of.predicts && !prediction_.create(memory, &matrix_, &system_.factor(), &system_.laws())) return false;
  return shared_.create(memory, limits.of.nodes) && !memory.failed();
}

void ContactSolver::restored(const Tensors& tensors) {
  matrix_.restored(tensors);
  system_.restored(held_rows());
}

void ContactSolver::forget() {
  matrix_.forget();
  system_.forget();
  prediction_.forget();
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
  const ContactFactor& factor = system_.factor();
  const Operations rows = matrix_.rows().rows_end + changes.rows;
  const bool keeps_factor = !system_.gave_way() && factor.exists() && factor.affords(rows);
  return (keeps_factor ? ContactFactor::upkeep_of(rows, changes.contacts - changes.begun, changes.contacts) : 0) +
         entries_of(changes);
}

bool ContactSolver::update(const Tensors& tensors, const ContactConstraints& set, StepWork* work) {
  ContactFactor& factor = system_.factor();
  double* const reactions = system_.reactions();
  if (!matrix_.match(tensors, set, reactions, again_)) return false;
  if (matrix_.changed_contacts() > 0) make_room_for_changes(work);
  matrix_.drop_leaving(reactions);
  if (matrix_.leaving_count() > 0) factor.drop_rows();
  if (!matrix_.add_coming(set, reactions)) return false;
  if (matrix_.leaving_count() > 0 || matrix_.coming_count() > 0) factor.leave_soft();
  if (!factor.append(matrix_.coming(), matrix_.coming_count())) return false;
  matrix_.keep(set);
  prediction_.forget();
  return true;
}

// Contacts that go without notice, as with a tool that is not sent any more, are not counted yet.
void ContactSolver::make_room_for_changes(StepWork* work) {
  ContactFactor& factor = system_.factor();
  const Operations paid = work->paid_changes(), unpaid = matrix_.changed_contacts() - paid;
  if (factor.exists() && !system_.gave_way() &&
      factor.affords(factor.used() - matrix_.leaving_count() + matrix_.joining_rows())) {
    const Operations cost = unpaid > 0 ? ContactFactor::upkeep_of(matrix_.rows().rows_end, unpaid, 0) : 0;
    if (cost <= work->first_change_left(0)) return work->add(cost);
  }
  factor.leave();
}

// ---- solving ---------------------------------------------------------------------------------------------------------

void ContactSolver::take_targets(const ContactConstraints& set) {
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const Vec3 target = target_of_rows(set, p);
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = matrix_.rows_of(p).at[i]; row >= 0) system_.targets()[row] = target[i];
  }
}

// The forces and the displacements of the nodes under the reactions. False where a number is not finite.
bool ContactSolver::write_forces(const ContactConstraints& set, Vec3* force, Vec3* modified) const {
  std::fill(force, force + set.node_count, Vec3{});
  spread_reactions(set.constraints, matrix_.rows_of_constraints(), set.constraint_count, set.nodes, system_.reactions(),
                   force);
  bool finite = std::isfinite(residual().displacement) && std::isfinite(residual().force);
  for (std::int32_t e = 0; e < set.node_count; ++e) {
    modified[e] = this->modified(e, force[e]);
    finite = finite && is_finite(force[e]) && is_finite(modified[e]);
  }
  return finite;
}

SystemSolver::Outcome ContactSolver::fail(const ContactConstraints& set, Vec3* force, Vec3* modified) {
  forget();
  for (std::int32_t e = 0; e < set.node_count; ++e) force[e] = modified[e] = Vec3{};
  system_.begin({});
  return Outcome::unsolved;
}

double ContactSolver::change_norm(const ContactConstraints& set) const {
  if (again_ || set.constraint_count != last_constraints_) return -1;
  double* const change = work_;
  std::fill(change, change + matrix_.rows().rows_end, 0.0);
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    if (!matrix_.is_kept(p)) return -1;
    for (const std::int32_t i : matrix_.rows_of(p).at)
      if (i >= 0) change[i] = system_.reactions()[i] - system_.last()[i];
  }
  return energy_norm(matrix_.rows(), change);
}

bool ContactSolver::prepare(const Tensors& tensors, const ContactConstraints& set, StepWork* work) {
  again_ = false, last_constraints_ = matrix_.held().count, shares_ = false;
  if (!update(tensors, set, work)) {
    forget();
    return false;
  }
  system_.begin(rows_for(set));
  return true;
}

SystemSolver::Outcome ContactSolver::take_reactions(const ContactConstraints& set, const LawEffort& effort, Vec3* force,
                                                    Vec3* modified) {
  system_.take_reactions(rows_for(set), effort);
  return write_forces(set, force, modified) ? Outcome::solved : fail(set, force, modified);
}

SystemSolver::Outcome ContactSolver::solve(const Tensors& tensors, const ContactConstraints& set, Vec3* force,
                                           Vec3* modified, StepWork* work, bool again) {
  again_ = again, last_constraints_ = matrix_.held().count, shares_ = false;
  if (!update(tensors, set, work)) return fail(set, force, modified);
  take_targets(set);
  system_.begin(rows_for(set));
  NodesOfContacts nodes(matrix_, set, force, &shared_);
  const Outcome outcome = system_.solve(nodes, work);
  shares_ = nodes.shares();
  const bool solved = outcome != Outcome::unsolved && write_forces(set, force, modified);
  return solved ? outcome : fail(set, force, modified);
}

}  // namespace palpate
