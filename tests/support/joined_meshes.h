// Meshes of several bodies that share a vertex, an edge, a face or nothing.
#pragma once

#include <algorithm>

#include "formats/tetrahedral_mesh.h"

namespace palpate::tests {

// Adds a shifted copy of `one`, with region 0 for all its tetrahedra. Coincident nodes are merged; all patches are removed.
inline void add_shifted(TetrahedralMesh& mesh, const TetrahedralMesh& one, const std::array<double, 3>& shift) {
  std::vector<std::int32_t> place;
  for (auto p : one.nodes) {
    for (std::size_t d = 0; d < 3; ++d) p[d] += shift[d];
    const auto at = std::find(mesh.nodes.begin(), mesh.nodes.end(), p);
    place.push_back(static_cast<std::int32_t>(at - mesh.nodes.begin()));
    if (at == mesh.nodes.end()) mesh.nodes.push_back(p);
  }
  for (auto t : one.tetrahedra) {
    for (auto& n : t) n = place[n];
    mesh.tetrahedra.push_back(t);
  }
  mesh.region.resize(mesh.tetrahedra.size(), 0);
  mesh.patches.clear();
}

}  // namespace palpate::tests
