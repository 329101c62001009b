// A mesh of a box: nx x ny x nz cells of six tetrahedra, one region, six named faces.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "formats/tetrahedral_mesh.h"

namespace palpate {

// size: in the mesh's unit. jitter: moves interior nodes by up to this share of a cell; equal arguments give equal meshes.
inline TetrahedralMesh box_mesh(std::array<int, 3> cells, std::array<double, 3> size, double jitter = 0.0) {
  TetrahedralMesh mesh;
  const int nx = cells[0], ny = cells[1], nz = cells[2];
  const auto node = [&](int i, int j, int k) { return i + (nx + 1) * (j + (ny + 1) * k); };
  const auto inside = [](int i, int n) { return i > 0 && i < n; };
  for (int k = 0; k <= nz; ++k)
    for (int j = 0; j <= ny; ++j)
      for (int i = 0; i <= nx; ++i) {
        std::array<double, 3> p = {size[0] * i / nx, size[1] * j / ny, size[2] * k / nz};
        if (inside(i, nx) && inside(j, ny) && inside(k, nz))
          for (int d = 0; d < 3; ++d)
            p[d] += jitter * size[d] / cells[d] * std::sin(12.9898 * (node(i, j, k) + 1) * (d + 1));
        mesh.nodes.push_back(p);
      }
  // Kuhn's subdivision: one tetrahedron for each permutation of the axes; all contain the cell's main diagonal.
  constexpr int permutations[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        for (int p = 0; p < 6; ++p) {
          std::array<int, 3> at = {i, j, k};
          std::array<std::int32_t, 4> t{};
          t[0] = node(at[0], at[1], at[2]);
          for (int step = 0; step < 3; ++step) {
            ++at[permutations[p][step]];
            t[step + 1] = node(at[0], at[1], at[2]);
          }
          if (p >= 3) std::swap(t[2], t[3]);  // odd permutations would have negative volume
          mesh.tetrahedra.push_back(t);
        }
  mesh.region.assign(mesh.tetrahedra.size(), 0);
  mesh.region_names = {"box"};
  const char* names[6] = {"x0", "x1", "y0", "y1", "z0", "z1"};
  for (int face = 0; face < 6; ++face) {
    TetrahedralMesh::Patch patch{names[face], {}};
    const int axis = face / 2;
    const double at = face % 2 ? size[axis] : 0.0;
    for (const auto& triangle : boundary_triangles(mesh)) {
      bool on = true;
      for (const auto n : triangle) on = on && std::abs(mesh.nodes[n][axis] - at) <= 1e-12 * size[axis];
      if (on) patch.triangles.push_back(triangle);
    }
    mesh.patches.push_back(patch);
  }
  return mesh;
}

}  // namespace palpate
