// Turns meshes into elastic bodies: gives each region a material, and holds nodes.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "studies/bodies/box_mesh.h"

namespace palpate {

// The mesh as a body in metres (mesh unit: m), nothing held, everything touchable.
inline ElasticBody body_of(const TetrahedralMesh& mesh, const std::vector<Material>& materials) {
  OrganConfig organ;
  for (std::size_t r = 0; r < mesh.region_names.size(); ++r)
    organ.regions.push_back({mesh.region_names[r], {materials[r].young, "test"}, {materials[r].poisson, "test"}, {}});
  return make_elastic_body(mesh, organ, {}, {});
}

// Holds, at every node, the dofs in the bits of which(point): 1, 2, 4 for x, y, z. Then lists the touchable nodes anew.
inline void hold(ElasticBody& body, const std::function<int(const std::array<double, 3>&)>& which) {
  body.touchable.clear();
  for (std::size_t n = 0; n < body.nodes.size(); ++n) {
    const int dofs = which(body.nodes[n]);
    for (int d = 0; d < 3; ++d) body.fixed[n][d] |= static_cast<std::uint8_t>((dofs >> d) & 1);
    const auto& f = body.fixed[n];
    if (static_cast<std::int32_t>(n) < body.surface_count && !(f[0] && f[1] && f[2]))
      body.touchable.push_back(static_cast<std::int32_t>(n));
  }
}
inline ElasticBody held_body(const TetrahedralMesh& mesh, const std::vector<Material>& materials,
                             const std::function<int(const std::array<double, 3>&)>& which) {
  ElasticBody body = body_of(mesh, materials);
  hold(body, which);
  return body;
}

// For hold: the faces of the unit cube; and each of the planes through the origin across itself, for a part that is symmetric to them.
inline int faces_of_unit_cube(const std::array<double, 3>& p) {
  return std::ranges::any_of(p, [](double x) { return x == 0 || x == 1; }) ? 7 : 0;
}
inline int across_symmetry_planes(const std::array<double, 3>& p) {
  return (p[0] == 0 ? 1 : 0) | (p[1] == 0 ? 2 : 0) | (p[2] == 0 ? 4 : 0);
}

}  // namespace palpate
