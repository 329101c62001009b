// Finds the point of a triangle surface that is nearest to a given point.
#pragma once

#include <memory>

#include "meshing/surface/triangle_surface.h"

namespace palpate {

class NearestPoint {
 public:
  // Builds a tree of the triangles, leaving out flat ones; at least one must not be flat. The triangles need not form a
  // manifold.
  explicit NearestPoint(const TriangleSurface& surface);
  ~NearestPoint();
  NearestPoint(const NearestPoint&) = delete;
  NearestPoint& operator=(const NearestPoint&) = delete;
  Point operator()(const Point& p) const;

 private:
  struct Tree;
  std::unique_ptr<const Tree> tree_;
};

}  // namespace palpate
