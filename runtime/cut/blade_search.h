// Which faces a blade passes in a step: those whose two tetrahedra have their centroids on different sides of the surface that the blade's
// line sweeps, where the segment between the centroids crosses this surface.
//
// The tetrahedra are sorted along a curve that fills space and lie in clusters of 64. A step computes the box of each cluster from the
// positions of its nodes, and looks at the tetrahedra of those clusters whose box the sweep may meet.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/cut/cut_state.h"

namespace palpate {

// A line of points that moves from one place to another; between them lie two triangles for each of its segments.
struct BladeSweep {
  const double *from = nullptr, *to = nullptr;  // [count][3] m
  std::int32_t count = 0;                       // 2 points or more
};

class BladeSearch {
 public:
  // nodes: of the corners [tetrahedra][4], as they are now; it may change, and there may be most_nodes. False where memory ends.
  bool create(SceneMemory& memory, const CutState& state, const std::int32_t* nodes, std::int32_t most_nodes);
  // All corners may have other nodes.
  void forget();
  // To be called when a corner of the tetrahedron has another node.
  void changed(std::int32_t tetrahedron);

  // Calls found(face) for each face that is passed and not open. positions: of the nodes, m.
  template <class Found>
  void passed(const BladeSweep& sweep, const double* positions, const Found& found) {
    for (std::int32_t i = 0; i + 1 < sweep.count; ++i) {
      const Strip strip(sweep, i);
      near(strip, positions, [&](std::int32_t tetrahedron) {
        const Vec3 middle = centroid(tetrahedron, positions);
        for (std::int32_t face = 4 * tetrahedron; face < 4 * tetrahedron + 4; ++face)
          if (const std::int32_t beyond = state_->rest().neighbour(face);
              beyond > tetrahedron && !state_->open(face) && strip.crosses(middle, centroid(beyond, positions)))
            found(face);
      });
    }
  }
  // Calls found(tetrahedron, square of the distance) for each tetrahedron that is left whose centroid lies in the ball.
  template <class Found>
  void inside_ball(Vec3 centre, double radius, const double* positions, const Found& found) {
    const Vec3 around{radius, radius, radius};
    near(Box{centre - around, centre + around}, positions, [&](std::int32_t tetrahedron) {
      const Vec3 away = centroid(tetrahedron, positions) - centre;
      if (dot(away, away) <= radius * radius) found(tetrahedron, dot(away, away));
    });
  }
  // Whether the sweep may meet the box of the two tetrahedra of a face. positions: of the first `known` nodes; later ones are where those of which they
  // were split are.
  bool reaches(const BladeSweep& sweep, std::int32_t face, const double* positions, const std::int32_t* split_from,
               std::int32_t known) const;

 private:
  static constexpr std::int32_t kCluster = 64, kMostNodes = 8 * kCluster;
  struct Box {
    Vec3 low, high;
    void add(Vec3 p);
    bool meets(const Box& other) const;
  };
  // What one segment of the blade sweeps: two triangles.
  struct Strip {
    Strip(const BladeSweep& sweep, std::int32_t segment);
    bool meets(const Box& box) const;  // false: certainly not
    bool crosses(Vec3 p, Vec3 q) const;
    Vec3 from[2], to[2];
    Box box;
    Vec3 middle, half;         // of the segment where it ends
    Vec3 moved;                // how far it has moved, along each axis
    Vec3 normal;               // across the strip
    double level, half_level;  // of the strip along the normal
  };
  Vec3 centroid(std::int32_t tetrahedron, const double* positions) const;
  void sort_tetrahedra(std::uint64_t* keys);
  void list_nodes(std::int32_t cluster);
  Box box_of_cluster(std::int32_t cluster, const double* positions);

  template <class Region, class Found>
  void near(const Region& region, const double* positions, const Found& found) {
    for (std::int32_t cluster = 0; cluster < clusters_; ++cluster) {
      if (!region.meets(box_of_cluster(cluster, positions))) continue;
      const std::int32_t end = cluster + 1 < clusters_ ? kCluster * (cluster + 1) : state_->rest().tetrahedra();
      for (std::int32_t i = kCluster * cluster; i < end; ++i)
        if (!state_->gone(order_[i])) found(order_[i]);
    }
  }

  const CutState* state_ = nullptr;
  const std::int32_t* nodes_ = nullptr;
  std::int32_t clusters_ = 0;
  std::int32_t* order_ = nullptr;       // [tetrahedra]: kCluster after kCluster
  std::int32_t* cluster_of_ = nullptr;  // [tetrahedra]
  std::uint64_t* stale_ = nullptr;      // [clusters / 64 + 1]: a bit of each cluster whose nodes must be listed anew
  std::int32_t* listed_ =
      nullptr;  // [clusters][kMostNodes]: nodes of a cluster and of the neighbours of its tetrahedra
  std::int32_t* listed_count_ = nullptr;  // [clusters]
  std::uint32_t* seen_ = nullptr;         // by node: the list in which it stands
  std::uint32_t lists_ = 0;
};

}  // namespace palpate
