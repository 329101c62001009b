// Which tetrahedron a place at rest lies in: a tree of boxes.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"

namespace palpate {

// Borrowed by the tree.
struct TetrahedronGeometry {
  const double* nodes = nullptr;             // [node_count][3] m
  const std::int32_t* tetrahedra = nullptr;  // [tetrahedron_count][4], checked
  std::int32_t tetrahedron_count = 0;
};

class TetrahedronTree {
 public:
  struct Found {
    std::int32_t tetrahedron = -1;  // -1: none is as near as was asked
    double weight[4] = {};          // of its nodes; they sum to 1. For a place outside, one or more is below 0
    double distance = 0;            // m, from the tetrahedron; 0 inside
  };

  // False where memory ends. Cost: E log E.
  bool create(SceneMemory& memory, const TetrahedronGeometry& geometry);
  // The nearest tetrahedron, if it is within `farthest` m; of several, the first one. p: finite. Any thread may call it. Cost: about
  // the logarithm of E inside of the mesh; a place far outside looks at more.
  Found nearest(Vec3 p, double farthest) const;

 private:
  struct Box {
    double low[3], high[3];
    std::int32_t first, last;  // of order_
    std::int32_t child;        // of two that follow one another; 0: a leaf
    std::int32_t unused;
  };
  void split(std::int32_t box, const double* middle);
  double distance_from_box(const Box& box, Vec3 p) const;
  void measure(std::int32_t tetrahedron, Vec3 p, Found* found) const;
  Vec3 corner(std::int32_t tetrahedron, int c) const;

  TetrahedronGeometry geometry_;
  Box* boxes_ = nullptr;
  std::int32_t* order_ = nullptr;  // [tetrahedron_count]
  std::int32_t box_count_ = 0;
};

}  // namespace palpate
