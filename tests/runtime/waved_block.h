// A block whose top bulges and has waves, and whose side overhangs what holds it: its compliance and its normals differ from place to place.
// Edges of 10 mm.
#pragma once

#include <cmath>

#include "tests/support/grid_body.h"

namespace palpate::tests {

// width, height: m.
inline DenseBody waved_grid(double width, double height) {
  GridBody grid;
  grid.lines = {grid_lines(0, width, 6), grid_lines(0, width, 6), grid_lines(0, height, 3)};
  grid.held = [=](std::array<double, 3> p) { return p[2] == 0 && p[0] < 0.75 * width; };
  DenseBody dense = dense_grid(grid);
  for (auto& p : dense.body.mesh.nodes) {
    const double x = p[0] - 0.5 * width, y = p[1] - 0.5 * width;
    p[2] += p[2] / height * (-5 * (x * x + y * y) + 0.0008 * std::sin(150 * x) * std::cos(130 * y));
  }
  return dense;
}

}  // namespace palpate::tests
