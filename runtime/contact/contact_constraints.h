// The constraints of a step: which nodes are under contact, and the rows H that hold their weighted means.
#pragma once

#include <cmath>
#include <cstdint>

#include "runtime/base/vec3.h"
#include "runtime/contact/contact_id.h"
#include "runtime/contact/disc_compliance.h"
#include "runtime/include/palpate/palpate.h"
#include "runtime/surface/surface_index.h"

namespace palpate {

// One node under one contact, where a force acts. The same node may serve several contacts.
struct ContactNode {
  std::int32_t node, column;
  ContactId contact;
  std::int32_t unused;  // in the place of padding, which a saved state would hold
  double weight;        // of the node in its constraint
};

// How the rows of a constraint bind; palpate_contact_law of palpate.h explains the laws. A constraint that is not sticking has
// its first row along the inward normal and the other two across it. Beside its law a constraint may have a limit: the reaction of its first
// row is then at most so large, and the row gives way where it would take more (Tresca's friction).
enum class ContactLaw : std::uint8_t { sticking, sliding, unilateral, coulomb };

// Up to three rows, one for each imposed axis of the frame: they hold the weighted mean displacement of the nodes
// first_node .. first_node + node_count - 1 at a target.
struct ContactConstraint {
  std::int32_t first_node, node_count;
  std::uint32_t axes;       // bits 1, 2, 4: which rows of the frame are imposed
  ConstraintId id;          // ascending through a list. part: which of a TRIANGLE's three
  std::uint32_t flags;      // step flags of the disc
  std::int32_t thinned_to;  // of a disc: nodes that it was thinned to; 0: it has all of them
  ContactLaw law;
  bool framed;      // false: the frame is x, y, z
  bool joined;      // it has no row of its own: its nodes are held by the row of the constraint before
  bool turns;       // the frame is the surface's, and turns with it as the body says
  Mat3 frame;       // rows are unit vectors, orthogonal
  Mat3 local;       // m/N, in the frame: compliance under a patch that the mesh does not resolve (contact_patch.h)
  double friction;  // under coulomb: largest tangential force over the normal force
  double limit;     // N, above 0: of the reaction of the first row; 0: none
  double share;     // of the constraint in its anchor: a vertex' barycentric weight under TRIANGLE, else 1
  // What couples it with discs near it: the disc of its nodes, or two where it holds one disc against another. In the
  // constraint's frame.
  ContactDisc discs[2];
  // Of a patch: what its nodes and weights were computed from, to recognise it in the next step.
  SurfacePoint surface_point;
  double disc_radius;  // m; 0: not a patch
};

inline bool has_disc(const ContactConstraint& constraint) {
  return constraint.discs[0].radius > 0 || constraint.discs[1].radius > 0;
}

// A joined constraint holds its nodes along its first axis, though the row is another one's.
inline std::uint32_t held_axes(const ContactConstraint& constraint) {
  return constraint.joined ? 1u : constraint.axes;
}

// m, of one of its targets: those of a gradient have no unit, and move the rim of its disc by so much.
inline double metres_of(const ContactConstraint& constraint) {
  return length(constraint.discs[0].gradient) > 0 ? constraint.discs[0].radius : 1;
}

// m/N: displacement of a's disc along a's frame for a force on b's disc along b's frame, beyond what the mesh resolves.
inline Mat3 compliance_between(const ContactConstraint& a, const ContactConstraint& b) {
  Mat3 sum;
  for (const ContactDisc& of_a : a.discs)
    for (const ContactDisc& of_b : b.discs)
      if (of_a.radius > 0 && of_b.radius > 0) add_scaled(sum, 1, compliance_between(of_a, of_b));
  return sum;
}

// Whether a law may act otherwise than by holding.
inline bool may_give_way(const ContactConstraint& constraint) {
  return constraint.law == ContactLaw::unilateral || constraint.law == ContactLaw::coulomb || constraint.limit > 0;
}

// Of a friction or a reaction: nearer than this share of its limit it is at its limit.
constexpr double kAtLimit = 1e-9;
// How the law of a constraint acts otherwise than by holding, under the reactions r (N) along its frame: the one answer for all who ask.
struct GivesWay {
  bool released, slips, at_limit;
  bool any() const { return released || slips || at_limit; }
};
inline GivesWay gives_way(ContactLaw law, double friction, double limit, Vec3 r) {
  const bool rubs = law == ContactLaw::coulomb, may_release = rubs || law == ContactLaw::unilateral;
  return {may_release && !(r.x > 0), rubs && length({0, r.y, r.z}) >= friction * r.x * (1 - kAtLimit),
          limit > 0 && std::fabs(r.x) >= limit * (1 - kAtLimit)};
}
inline GivesWay gives_way(const ContactConstraint& constraint, Vec3 r) {
  return gives_way(constraint.law, constraint.friction, constraint.limit, r);
}

// Where a disc that slides meets the surface at rest, and what changes as its anchor moves (contact_rows.h).
struct DiscPlace {
  Vec3 at;       // m, the mean place of the disc's nodes
  Vec3 outward;  // unit, the surface's normal at rest
  Vec3 rise;     // of `at` along the normal per metre of the anchor's way
  Vec3 softer;   // 1/N, slope of the compliance along the normal that the mesh does not resolve
  std::int32_t known, unused;
};

// Fixed capacity; all arrays belong to the scene.
struct ContactConstraints {
  ContactNode* nodes = nullptr;              // [node_capacity]
  ContactConstraint* constraints = nullptr;  // [constraint_capacity]
  Vec3* target = nullptr;                    // [constraint_capacity] m, u* along each row; imposed axes only
  DiscPlace* place = nullptr;                // [constraint_capacity] where discs may slide
  Vec3* slope = nullptr;  // [node_capacity] 1/m, the same: of the weight, per metre of the anchor's way
  std::int32_t node_capacity = 0, constraint_capacity = 0, node_count = 0, constraint_count = 0;
};

// A row that several constraints share has no less than this share of the largest compliance that one of them has alone. Where they
// pull against one another in a straight line, no reaction brings them to the target.
constexpr double kLeastOfJoined = 1e-3;

// The number behind the last constraint that shares the rows of constraint p.
inline std::int32_t end_of_joined(const ContactConstraint* constraints, std::int32_t count, std::int32_t p) {
  for (++p; p < count && constraints[p].joined;) ++p;
  return p;
}
// m, of the rows of constraint p: its target, with those of the constraints that share its row.
inline Vec3 target_of_rows(const ContactConstraints& set, std::int32_t p) {
  Vec3 sum = set.target[p];
  for (std::int32_t q = p + 1; q < set.constraint_count && set.constraints[q].joined; ++q) sum.x += set.target[q].x;
  return sum;
}

}  // namespace palpate
