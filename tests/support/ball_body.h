// A ball of tetrahedra.
#pragma once

#include <cmath>

#include "tests/support/grid_body.h"

namespace palpate::tests {

// Around the origin: a cube of so many cells to a side, pulled onto the ball, and held where the cube's face of least z was. Its edges on
// the surface are about 1.6 / cells of the radius long.
inline DenseBody dense_ball(double radius, int cells, double young = 5400) {
  GridBody cube;
  for (auto& lines : cube.lines) lines = grid_lines(-1, 1, cells);
  cube.held = [](auto p) { return p[2] == -1; };
  cube.young = young;
  DenseBody made = dense_grid(cube);
  for (auto& p : made.body.mesh.nodes) {
    const double x = p[0] * p[0], y = p[1] * p[1], z = p[2] * p[2];
    p[0] *= radius * std::sqrt(1 - y / 2 - z / 2 + y * z / 3);
    p[1] *= radius * std::sqrt(1 - z / 2 - x / 2 + z * x / 3);
    p[2] *= radius * std::sqrt(1 - x / 2 - y / 2 + x * y / 3);
  }
  made.interior = true;
  return made;
}

}  // namespace palpate::tests
