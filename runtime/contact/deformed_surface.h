// The organ's surface as the contacts of the last solve have deformed it, or at rest where a scene does not follow them.
#pragma once

#include <cstdint>

#include "runtime/contact/surface_field.h"
#include "runtime/contact/touchable_disc.h"
#include "runtime/surface/bound_surface.h"
#include "runtime/surface/surface_tree.h"

namespace palpate {

// Where and when a moving point passes through the surface.
struct SurfaceCrossing {
  SurfacePoint surface_point;
  double time = 0;  // 0 where the point was, 1 where it is
  bool entering = false;
};

// Which surface is asked about: as it is now; now without what the contact itself does; as
// SurfaceField::predict_without() has predicted it.
struct AskedSurface {
  enum Kind { kNow, kWithout, kPredicted } kind = kNow;
  ContactId contact;
};

// A query may end before it is finished, where it has reached the limit of limit_work(). finished() then tells it, and its answer has
// no meaning.
class DeformedSurface {
 public:
  static constexpr int kMaxCrossings = 32;

  // field: nullptr for the surface at rest. bound: the surface of the tree, where that is not the mesh's, else nullptr. All are
  // borrowed. False where there is no memory.
  bool create(SceneMemory& memory, SurfaceTree* tree, SurfaceField* field, const BoundSurface* bound);
  // Beside create(), where tools have discs.
  void meet_discs(const DiscSource& source) { discs_ = source; }

  const SurfaceTree& tree() const { return *tree_; }
  bool follows() const { return field_ != nullptr; }

  // The nearest point of the surface, within `within` metres. Cost: some ten triangles where the surface is near or does not move;
  // each node that is not yet evaluated in this step reads 3 numbers per contact node. likely: a triangle that has the point or lies near it, so
  // that fewer others are looked at; -1: none is known.
  NearestPoint nearest(const AskedSurface& asked, Vec3 p, double within, std::int32_t likely = -1);

  // Whether p is inside: its winding number is above zero, so that a place where the surface overlaps itself is inside. By the
  // triangles along a ray; exact signs decide. Cost: as nearest(), of all nodes near the ray.
  bool is_inside(const AskedSurface& asked, Vec3 p);

  // The crossings of a point that moves from `from` to `to` while the surface moves from where it was before the last solve to
  // where it is now, in order of time. Returns their number; the first kMaxCrossings are stored. A crossing through an edge may
  // count for both of its triangles.
  int crossings(Vec3 from, Vec3 to, SurfaceCrossing* found);

  // m: how far any point of the surface may have moved since the last solve but one; of the surface without a contact.
  double largest_move() const;
  // m: how far any point of the surface is from where it rests, now or before the last solve.
  double farthest_from_rest() const;
  // Whether a point lies in the box around the surface as it is and was before the last solve. margin: m, more.
  bool may_hold(Vec3 low, Vec3 high, double margin = 0) const;
  double largest_move_without(const ContactId& id) const;
  // sqrt(J): grows with every change of the surface (NearestPoint::per_path).
  double path() const { return field_ ? field_->path() : 0; }

  // m, the displacement of a surface point.
  Vec3 displacement(const AskedSurface& asked, const SurfacePoint& surface_point);
  // m: how far the surface that a disc meets at a surface point is from that point, at rest as there. The disc meets the mean of the surface
  // below it, and other discs move that beyond what the mesh shows (disc_compliance.h). So its contact has no force where it
  // begins. *lacks_nodes: the disc has held nodes, too, which its row leaves out. Cost: some microseconds.
  Vec3 below_disc(const AskedSurface& asked, const SurfacePoint& surface_point, double radius, bool* lacks_nodes);
  // Whether it may be other than zero, for the disc of a contact.
  bool may_sink(const ContactId& id) const { return discs_.patch && deepest_but(id) > 0; }
  // m, its bound, and a bound for its changes as long as the disc stays (SurfaceField).
  double deepest_but(const ContactId& id) const { return field_ ? field_->deepest_but(id) : 0; }
  double sum_of_changes() const { return field_ ? field_->sum_of_changes() : 0; }
  // m, where the corners of a triangle are now.
  void corners(std::int32_t triangle, Vec3 corner[3]);
  // Unit, outward, of a node now: the mean of its triangles' normals, by their areas; zero where they cancel.
  Vec3 normal(std::int32_t node);
  // m, the displacement of a surface point by the offset alone.
  Vec3 moved(const SurfacePoint& surface_point);

  // What the queries have cost since the last call; there is no limit any more.
  Operations take_work();
  // From now on queries end where they would cost more than that, all since the last take_work() together, but for overshoot().
  void limit_work(Operations most) { work_.limit(most); }
  Operations work_left() const { return work_.left(); }
  void end_work() { work_.end(); }
  // What a query may take after it has come to its limit: the triangles of one leaf, or those around a node.
  Operations overshoot() const;
  bool finished() const { return !work_.ended(); }
  void add_work(Operations operations) { work_.add(operations); }

 private:
  bool moves() const { return field_ && !field_->empty(); }
  template <class Run>
  auto with_field(const AskedSurface& asked, Run run);
  FieldBound bound_of(const AskedSurface& asked) const;
  // Displacements of a bound surface's vertices that a query has evaluated: its triangles share them.
  struct Known {
    Vec3* at = nullptr;              // [vertices] m
    std::uint32_t* stamp = nullptr;  // [vertices] of the query
  };
  void begin_query();
  // Of a vertex of the tree's surface. at(node): of a node of the mesh.
  template <class At>
  Vec3 displacement_at(std::int32_t vertex, At at);
  Vec3 displacement_of(const AskedSurface& asked, std::int32_t vertex);
  Vec3 at_node(const AskedSurface& asked, std::int32_t node);
  Vec3 place(const AskedSurface& asked, std::int32_t vertex) {
    return tree_->at_rest(vertex) + displacement_of(asked, vertex);
  }
  template <class Visit>
  void meet(const AskedSurface& asked, Vec3 low, Vec3 high, const FieldBound& bound, Visit visit);

  SurfaceTree* tree_ = nullptr;
  SurfaceField* field_ = nullptr;
  const BoundSurface* bound_ = nullptr;
  DiscSource discs_ = {};
  Known known_now_, known_asked_;  // of the surface as it is now; of another one that is asked about
  std::uint32_t query_ = 0;
  QueryWork work_;
};

}  // namespace palpate
