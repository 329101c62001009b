// Which tool points are in contact, and with which surface point.
//
// Every tool point is inside or outside the organ. The nearest triangle of the surface as it is now decides the side of a point.
// The ways of the point and of the triangles between two steps decide where the point came in, so that neither way is
// missed. A point is not tested while bounds on both ways show that it cannot have reached the surface.
#pragma once

#include <cstdint>

#include "runtime/contact/contact_admission.h"
#include "runtime/contact/deformed_surface.h"
#include "runtime/contact/easing.h"

namespace palpate {

// How far a tool point is from changing its side.
struct Clearance {
  Vec3 at;              // m, where the point was tested
  double distance = 0;  // m, between it and the surface; 0: unknown
  double per_path = 0;  // m / sqrt(J), as in NearestPoint
  double path = 0;      // sqrt(J), of the surface's changes, then
  double changes = 0;   // m, of the contacts' ways, then (SurfaceField)
};

// The disc that a tool point presses, where it meets the surface.
struct PointDisc {
  double radius = 0;  // m; 0: the point has none
  Vec3 sunk;          // m, how far the disc meets the surface from where its points are (DeformedSurface::below_disc)
  bool over_held = false;   // nodes below it are held, and others are displaced
  bool in_surface = false;  // free, over held nodes: the point is inside, and the disc does not touch yet
  bool unused[6] = {};      // in the place of padding, which a saved state would hold
};

// What a contact that slides leaves to the next step.
struct PointSlide {
  Vec3 at;           // m, the disc's mean place; before, where the tool was before the contact
  Vec3 axis;         // unit, of its law
  Vec3 lean;         // how its normal turned there (DiscSlide)
  double push = 0;   // N, the same
  Easing way, turn;  // of its anchor, m, and of its axis
  double slack = 0;  // m, by which the contact gives way along the normal (slide_energy.h)
  double lift = 0;   // m, outward, of the disc's mean place from its anchor where the contact began
};

// One tool point from step to step.
struct PointState {
  bool known = false;        // seen in an earlier step
  bool inside = false;       // of the surface; in contact: of the surface without this contact's own part
  bool contact = false;      // the point holds its anchor
  bool through = false;      // in contact, and out again on the far side of a thin part
  bool doubted = false;      // in contact: out of the surface without it; the step had no room to ask the predicted one
  bool paid = false;         // its contact's new rows are counted in this step
  bool owed = false;         // in the next one
  bool has_no_rows = false;  // in contact: the contact has held nodes alone, so that it has no force
  bool has_ended = false;    // its contact has ended since the point was last tested
  bool predicted = false;    // in contact: `inside` is of the predicted surface
  bool rides = false;        // in contact: `slide` is known to its push, of a disc that slides almost freely
  bool begins = false;       // the contact has had no rows yet
  std::int32_t waited = 0;   // free: steps since `last`, which is then where the point was last tested
  Vec3 last;                 // m, where the point was in the last step that followed it
  PointDisc disc;
  Clearance clear;
  double drift = 0;  // sqrt(J), in contact: sum of the changes of the surface without this contact's part
  // m: how far the surface (in contact, point and surface) may have moved in steps that put the test off.
  double unseen = 0;
  SurfacePoint anchor;  // the surface point that the tool point holds
  Vec3 anchor_at_rest;  // m
  Vec3 outward;         // unit normal of the anchor's triangle at rest
  PointSlide slide;
  Vec3 tangent;  // of the contact's frame; turns with the surface as the anchor moves; zero: none yet
};

// The limits beyond which a tool point is no longer followed.
struct TrackingLimits {
  double farthest = INFINITY;  // m, in one step
  double release = INFINITY;   // m, between a tool point and the place of its contact
};

class Collision {
 public:
  // surface: answers the queries of a step. rest: the same surface, in buckets, over which anchors slide. field: nullptr where
  // the surface is at rest. work: of the step. All are borrowed.
  void create(SceneMemory& memory, DeformedSurface* surface, SurfaceIndex* rest, SurfaceField* field, StepWork* work);

  // Moves one tool point to p (m) and updates its state. hold: a contact does not end by coming out. Returns false where the
  // point was not followed: it moved too far in one step, through the organ, or away from its contact.
  // Points are moved in ascending order of tool and point. Cost: nanoseconds for a point that cannot have reached the surface,
  // else some microseconds. Where the step's work does not allow the test or the change that it may find, or not to its end, a later
  // step does it: until then a contact holds, and a free point stays on its side.
  bool move(PointState& state, Vec3 p, const ContactId& contact, bool hold, const TrackingLimits& limits);

  // Moves the anchor to the point of the rest surface that is nearest to p. The search walks over the surface from the old
  // anchor, so the anchor does not change to the other side of a thin part. Cost: a few microseconds.
  void slide(PointState& state, Vec3 p);
  // Moves the anchor towards the point of the deformed surface that is nearest to the tool point p. It stays where the step's work does
  // not allow that.
  void follow(PointState& state, Vec3 p, const ContactId& contact);
  // The same of a disc that slides almost freely: by what its mean place is off the tool across its axis.
  void ride(PointState& state, Vec3 p);
  // The same by slide(), to p less what all other contacts do at the anchor.
  void slide_pulled(PointState& state, Vec3 p, const ContactId& contact);

  void begin();
  void forget() { turns_.forget(); }

  // What the next contact costs (contact_admission.h).
  void expect(const ContactAdmission::Cost& next) { next_ = next; }
  // Whether it fits into this step.
  bool may_change() const { return room_to_change(0) >= 0; }

  // Operations by which a query may exceed its limit.
  Operations overshoot() const { return overshoot_; }

 private:
  // A test that did not come to its end has left the side of the point as it was.
  enum class Test { done, lost, unfinished };
  Test see_first(PointState& state, Vec3 p);
  Test test_free(PointState& state, Vec3 p);
  bool move_in_contact(PointState& state, Vec3 p, const ContactId& contact, bool hold, double release);
  Test test_contact(PointState& state, Vec3 p, const ContactId& contact, bool hold, double moved, bool pulls);
  double may_have_sunk(const PointState& state, Vec3 p, const ContactId& contact) const;
  bool look_for_contact(PointState& state, const SurfaceCrossing* crossing, int count, Vec3 way, bool now_inside,
                        const NearestPoint& nearest);
  void begin_contact(PointState& state, const SurfacePoint& surface_point, bool through);
  void end_contact(PointState& state, const ContactId& contact);
  double reach(double moved) const;
  Operations room_to_change(Operations least) const;
  bool ask_pulled(const PointState& state, Vec3 p, const ContactId& contact, Vec3* at);
  template <class Run>
  Test take_turn(const ContactId& contact, Operations room, Run run);

  DeformedSurface* surface_ = nullptr;
  SurfaceIndex* rest_ = nullptr;
  SurfaceField* field_ = nullptr;
  StepWork* work_ = nullptr;
  Turns turns_;  // of the tests
  ContactAdmission::Cost next_;
  Operations overshoot_ = 0;
};

}  // namespace palpate
