// Which tool points hold the organ, and where: inside or outside is a state of each point that no step can skip.
//
// Everything is decided on the closed rest surface. When the surface is deformed, each tool point is first pulled back:
// the displacement of the place of the deformed surface nearest to it is taken off, so that it stands to the rest
// surface as it really stands to the deformed one. A surface that moves over a resting point then moves the pulled-back
// point through the rest surface, and the same test finds both kinds of crossing.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/tensors.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/surface/surface_index.h"

namespace palpate {

struct PointState {
  bool known = false;    // seen in an earlier step
  bool inside = false;   // of the surface, where it was last seen
  bool contact = false;  // holds `place`
  bool through = false;  // in contact, and out again on the far side of a thin part
  Vec3 pulled;           // last position, pulled back
  SurfacePlace place;
  Vec3 place_at_rest, outward;
  Vec3 tangent;  // of the contact's frame: turns with the surface as the place moves; zero: none yet
};

// The displacement field that the contacts of the last solve make, evaluated at single nodes.
class ContactField {
 public:
  bool create(SceneMemory& memory, std::int32_t entry_capacity, std::int32_t surface_nodes);
  void clear() { count_ = 0; }
  // solver: has solved the set; asked later what it would be without a contact.
  void set(const Tensors& tensors, const ContactSet& set, const Vec3* modified, ContactSolver* solver);
  bool empty() const { return count_ == 0; }
  // Without what the contact (tool, point) does, from now on.
  void drop(std::int32_t tool, std::int32_t point);

  // Displacement of a surface node, m; remembered until the next set().
  Vec3 at_node(std::int32_t node);
  // The same without what the contact (tool, point) itself does.
  Vec3 at_node_without(std::int32_t node, std::int32_t tool, std::int32_t point) const;

  // The field as it would be if the contact were gone and the others held what they hold: with it at_node_if_gone. False where
  // that is not known: another contact was dropped.
  bool let_go(std::int32_t tool, std::int32_t point);
  Vec3 at_node_if_gone(std::int32_t node) const;
  // About the largest displacement: the largest that a contact imposes, m.
  double largest() const { return largest_; }

 private:
  struct Range {
    std::int32_t first, last;
  };
  Range entries_of(std::int32_t tool, std::int32_t point) const;
  void forget_nodes();
  Vec3 sum(std::int32_t first, std::int32_t last, std::int32_t node) const;
  Tensors tensors_;
  ContactEntry* entries_ = nullptr;
  Vec3 *modified_ = nullptr, *if_gone_ = nullptr;
  ContactSolver* solver_ = nullptr;  // nullptr: a contact was dropped
  const void** row_ = nullptr;       // [entries][3] of the surface's displacements, where they are stored as rows
  double* coefficient_ = nullptr;    // [entries][3] m, of each row
  std::int32_t count_ = 0;
  double largest_ = 0;
  Vec3* known_ = nullptr;  // [surface_nodes]
  std::uint32_t* known_stamp_ = nullptr;
  std::uint32_t stamp_ = 0;
  std::int32_t surface_nodes_ = 0;
};

class Collision {
 public:
  // deformed: follow the field; otherwise the rest surface. surface and triangles are borrowed.
  void create(SurfaceIndex* surface, const std::int32_t* triangles, ContactField* field, bool deformed);

  // Moves one tool point to p and updates its state. Cost: microseconds; grows with the buckets along the motion.
  void move(PointState& state, Vec3 p, std::int32_t tool, std::int32_t point, bool hold);

  // Moves the place that is held to the place of the rest surface nearest to p, going over the surface from where it is:
  // it does not change sides. Cost: a few microseconds.
  void slide(PointState& state, Vec3 p);
  // Moves the place that is held towards the one under the tool point, which is at p, as the contacts have left the surface.
  void follow(PointState& state, Vec3 p, std::int32_t tool, std::int32_t point);

 private:
  Vec3 pull_back(const PointState& state, Vec3 p, std::int32_t tool, std::int32_t point);
  Vec3 pull_back_free(Vec3 p);
  template <class AtNode>
  Vec3 at_place(const SurfacePlace& place, AtNode at_node) const;
  void look_for_contact(PointState& state, Vec3 from, Vec3 to, bool now_inside);
  void look_for_release(PointState& state, Vec3 from, Vec3 to, bool now_inside, bool hold);
  void hold_place(PointState& state, const SurfacePlace& place, bool through);
  bool nearest_place(Vec3 p, SurfacePlace* place);

  SurfaceIndex* surface_ = nullptr;
  const std::int32_t* triangles_ = nullptr;
  ContactField* field_ = nullptr;
  bool deformed_ = false;
};

}  // namespace palpate
