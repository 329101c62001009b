// The offset o of the displacement field: what moves the organ from outside, beside the contacts of a step. Row m of some rows is column m
// of B, a module writes their amounts q, and the organ without contacts has the displacement o = B q.
// A contact holds what o leaves of its target: (H W H^T) r = d - H o.
//
// Some amounts may follow the contacts' forces f, as the pressure in a cavity does that keeps its volume: with the symmetric matrix V of these rows, f changes
// their amounts by g = -V^-1 B^T f. They are eliminated: contacts see W = C - B V^-1 B^T (node_compliance.h), are solved once, and g follows.
// The organ has the displacement u = o + C f + B g.
//
// Where the mesh has changed (changed_body.h), o is what the rows make of the changed body. Amounts that follow do not go with it.
//
// A scene has one offset, to which effects add rows in their prepare(): of the bundle, or C f for a load f. Each effect writes the amounts of
// its own rows. The shape has the rows too. Where it shows the nodes inside, and where the scene has a corridor or a body that does not respond
// linearly, the rows have the nodes inside, because what holds nodes there asks for them, and so does that body. The amounts reach the shape in
// palpate_contacts.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/offset_rows.h"
#include "runtime/contact/changed_body.h"
#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/offset_followers.h"

namespace palpate {

class Offset {
 public:
  // Rows behind those that are there: of finite numbers, with the same nodes, borrowed where they are the first ones. Returns the number of the
  // first one; -1: there is no memory, or no room.
  std::int32_t add(SceneMemory& memory, const OffsetRows& rows);
  // With all rows; `longest` is filled in here. Without rows o is zero.
  bool create(SceneMemory& memory, std::int32_t constraint_capacity);

  // A body whose mesh may change: before create(). borrowed.
  void change_body(ChangedBody* changed) { changed_ = changed; }
  ChangedBody* changed() const { return changed_; }

  bool exists() const { return rows_.count > 0 || changed_; }
  std::int32_t count() const { return rows_.count; }
  const OffsetRows& rows() const { return rows_; }

  // For the touch: around StepPart::begin_step() of all parts, in which effects write new amounts q of their rows. Behind create(), whose amounts
  // saved states have, and behind forget() the amounts are zero, and nothing was anywhere before the next step.
  void end_last_step();
  void begin_step();
  void forget();
  double* amounts() { return now_; }
  const double* amounts() const { return now_; }

  // [count()] what is asked and told of each pressure on a body that is not linear; nullptr: no row is such a pressure. A saved state has them.
  // A body that is solved in a thread of its own holds volumes itself. Between its solutions the touch moves it by the linear response, in
  // which the pressures follow the contacts' forces. take_volumes(): V of the first `of` rows, [of][of] m^3 per unit, as for follow(); borrowed.
  // follow_held(): `followers` become the pressures whose volumes are held. take_told(): takes what the body's newest solution tells; from then on
  // the pressures follow whose volumes that solution holds.
  void take_volumes(const double* volume, std::int32_t of) { volume_of_ = volume, volume_rows_ = of; }
  void follow_held(const RowVolume* volumes, OffsetFollowers* followers) const;
  void take_told(const RowVolume* told);
  RowVolume* volumes() { return volumes_; }
  const RowVolume* volumes() const { return volumes_; }

  // For the effect that has the first `of` rows. which: [of] 1 where the amount follows the forces from the next solve on; v: [of][of], of which V is
  // a part (OffsetFollowers::factorise()). Then start_from(): q, with g for what is left to the `whole` amounts [count].
  void follow(std::int32_t of, const std::int32_t* which, const double* v);
  void start_from(const double* q, const double* whole);
  // After the last solve of a step: g of its forces.
  void take_forces(const ContactConstraints& set, const Vec3* force);

  const OffsetFollowers& followers() const { return followers_; }
  // How often other amounts have begun to follow: W is another one.
  std::int32_t version() const { return version_; }

  // q + g of a row, as the superposition of C f needs it: of the last solve.
  double whole_amount(std::int32_t row) const { return given_[row] == 0 ? now_[row] : now_[row] + given_[row]; }
  // m, B g of a node: after the last solve; after the one before. False: no amount has ever followed, and g is zero.
  bool has_given() const { return version_ > 0; }
  Vec3 given(std::int32_t node) const { return given_by(given_, node); }
  Vec3 given_before(std::int32_t node) const { return given_by(given_before_, node); }
  Vec3 given_by(const double* amounts, std::int32_t node) const;  // under other amounts [count]

  // m, o of a node: now; in the step before; from the end of the last step to the beginning of this one.
  Vec3 now(std::int32_t node) const;
  Vec3 before(std::int32_t node) const;
  Vec3 step_of(std::int32_t node) const;
  // m, now: of the weighted mean that a constraint of `set` holds.
  Vec3 held_by(const ContactConstraints& set, const ContactConstraint& constraint) const;
  // m: what is left of the target of constraint p.
  Vec3 left_of_target(const ContactConstraints& set, std::int32_t p) const;
  // The constraints with the targets that are left for the forces, until the next call; `set` itself where there are no rows. Cost: for each
  // contact node 3 multiply-adds for each row.
  const ContactConstraints& acting(const ContactConstraints& set);

  // m, upper bounds over the surface: of o now, where other amounts have begun to follow with what that has changed in it; of its change from
  // the end of the last step to the beginning of this one, and from the beginning of the last step to now.
  double longest() const;
  double stepped() const { return stepped_; }
  double change() const;

 private:
  double length_of(const double* amounts, const double* from) const;
  OffsetRows rows_;
  ContactConstraints acting_;
  // [count] each:
  double* longest_ = nullptr;
  double *now_ = nullptr, *before_ = nullptr, *step_ = nullptr;
  double *given_ = nullptr, *given_before_ = nullptr;  // g
  RowVolume* volumes_ = nullptr;
  const double* volume_of_ = nullptr;  // [volume_rows]^2
  std::int32_t volume_rows_ = 0;
  OffsetFollowers followers_;
  ChangedBody* changed_ = nullptr;
  std::int32_t version_ = 0, first_ = 1;
  double stepped_ = 0, restarted_ = 0;
};

}  // namespace palpate
