// Tetrahedra and materials -> the stiffness matrix, as sparse 3 x 3 blocks.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/elastic_body.h"

namespace palpate {

// Square, symmetric, one 3 x 3 block (row-major, N/m) per pair of nodes that share a tetrahedron; columns ascending.
struct BlockMatrix {
  std::int32_t rows = 0;             // block rows
  std::vector<std::int64_t> first;   // [rows + 1] into column
  std::vector<std::int32_t> column;  // block columns
  std::vector<std::array<double, 9>> block;
};

// The 4 x 4 blocks of a linear tetrahedron, K_ab(i, j) = V (lambda g_a,i g_b,j + mu g_a,j g_b,i + mu delta_ij g_a.g_b),
// g the gradients of the shape functions. points in m. Symmetric to the last bit.
using ElementStiffness = std::array<std::array<std::array<double, 9>, 4>, 4>;
ElementStiffness element_stiffness(const std::array<std::array<double, 3>, 4>& points, const Material& material);

// K over all nodes, nothing held. The sum runs over the tetrahedra in their order: same input, same bits.
BlockMatrix assemble_stiffness(const ElasticBody& body);

// K with the held dofs eliminated. Nodes without a free dof have no row. A node that is held in part keeps its three
// rows; the held ones are uncoupled and have the mean of the diagonal on it, so that every block stays 3 x 3.
struct HeldStiffness {
  BlockMatrix matrix;
  std::vector<std::int32_t> row_of_node;  // -1: no row
  std::vector<std::int32_t> node_of_row;
};
HeldStiffness eliminate_held(const BlockMatrix& all, std::span<const std::array<std::uint8_t, 3>> fixed);

// y = K x for width vectors at once; x, y: [3 * rows][width], the vectors of one dof side by side; width a multiple
// of 8.
void multiply(const BlockMatrix& matrix, const double* x, double* y, int width);

// The same for one vector of 3 * rows numbers.
std::vector<double> multiply(const BlockMatrix& matrix, std::span<const double> x);

// Nodal forces of a body force: density * gravity * a quarter of each tetrahedron's volume at each of its nodes; [3 N],
// N.
std::vector<double> gravity_load(const ElasticBody& body, const std::array<double, 3>& gravity);

}  // namespace palpate
