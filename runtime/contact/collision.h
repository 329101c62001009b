// Which tool points are in contact, and with which surface point.
//
// Every tool point has a state, inside or outside the organ, that changes only where its motion crosses the surface, so that
// no motion is missed however fast the point is. All tests use the closed surface at rest. Where the scene follows the
// deformed surface, the tool point is first pulled back: the displacement of the nearest point of the deformed surface is
// subtracted, so that the pulled-back point lies to the rest surface as the tool point lies to the deformed one. A surface
// that moves over a resting tool point then moves the pulled-back point through the rest surface, and the same test finds
// both kinds of crossing.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/tensors.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/surface/surface_index.h"

namespace palpate {

// One tool point from step to step.
struct PointState {
  bool known = false;    // seen in an earlier step
  bool inside = false;   // of the surface, in the last step
  bool contact = false;  // the point holds its anchor
  bool through = false;  // in contact, and out again on the far side of a thin part
  Vec3 pulled;           // m, last position, pulled back
  SurfacePoint anchor;   // the surface point that the tool point holds
  Vec3 anchor_at_rest;   // m
  Vec3 outward;          // unit normal of the anchor's triangle at rest
  Vec3 tangent;          // of the contact's frame; turns with the surface as the anchor moves; zero: none yet
};

// The displacement field that the contacts of the last solve produce, evaluated at single nodes (eq. 9 of the paper).
class ContactField {
 public:
  bool create(SceneMemory& memory, std::int32_t node_capacity, std::int32_t surface_nodes);
  void clear() { count_ = 0; }
  // solver: has solved these constraints; predict_without() asks it later.
  void set(const Tensors& tensors, const ContactConstraints& set, const Vec3* modified, ContactSolver* solver);
  bool empty() const { return count_ == 0; }
  // Removes the part of the contact (tool, point) from the field until the next set().
  void drop(std::int32_t tool, std::int32_t point);

  // Displacement of a surface node, m. The field remembers it until the next set().
  Vec3 at_node(std::int32_t node);
  // The same without the part of the contact (tool, point).
  Vec3 at_node_without(std::int32_t node, std::int32_t tool, std::int32_t point) const;

  // Predicts the field as if the contact (tool, point) ended and all others kept their targets and laws; predicted_at_node()
  // then reads it. False where the prediction is not possible, because drop() has changed the field.
  bool predict_without(std::int32_t tool, std::int32_t point);
  Vec3 predicted_at_node(std::int32_t node) const;
  // m, the largest displacement that a contact imposes; no node moves much farther.
  double largest() const { return largest_; }

 private:
  struct Range {
    std::int32_t first, last;
  };
  Range nodes_of(std::int32_t tool, std::int32_t point) const;
  void forget_nodes();
  Vec3 sum(std::int32_t first, std::int32_t last, std::int32_t node) const;
  Tensors tensors_;
  ContactNode* nodes_ = nullptr;
  Vec3 *modified_ = nullptr, *predicted_ = nullptr;
  ContactSolver* solver_ = nullptr;  // nullptr after drop()
  const void** row_ = nullptr;       // [nodes][3] stored displacement rows; unused with a stored compliance
  double* coefficient_ = nullptr;    // [nodes][3] m, of each row
  std::int32_t count_ = 0;
  double largest_ = 0;
  Vec3* known_ = nullptr;  // [surface_nodes]
  std::uint32_t* known_stamp_ = nullptr;
  std::uint32_t stamp_ = 0;
  std::int32_t surface_nodes_ = 0;
};

class Collision {
 public:
  // deformed: follow the field, else the rest surface. surface, triangles and field are borrowed.
  void create(SurfaceIndex* surface, const std::int32_t* triangles, ContactField* field, bool deformed);

  // Moves one tool point to p (m) and updates its state. hold: a contact does not end. Cost: microseconds; grows with the
  // buckets along the motion.
  void move(PointState& state, Vec3 p, std::int32_t tool, std::int32_t point, bool hold);

  // Moves the anchor to the point of the rest surface that is nearest to p. The search walks over the surface from the old
  // anchor, so the anchor does not change to the other side of a thin part. Cost: a few microseconds.
  void slide(PointState& state, Vec3 p);
  // Moves the anchor towards the point of the deformed surface that is nearest to the tool point p.
  void follow(PointState& state, Vec3 p, std::int32_t tool, std::int32_t point);

 private:
  Vec3 pull_back(const PointState& state, Vec3 p, std::int32_t tool, std::int32_t point);
  Vec3 pull_back_free(Vec3 p);
  template <class AtNode>
  Vec3 at_surface_point(const SurfacePoint& surface_point, AtNode at_node) const;
  void look_for_contact(PointState& state, Vec3 from, Vec3 to, bool now_inside);
  void look_for_release(PointState& state, Vec3 from, Vec3 to, bool now_inside, bool hold);
  void begin_contact(PointState& state, const SurfacePoint& surface_point, bool through);
  bool nearest_surface_point(Vec3 p, SurfacePoint* surface_point);

  SurfaceIndex* surface_ = nullptr;
  const std::int32_t* triangles_ = nullptr;
  ContactField* field_ = nullptr;
  bool deformed_ = false;
};

}  // namespace palpate
