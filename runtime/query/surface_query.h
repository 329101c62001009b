// Rays and nearest points on the surface as the contacts of a step deform it, for a mouse or for navigation. The queries have a tree
// and a field of their own, so they change nothing in a touch step and may run beside it.
#pragma once

#include <cstdint>

#include "runtime/query/queried_field.h"
#include "runtime/surface/bound_surface.h"
#include "runtime/surface/surface_tree.h"

namespace palpate {

struct SurfaceHit {
  SurfacePoint surface_point;
  Vec3 point, outward;  // m; unit normal of the triangle, or zero where it has no area
  double distance = 0;  // m
};

class SurfaceQuery {
 public:
  // After its tree was built. The arguments are those of QueriedField::create; fine: the surface of the tree, where that is not the
  // mesh's, else nullptr. tensors and fine are borrowed, too.
  bool create(SceneMemory& memory, const Tensors* tensors, const std::int32_t* touchable, std::int32_t node_capacity,
              const BoundSurface* fine, bool large, double added_reach, const OffsetRows& motions, double moved_reach);
  SurfaceTree& tree() { return tree_; }

  // The following queries see the surface of these contacts, as QueriedField::set says.
  std::uint32_t set(const palpate_contacts* contacts) { return field_.set(*tensors_, contacts); }

  // The first crossing of a ray through the surface, from either side, within `longest` metres. along: of unit length.
  bool cast_ray(Vec3 origin, Vec3 along, double longest, SurfaceHit* hit);
  // The nearest surface point that is nearer than `farthest` metres.
  bool closest(Vec3 p, double farthest, SurfaceHit* hit);
  // Of the mesh: the surface point itself, or the one below it on the fine surface.
  SurfacePoint on_mesh(const SurfacePoint& surface_point) const {
    return fine_ ? fine_->beneath(surface_point) : surface_point;
  }
  // m, below zero inside. INFINITY for a surface without triangles.
  double signed_distance(Vec3 p);

 private:
  Vec3 place(std::int32_t vertex) {
    const auto at_node = [&](std::int32_t node) { return field_.at_node(node); };
    return tree_.at_rest(vertex) + (fine_ ? fine_->displacement(vertex, at_node) : at_node(vertex));
  }
  template <class Visit>
  void meet(Vec3 low, Vec3 high, Visit visit);
  bool clip(Vec3 origin, Vec3 along, double* first, double* last) const;

  const Tensors* tensors_ = nullptr;
  const BoundSurface* fine_ = nullptr;
  SurfaceTree tree_;
  QueriedField field_;
};

}  // namespace palpate
