#include "runtime/contact/contact_admission.h"

#include <algorithm>

namespace palpate {

Operations ContactAdmission::cost_of(const ContactSolver::Changes& next) const {
  return std::max<Operations>(0, solver_->operations_to_renew(next) - paid_);
}

void ContactAdmission::begin() {
  if (admits_any()) return;
  work_->keep_for_solution(solver_->operations_to_solve({}));
  changes_ = {};
  changes_.contacts = work_->paid_changes();
  paid_ = solver_->operations_to_renew(changes_);
  expect_disc(false);
}

void ContactAdmission::begin_point(ContactSolver::Changes* next) const {
  ++next->begun;
  next->rows += point_.rows, next->constraints += point_.constraints, next->nodes += nodes_, next->discs += discs_;
}

ContactAdmission::Cost ContactAdmission::next() const {
  if (admits_any()) return {};
  ContactSolver::Changes moved = changes_, begun = changes_;
  ++moved.contacts;
  ++begun.contacts;
  begin_point(&begun);
  return {press_ + std::max(cost_of(moved), cost_of(begun)), solver_->operations_to_solve(begun)};
}

void ContactAdmission::pay(const ContactSolver::Changes& next, Operations cost) {
  changes_ = next, paid_ += cost;
  work_->pay_change(cost);
  work_->keep_for_solution(solver_->operations_to_solve(next));
}

bool ContactAdmission::change(bool begins) {
  if (admits_any()) {
    work_->add(of_any_);
    return true;
  }
  ContactSolver::Changes next = changes_;
  ++next.contacts;
  if (begins) begin_point(&next);
  const Operations cost = cost_of(next), least = begins ? solver_->operations_to_solve(next) : 0;
  const Operations left = work_->paid_changes() == 0 ? work_->first_change_left(least) : work_->changes_left(least);
  if (press_ + cost > left) return false;
  pay(next, cost);
  work_->add(press_);
  return true;
}

bool ContactAdmission::press() {
  if (admits_any()) return true;
  const bool fits = ContactPatch::kToPress <= work_->first_change_left(0);
  if (fits)
    work_->add(ContactPatch::kToPress);
  else
    work_->defer();
  return fits;
}

void ContactAdmission::pay() {
  if (admits_any()) return;  // the body counts what it takes
  ContactSolver::Changes next = changes_;
  ++next.contacts;
  pay(next, cost_of(next));
}

bool ContactAdmission::admit(std::int32_t first, bool paid, bool* deferred) {
  const ContactConstraints& set = rows_->set();
  const std::int32_t end = set.constraint_count;
  *deferred = false;
  if (first == end || admits_any()) return true;
  const ContactConstraint* const before = solver_->matrix().kept(set.constraints[first], first);
  bool holds = paid || (beside_ && before);
  for (std::int32_t p = first; p < end && !holds; ++p) {
    if (!solver_->matrix().holds(set, p)) break;
    holds = p + 1 == end;
  }
  if (holds) return true;
  ContactSolver::Changes next = changes_;
  ++next.contacts;
  if (!before) {
    ++next.begun, next.constraints += end - first;
    next.nodes += set.node_count - set.constraints[first].first_node;
    for (std::int32_t p = first; p < end; ++p) {
      next.discs += has_disc(set.constraints[p]);
      for (int axis = 0; axis < 3; ++axis) next.rows += static_cast<std::int32_t>(set.constraints[p].axes >> axis & 1u);
    }
  }
  const Operations cost = cost_of(next), least = before ? 0 : solver_->operations_to_solve(next);
  if (cost <= work_->first_change_left(least)) {
    pay(next, cost);
    return true;
  }
  work_->defer();
  *deferred = true;
  if (before && rows_->hold_as_before(first, before, end - first, solver_->matrix().held().nodes)) return true;
  rows_->take_back(first);
  return false;
}

Operations ContactAdmission::next_debt(bool disc) const {
  ContactSolver::Changes next = debts_;
  ++next.contacts;
  return to_press(disc) +
         std::max<Operations>(0, solver_->operations_to_renew(next) - solver_->operations_to_renew(debts_));
}

bool ContactAdmission::may_owe(bool disc) const {
  return admits_any() || next_debt(disc) <= (debts_.contacts == 0 ? work_->first_debt_left() : work_->debts_left());
}

void ContactAdmission::owe(bool disc) {
  if (admits_any()) return work_->owe(of_any_);
  work_->owe_change(next_debt(disc));
  ++debts_.contacts;
}

}  // namespace palpate
