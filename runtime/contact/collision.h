// Which tool points are in contact, and with which surface point.
//
// Every tool point is inside or outside the organ. The nearest triangle of the surface as it is now decides the side of a point.
// The motions of the point and of the triangles between two steps decide where the point came in, so that neither motion is
// missed. A point is not tested while bounds on both motions show that it cannot have reached the surface.
#pragma once

#include <cstdint>

#include "runtime/contact/deformed_surface.h"

namespace palpate {

// How far a tool point is from changing its side.
struct Clearance {
  Vec3 at;              // m, where the point was tested
  double distance = 0;  // m, between it and the surface; 0: unknown
  double per_path = 0;  // m / sqrt(J), as in NearestPoint
  double path = 0;      // sqrt(J), of the surface's changes, then
};

// One tool point from step to step.
struct PointState {
  bool known = false;    // seen in an earlier step
  bool inside = false;   // of the surface; in contact: of the surface without this contact's own part
  bool contact = false;  // the point holds its anchor
  bool through = false;  // in contact, and out again on the far side of a thin part
  Vec3 last;             // m, where the point was in the last step
  Vec3 pulled;           // m, in contact: the point, less what all other contacts do at the anchor
  Clearance clear;
  double drift = 0;     // sqrt(J), in contact: sum of the changes of the surface without this contact's part
  SurfacePoint anchor;  // the surface point that the tool point holds
  Vec3 anchor_at_rest;  // m
  Vec3 outward;         // unit normal of the anchor's triangle at rest
  Vec3 tangent;         // of the contact's frame; turns with the surface as the anchor moves; zero: none yet
};

// The limits beyond which a tool point is no longer followed.
struct TrackingLimits {
  double farthest = INFINITY;  // m, in one step
  double release = INFINITY;   // m, between a tool point and the place of its contact
};

class Collision {
 public:
  // surface: answers the queries of a step. rest: the same surface, in buckets, over which anchors slide. field: nullptr where
  // the surface is at rest. All are borrowed.
  void create(DeformedSurface* surface, SurfaceIndex* rest, ContactField* field);

  // Moves one tool point to p (m) and updates its state. hold: a contact does not end by coming out. Returns false where the
  // point was not followed: it moved too far in one step, through the organ, or away from its contact.
  // Cost: nanoseconds for a point that cannot have reached the surface, else some microseconds; work() counts it.
  bool move(PointState& state, Vec3 p, std::int32_t tool, std::int32_t point, bool hold, const TrackingLimits& limits);

  // Moves the anchor to the point of the rest surface that is nearest to p. The search walks over the surface from the old
  // anchor, so the anchor does not change to the other side of a thin part. Cost: a few microseconds.
  void slide(PointState& state, Vec3 p);
  // Moves the anchor towards the point of the deformed surface that is nearest to the tool point p.
  void follow(PointState& state, Vec3 p, std::int32_t tool, std::int32_t point);

  // A step begins: its work is counted from zero.
  void begin();
  // Whether the step had more contacts to test than its work allows. These contacts hold, and the next step begins with them.
  bool has_deferred() const { return deferred_; }
  void forget() { deferred_from_ = -1; }

 private:
  void see_first(PointState& state, Vec3 p);
  bool move_free(PointState& state, Vec3 p);
  bool move_in_contact(PointState& state, Vec3 p, std::int32_t tool, std::int32_t point, bool hold, double release);
  void test_contact(PointState& state, Vec3 p, std::int32_t tool, std::int32_t point, bool hold, double moved,
                    bool pulls);
  bool look_for_contact(PointState& state, const SurfaceCrossing* crossing, int count, Vec3 p, bool now_inside,
                        const NearestPoint& nearest);
  void begin_contact(PointState& state, Vec3 p, const SurfacePoint& surface_point, bool through);
  void end_contact(PointState& state, std::int32_t tool, std::int32_t point);
  double reach(double moved) const;
  bool may_test();

  DeformedSurface* surface_ = nullptr;
  SurfaceIndex* rest_ = nullptr;
  ContactField* field_ = nullptr;
  Operations work_ = 0;              // of this step
  std::int32_t asked_ = 0;           // tests of contacts that were asked for in this step
  std::int32_t first_ = 0;           // the first of them that this step does
  std::int32_t deferred_from_ = -1;  // the first one after it that did not fit; -1: all fitted
  bool deferred_ = false;            // a test was not done
};

}  // namespace palpate
