// A mesh of an eighth of a thick sphere.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <vector>

#include "tests/support/layered_tetrahedra.h"

namespace palpate::tests {

// One octant of the shell a <= r <= b: an n-fold triangulation of the octant, extruded in n layers of prisms whose
// thickness grows with the radius.
inline TetrahedralMesh shell_octant(double a, double b, int n) {
  using Eigen::Vector3d;
  TetrahedralMesh mesh;
  std::vector<Vector3d> directions;
  std::vector<std::array<std::int32_t, 3>> triangles;
  const auto place = [n](int i, int j) { return i * (n + 1) - i * (i - 1) / 2 + j; };  // i + j <= n
  for (int i = 0; i <= n; ++i)
    for (int j = 0; i + j <= n; ++j) {
      directions.push_back(Vector3d(i, j, n - i - j).normalized());
      if (i + j < n) triangles.push_back({place(i, j), place(i + 1, j), place(i, j + 1)});
      if (i + j < n - 1) triangles.push_back({place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)});
    }
  const auto count = static_cast<std::int32_t>(directions.size());
  for (int layer = 0; layer <= n; ++layer)
    for (const auto& direction : directions) {
      const Vector3d p = a * std::pow(b / a, static_cast<double>(layer) / n) * direction;
      mesh.nodes.push_back({p[0], p[1], p[2]});
    }
  fill_layers(triangles, count, n, mesh);
  mesh.region.assign(mesh.tetrahedra.size(), 0);
  mesh.region_names = {"shell"};
  return mesh;
}

}  // namespace palpate::tests
