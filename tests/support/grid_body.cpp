#include "tests/support/grid_body.h"

namespace palpate::tests {

std::vector<double> grid_lines(double from, double to, int cells) {
  std::vector<double> lines;
  for (int i = 0; i <= cells; ++i) lines.push_back(from + (to - from) * i / cells);
  return lines;
}

DenseBody dense_grid(const GridBody& grid) {
  constexpr int permutations[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  TetrahedralMesh mesh;
  std::map<std::array<int, 3>, std::int32_t> number;
  const auto node = [&](std::array<int, 3> at) {
    const auto [found, fresh] = number.try_emplace(at, static_cast<std::int32_t>(mesh.nodes.size()));
    if (fresh) mesh.nodes.push_back({grid.lines[0][at[0]], grid.lines[1][at[1]], grid.lines[2][at[2]]});
    return found->second;
  };
  const auto cells = [&](int d) { return static_cast<int>(grid.lines[d].size()) - 1; };
  const auto middle = [&](int d, int i) { return 0.5 * (grid.lines[d][i] + grid.lines[d][i + 1]); };
  for (int k = 0; k < cells(2); ++k)
    for (int j = 0; j < cells(1); ++j)
      for (int i = 0; i < cells(0); ++i) {
        if (!grid.filled({middle(0, i), middle(1, j), middle(2, k)})) continue;
        for (int p = 0; p < 6; ++p) {
          std::array<int, 3> at = {i, j, k};
          std::array<std::int32_t, 4> t{};
          t[0] = node(at);
          for (int step = 0; step < 3; ++step) {
            ++at[permutations[p][step]];
            t[step + 1] = node(at);
          }
          if (p >= 3) std::swap(t[2], t[3]);
          mesh.tetrahedra.push_back(t);
        }
      }
  mesh.region.assign(mesh.tetrahedra.size(), 0);
  mesh.region_names = {"body"};
  DenseBody dense{surface_first(mesh), grid.young, grid.poisson, false, {}};
  for (const auto& p : dense.body.mesh.nodes) dense.fixed.insert(dense.fixed.end(), 3, grid.held(p) ? 1 : 0);
  return dense;
}

DenseBody slotted_block() {
  GridBody grid;
  grid.lines[0] = {0, .01, .02, .03, .033, .043, .053, .063};
  grid.lines[1] = grid_lines(0, .030, 3);
  grid.lines[2] = {0, .0075, .015, .0238, .0325, .0413, .050};
  grid.filled = [](std::array<double, 3> c) { return !(c[0] > .030 && c[0] < .033 && c[2] > .015); };
  grid.held = [](std::array<double, 3> p) { return p[2] == 0; };
  return dense_grid(grid);
}

DenseBody clamped_slab() {
  GridBody grid;
  grid.lines = {grid_lines(0, .120, 16), grid_lines(0, .030, 4), grid_lines(0, .012, 2)};
  return dense_grid(grid);
}

}  // namespace palpate::tests
