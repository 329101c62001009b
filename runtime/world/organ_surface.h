// The surface of an organ as other organs meet it: between its nodes it is taken as smooth where its triangles turn little.
#pragma once

#include <cstdint>

#include "runtime/scene/scene.h"

namespace palpate {

class OrganSurface {
 public:
  // organ: borrowed. Memory: 64 bytes for each node; where tools meet a bound surface, also a tree of the mesh's own triangles.
  bool create(SceneMemory& memory, palpate_scene& organ);
  void forget();

  // Of the mesh's own triangles.
  const SurfaceTree& tree() const { return *tree_; }
  DeformedSurface& deformed() const { return *deformed_; }

  // Of a node, at rest: the mean of its triangles' normals, by their areas; zero where they cancel.
  Vec3 normal(std::int32_t node) const { return normal_[node]; }
  // m^2, a node's share of the surface.
  double area(std::int32_t node) const { return area_[node]; }

  // m, by how much the smooth surface lies outside of the triangle at a place, at rest. Exact to second order in the edge over the radius of
  // curvature: a point on a chord lies half as far below the surface as the tangents at its ends lie above it.
  double bulge(const SurfacePoint& place) const;
  // Unit, outward, at a place of the deformed surface: between the normals of its corners. flat: of its triangle now. Where corners are
  // not evaluated yet in this step, each of their triangles is looked at.
  Vec3 normal(const SurfacePoint& place, Vec3 flat);
  // The surface has moved: what was evaluated of it is forgotten. Where its triangles have changed, it is measured anew.
  void begin_step();

 private:
  // A corner whose normal at rest differs from its triangle's by more than 25 degrees lies on an edge of the organ and counts as flat.
  void measure();
  bool is_smooth(std::int32_t corner, Vec3 flat_at_rest) const;

  const TouchedSurface* touched_ = nullptr;
  std::uint64_t version_ = 0;  // of the surface, when it was measured
  SurfaceTree* tree_ = nullptr;
  DeformedSurface* deformed_ = nullptr;
  SurfaceTree own_tree_;
  DeformedSurface own_deformed_;
  Vec3* normal_ = nullptr;  // [nodes]
  double* area_ = nullptr;  // [nodes]
  // Normals that were evaluated in this step:
  Vec3* now_ = nullptr;            // [nodes]
  std::uint64_t* seen_ = nullptr;  // [nodes] in which step
  std::uint64_t step_ = 1;
};

}  // namespace palpate
