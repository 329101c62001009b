// Fills the prisms between layers of nodes with three tetrahedra each: for cylinders and shells.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "formats/tetrahedral_mesh.h"

namespace palpate {

// Fills mesh.tetrahedra between layer and layer + 1 for each of `layers`. triangles: of the first layer; mesh.nodes holds
// layers + 1 layers of nodes_per_layer nodes, each in the order of the first.
inline void fill_layers(const std::vector<std::array<std::int32_t, 3>>& triangles, std::int32_t nodes_per_layer,
                        int layers, TetrahedralMesh& mesh) {
  using Eigen::Vector3d;
  for (int layer = 0; layer < layers; ++layer)
    for (auto t : triangles) {
      std::sort(t.begin(), t.end());  // the same diagonal on both sides of every side face
      const std::int32_t low = nodes_per_layer * layer, high = low + nodes_per_layer;
      for (std::array<std::int32_t, 4> e : {std::array{low + t[0], low + t[1], low + t[2], high + t[2]},
                                            std::array{low + t[0], low + t[1], high + t[1], high + t[2]},
                                            std::array{low + t[0], high + t[0], high + t[1], high + t[2]}}) {
        const auto edge = [&](int v) {
          return Vector3d(Vector3d(mesh.nodes[e[v]].data()) - Vector3d(mesh.nodes[e[0]].data()));
        };
        if (edge(1).cross(edge(2)).dot(edge(3)) < 0) std::swap(e[2], e[3]);
        mesh.tetrahedra.push_back(e);
      }
    }
}

}  // namespace palpate
