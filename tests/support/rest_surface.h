// The queries of collision on a surface that a test makes, at rest.
#pragma once

#include "runtime/contact/deformed_surface.h"

namespace palpate::tests {

class RestSurface {
 public:
  // position: [nodes][3] m; triangles: [triangle_count][3]. Both are borrowed.
  RestSurface(const double* position, std::int32_t nodes, const std::int32_t* triangles, std::int32_t triangle_count)
      : memory_(palpate_allocator{}) {
    if (!tree_.build(memory_, position, nodes, triangles, triangle_count)) throw std::bad_alloc();
    surface_.create(memory_, &tree_, nullptr, nullptr);
  }
  RestSurface(const RestSurface&) = delete;
  ~RestSurface() { memory_.release_all(); }

  bool inside(Vec3 p) { return surface_.is_inside({}, p); }
  int crossings(Vec3 a, Vec3 b, SurfaceCrossing* found) { return surface_.crossings(a, b, found); }
  int crossings(Vec3 a, Vec3 b) {
    SurfaceCrossing found[DeformedSurface::kMaxCrossings];
    return crossings(a, b, found);
  }
  double distance(Vec3 p) { return surface_.nearest({}, p, INFINITY).distance; }

 private:
  SceneMemory memory_;
  SurfaceTree tree_;
  DeformedSurface surface_;
};

}  // namespace palpate::tests
