// Bodies made of cuboid cells on a grid, some of them left out: a block with a slot, a slab that is clamped at one end.
#pragma once

#include <functional>
#include <map>

#include "tests/support/tiny_bundle.h"

namespace palpate::tests {

struct GridBody {
  std::array<std::vector<double>, 3> lines;  // m, ascending along each axis
  std::function<bool(std::array<double, 3> centre)> filled = [](auto) { return true; };
  std::function<bool(std::array<double, 3> node)> held = [](auto p) { return p[0] == 0; };
  double young = 5400, poisson = 0.45;
};

std::vector<double> grid_lines(double from, double to, int cells);

// Six tetrahedra to a cell (Kuhn's subdivision); nodes of cells that are left out are left out, too.
DenseBody dense_grid(const GridBody& grid);

// 63 x 30 x 50 mm with a slot x 30 .. 33 mm above z = 15 mm; the bottom is held.
DenseBody slotted_block();

// 120 x 30 x 12 mm, held at x = 0: what is pressed down beside the clamp moves the free end by several times as much.
DenseBody clamped_slab();

}  // namespace palpate::tests
