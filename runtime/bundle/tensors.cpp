#include "runtime/bundle/tensors.h"

namespace palpate {

// By Betti's theorem a force on the surface moves an interior node as a force on that node moves the surface.
Mat3 Tensors::displacement_in_corridor(std::int32_t node, std::int32_t column) const {
  const std::int32_t inside = node < surface_nodes ? -1 : corridor->index_of(node);
  if (node >= surface_nodes && inside < 0) return Mat3{};
  if (column >= columns)
    return inside < 0 ? corridor->surface.entry(node, column - columns) : corridor->between(inside, column - columns);
  const Mat3 c = corridor->surface.entry(corridor->node_of_column[column], inside), f = stiffness_of(column);
  Mat3 u;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) u.m[i][j] += c.m[k][i] * f.m[k][j];
  return u;
}

}  // namespace palpate
