// From the surface points and nodes that the tools hold to the step's constraints, by the scene's contact model.
#pragma once

#include <cstdint>

#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/contact_patch.h"
#include "runtime/contact/easing.h"
#include "runtime/include/palpate/palpate.h"

namespace palpate {

// What a disc that slides almost freely knows from the last step. Its law is along the normal of the disc as it is: that of the surface at rest
// at its mean place, turned as the nodes below it have moved, so that the force along the slide is minus the slope of the stored energy
// (docs/method.md, section 6).
struct DiscSlide {
  Vec3 anchor;             // m, at rest
  Vec3 lean;               // slope of the displacement along the normal
  double push = 0;         // N, along the normal
  Vec3 inward;             // unit, of its law
  Easing* turn = nullptr;  // of a disc that goes on in each step, not only where it slips
  bool begins = false;
};

// One contact as a tool asks for it, before the contact model turns it into constraints.
struct ContactWish {
  ContactId contact;
  Vec3 displacement;       // u*, m; zero along axes that are not imposed
  std::uint32_t axes = 7;  // of x, y, z
  double disc_radius = 0;  // m; 0: a point
  ContactLaw law = ContactLaw::sticking;
  double friction = 0;
  Vec3 outward, tangent;             // unit and orthogonal; where contacts have frames
  double slack = 0;                  // m, by which the displacement along the inward normal is to be less
  const DiscSlide* slide = nullptr;  // of a disc whose law is along its own normal
  bool moved = false;                // its frame may have changed although its surface point is the same
};

// A constraint of a source that knows its nodes and its rows, unlike that of a ContactWish. The source fills in all of `rows` but the nodes.
struct RowWish {
  explicit RowWish(const ConstraintId& id) : contact(id.contact) { rows.id = id, rows.axes = 7, rows.share = 1; }
  void set_frame(const Vec3 row[3]) {
    for (int i = 0; i < 3; ++i) store3(row[i], rows.frame.m[i]);
    rows.framed = true;
  }

  ContactConstraint rows = {};
  Vec3 target;                           // m, along the rows
  ContactId contact;                     // of the nodes
  const std::int32_t* node = nullptr;    // [count]
  const std::int32_t* column = nullptr;  // [count] tensor columns; nullptr: the nodes are on the surface
  const double* weight = nullptr;        // [count]
  std::int32_t count = 0;
};

class ContactRows {
 public:
  // What the constraints are made from; borrowed. rest and patch are nullptr where no effect needs them.
  struct Source {
    palpate_contact_model model;
    const std::int32_t* column_of_node;  // [Ns] or -1
    const std::int32_t* triangles;       // [F][3]
    const double* rest;                  // [Ns][3] m
    ContactPatch* patch;
    bool slides;  // discs may have a DiscSlide
  };
  bool create(SceneMemory& memory, const Source& source, std::int32_t node_capacity, std::int32_t constraint_capacity);

  // Starts a step without contacts, of which `contacts` will be asked for. Those of the last step are kept, so that an unchanged
  // patch need not be computed again.
  void begin(std::int32_t contacts);
  // Between steps or before begin(): the next step computes each patch anew.
  void forget() { set_.node_count = set_.constraint_count = last_.constraint_count = 0; }
  // Whether discs may have a DiscSlide: the answer for the whole scene.
  bool discs_slide() const { return source_.slides; }

  // Both return step flags; *made: whether there is a contact. Call them in ascending order of tool and point.
  std::uint32_t add_node(const ContactWish& wish, std::int32_t node, bool* made);
  // At a surface point. Vertices without a tensor column give their weight to the others: the weights still sum to one, and the
  // force stays bounded near a fixed border.
  // A disc or an interpolated point gets no more nodes than leave as many to each contact that is still to come (thin_nodes).
  std::uint32_t add_contact(const ContactWish& wish, const SurfacePoint& surface_point, bool* made);
  // Whether add_contact() would compute a disc anew (ContactPatch::kToPress). If the wish may not have it, add_contact_as_before() gives it
  // the disc of the last step, wherever that was; false: there was none.
  bool presses(const ContactWish& wish, const SurfacePoint& surface_point);
  bool add_contact_as_before(const ContactWish& wish);

  // One contact of `count` constraints, after all that stands before it in the order of ids. Returns the first one; -1: there is no room.
  std::int32_t add(const RowWish* wishes, std::int32_t count);
  // Keeps so much of the capacity for add_reserved() alone. Call it once.
  void reserve(std::int32_t nodes, std::int32_t constraints) {
    reserved_nodes_ = nodes, reserved_constraints_ = constraints;
  }
  // The same of one constraint, in the room that is reserved: after all else.
  std::int32_t add_reserved(const RowWish& wish);

  // Gives constraint p of this step another target; the caller then solves the step again.
  void set_target(std::int32_t p, Vec3 target) { set_.target[p] = target; }

  // Constraint p holds its target, or, where it has let go, nothing, whatever its law was.
  void settle(std::int32_t p, bool holds) {
    ContactConstraint& constraint = set_.constraints[p];
    constraint.law = ContactLaw::sticking;
    if (!holds) constraint.axes = 0;
  }

  // Takes the constraints from `first` on out of this step again.
  void take_back(std::int32_t first);
  // In place of those from `first` on, which are of one contact: `count` constraints as an earlier step had them, with their nodes, with
  // the present targets. False, with nothing changed, where there is no room, or a target has no counterpart.
  bool hold_as_before(std::int32_t first, const ContactConstraint* before, std::int32_t count,
                      const ContactNode* nodes);

  const ContactConstraints& set() const { return set_; }

 private:
  bool create_set(SceneMemory& memory, std::int32_t nodes, std::int32_t constraints, ContactConstraints* set);
  int nearest_vertex(const SurfacePoint& surface_point, const std::int32_t* node, const double* weight,
                     int count) const;
  std::uint32_t hold_node(const ContactWish& wish, std::int32_t node, bool* made);
  std::uint32_t hold_surface_point(const ContactWish& wish, const SurfacePoint& surface_point, bool* made);
  std::uint32_t add_patch(const ContactWish& wish, const SurfacePoint& surface_point, bool* made);
  bool is_disc(const ContactWish& wish) const { return source_.model == PALPATE_CONTACT_PATCH && wish.disc_radius > 0; }
  const ContactConstraint* patch_of_last_step(const ContactWish& wish);
  bool stays(const ContactConstraint& old, const ContactWish& wish, const SurfacePoint& surface_point) const;
  void add_patch_of_last_step(const ContactWish& wish);
  bool has_room(std::int32_t constraints, std::int32_t nodes) const;
  std::int32_t take(const RowWish* wishes, std::int32_t count);
  std::int32_t nodes_for_one() const;
  ContactConstraint& add_constraint(const ContactWish& wish, std::int32_t part);
  void add_held_node(const ContactWish& wish, ContactConstraint& constraint, std::int32_t node, double weight);
  void set_frame(const ContactWish& wish, ContactConstraint& constraint);
  ContactWish along_own_normal(const ContactWish& wish, const DiscPlace& place, const ContactConstraint* before) const;

  Source source_ = {};
  ContactConstraints set_, last_;
  std::int32_t next_in_last_ = 0;
  std::int32_t reserved_nodes_ = 0, reserved_constraints_ = 0;
  std::int32_t to_come_ = 0;  // contacts that will be asked for, the present one included
};

}  // namespace palpate
