// Which contacts may come, go and move in a step: those whose new rows the step's operations have room for (step_work.h). A contact
// that does not fit keeps the rows of the last step, or waits where it had none.
#pragma once

#include <cstdint>

#include "runtime/base/step_work.h"
#include "runtime/contact/contact_patch.h"
#include "runtime/contact/contact_rows.h"
#include "runtime/contact/contact_solver.h"

namespace palpate {

class ContactAdmission {
 public:
  // What one tool point that comes into contact adds to the system, as far as it is known before its rows are made.
  struct PointContact {
    std::int32_t rows, constraints, nodes;
    std::int32_t disc_nodes;  // of a tool with a disc
  };
  // All are borrowed. beside: the solver's constraints are not those of `rows` (Body::added()).
  void create(const ContactSolver* solver, ContactRows* rows, StepWork* work, PointContact point, bool beside) {
    solver_ = solver, rows_ = rows, work_ = work, point_ = point, beside_ = beside;
  }

  // Of a body that takes any change: each counts so many operations, and none is refused.
  void admit_any(Operations each) { of_any_ = each; }

  // Begins a step. Changes that the last step owes are paid.
  void begin();

  // The next contacts are of a tool with a disc or without.
  void expect_disc(bool disc) {
    nodes_ = disc ? point_.disc_nodes : point_.nodes;
    discs_ = disc ? point_.constraints : 0;
    press_ = to_press(disc);
  }
  // What the next contact of a tool point costs; least: of the solution, if it begins (StepWork::keep_for_solution()).
  struct Cost {
    Operations change = 0, least = 0;
  };
  Cost next() const;

  // Pays for a tool point's contact that begins, or ends or moves. False, with nothing paid, where it does not fit.
  bool change(bool begins);
  // Whether this step solves the constraints of `rows` from `first` on, which are of one contact. They are those of the last step, are
  // paid for, or fit. *deferred: they do not; then they are as the last step had them, or, where this returns false, gone.
  bool admit(std::int32_t first, bool paid, bool* deferred);
  // Pays for a contact whose rows change, whatever it costs.
  void pay();
  // Pays for a disc that is computed anew though no change() has paid for it. False where it does not fit.
  bool press();

  // After the solve: the next step's change of a contact. False where the debts of this step have no room for it.
  void begin_debts() { debts_ = {}; }
  bool may_owe(bool disc) const;
  void owe(bool disc);

 private:
  bool admits_any() const { return of_any_ >= 0; }
  Operations cost_of(const ContactSolver::Changes& next) const;
  void begin_point(ContactSolver::Changes* next) const;
  void pay(const ContactSolver::Changes& next, Operations cost);
  Operations next_debt(bool disc) const;
  static Operations to_press(bool disc) { return disc ? ContactPatch::kToPress : 0; }

  const ContactSolver* solver_ = nullptr;
  ContactRows* rows_ = nullptr;
  StepWork* work_ = nullptr;
  PointContact point_ = {};
  std::int32_t nodes_ = 0, discs_ = 0;  // of a contact that begins
  Operations press_ = 0;                // of a contact whose disc is computed anew, beside its rows
  bool beside_ = false;
  Operations of_any_ = -1;  // of a change, where any is admitted; else below 0
  ContactSolver::Changes changes_, debts_;
  Operations paid_ = 0;  // for changes_
};

}  // namespace palpate
