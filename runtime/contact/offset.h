// The offset o of the displacement field: what moves the organ from outside, beside the contacts of a step. Row m of some rows is column m
// of B, a module writes their amounts q, and the organ without contacts has the displacement o = B q.
// A contact holds what o leaves of its target: (H W H^T) r = d - H o.
//
// A scene has one offset, and one effect owns it. In its prepare() it makes the rows, of the bundle or of its own: C f for a load f. It also
// gives them to the shape (ShapeState::moved_surface, moved_interior). Where the scene has a corridor the rows have the nodes inside too,
// because what holds nodes there asks for them. The amounts reach the shape in palpate_contacts.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/offset_rows.h"
#include "runtime/contact/contact_constraints.h"

namespace palpate {

class Offset {
 public:
  // rows: borrowed, of finite numbers; `longest` is filled in here. Without create() there are no rows, and o is zero.
  bool create(SceneMemory& memory, const OffsetRows& rows, std::int32_t constraint_capacity);

  bool exists() const { return rows_.count > 0; }
  std::int32_t count() const { return rows_.count; }
  const OffsetRows& rows() const { return rows_; }

  // For the module that writes the amounts. A step: end_last_step(), then the new amounts, then begin_step(), then
  // ContactField::begin_moved() where the field has the offset; is_first: nothing was anywhere before. While the step is solved the amounts
  // may change again. Amounts that never change need this once, in prepare(). create() marks the amounts for saved states; they are zero
  // behind it and behind forget(), which nobody else calls.
  void end_last_step();
  void begin_step(bool is_first);
  void forget();
  double* amounts() { return now_; }
  const double* amounts() const { return now_; }
  const double* begun_amounts() const { return begun_; }

  // m, of a node: now; as this step began; as the one before began; from the end of the last step to the beginning of this one.
  Vec3 now(std::int32_t node) const { return rows_.sum_at(now_, node); }
  Vec3 begun(std::int32_t node) const { return rows_.sum_at(begun_, node); }
  Vec3 before(std::int32_t node) const { return rows_.sum_at(before_, node); }
  Vec3 step_of(std::int32_t node) const { return rows_.sum_at(step_, node); }
  // m, now: of the weighted mean that a constraint of `set` holds.
  Vec3 held_by(const ContactConstraints& set, const ContactConstraint& constraint) const;
  // m: what is left of the target of constraint p.
  Vec3 left_of_target(const ContactConstraints& set, std::int32_t p) const;
  // The constraints with the targets that are left for the forces, until the next call; `set` itself where there are no rows. Cost: for each
  // contact node 3 multiply-adds for each row.
  const ContactConstraints& acting(const ContactConstraints& set);

  // m, upper bounds over the surface: of o now; of its change from the end of the last step to the beginning of this one, from the beginning
  // of the last step to now, and from the beginning of this step to now.
  double longest() const { return length_of(now_, nullptr); }
  double stepped() const { return stepped_; }
  double change() const { return length_of(now_, before_); }
  double moved_in_step() const { return length_of(now_, begun_); }

 private:
  double length_of(const double* amounts, const double* from) const;

  OffsetRows rows_;
  ContactConstraints acting_;
  // [count] each:
  double* longest_ = nullptr;
  double *now_ = nullptr, *begun_ = nullptr, *before_ = nullptr, *step_ = nullptr;
  double stepped_ = 0;
};

}  // namespace palpate
