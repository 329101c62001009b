// The surface of an organ as other organs meet it: between its nodes it is taken as smooth where its triangles turn little.
#pragma once

#include <cstdint>

#include "runtime/surface/surface_tree.h"

namespace palpate {

class OrganSurface {
 public:
  // tree: of the organ's own triangles, borrowed. Memory: 32 bytes for each node.
  bool create(SceneMemory& memory, const SurfaceTree* tree);

  // Of a node, at rest: the mean of its triangles' normals, by their areas; zero where they cancel.
  Vec3 normal(std::int32_t node) const { return normal_[node]; }
  // m^2, a node's share of the surface.
  double area(std::int32_t node) const { return area_[node]; }

  struct Smooth {
    Vec3 normal;       // unit, outward, at rest
    double bulge = 0;  // m, by how much the smooth surface lies outside of the triangle there
  };
  // Exact to second order in the edge over the radius of curvature: a point on a chord lies half as far below the surface as the tangents at
  // its ends lie above it. A corner whose normal differs from the triangle's by more than 25 degrees lies on an edge of the organ and
  // counts as flat.
  Smooth at(const SurfacePoint& place) const;

 private:
  const SurfaceTree* tree_ = nullptr;
  Vec3* normal_ = nullptr;  // [nodes]
  double* area_ = nullptr;  // [nodes]
};

}  // namespace palpate
