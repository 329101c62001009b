// The stiffness matrix K as sparse 3 x 3 blocks, for all elements, and the operations on it. In this project "block"
// means one entry of such a matrix.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

// Square and symmetric: one kSize x kSize block (row-major) for each pair of coupled nodes. In each row the columns
// ascend.
template <int kSize>
struct BlockMatrixOf {
  std::int32_t rows = 0;             // block rows
  std::vector<std::int64_t> first;   // [rows + 1] into column
  std::vector<std::int32_t> column;  // block columns
  std::vector<std::array<double, kSize * kSize>> block;
};
using BlockMatrix = BlockMatrixOf<3>;  // of displacements, N/m

// Lists of node or tetrahedron numbers, stored one after the other: list i is item[first[i]] .. item[first[i + 1] - 1].
struct Lists {
  std::vector<std::int64_t> first = {0};
  std::vector<std::int32_t> item;

  std::size_t size() const { return first.size() - 1; }
  std::span<const std::int32_t> operator[](std::size_t i) const {
    return {item.data() + first[i], item.data() + first[i + 1]};
  }
  void append(std::span<const std::int32_t> list);
};

// For each number from 0 to count - 1: which of the lists hold it, ascending.
Lists lists_around(const Lists& lists, std::int32_t count);

// A matrix of zero blocks, one for each pair of nodes that stand together in a list. rows: number of nodes.
BlockMatrix coupled_blocks(const Lists& coupled, std::int32_t rows);

// Index of the block (row, column) in matrix.block. The matrix must have that block.
template <int kSize>
std::int64_t index_of_block(const BlockMatrixOf<kSize>& matrix, std::int32_t row, std::int32_t column) {
  const auto begin = matrix.column.begin() + matrix.first[row], end = matrix.column.begin() + matrix.first[row + 1];
  return std::lower_bound(begin, end, column) - matrix.column.begin();
}

// K without the held dofs. A node whose three dofs are held has no row. A node with one or two held dofs keeps its
// three rows, so that every block stays 3 x 3: the rows of held dofs are zero but for the diagonal, which is the mean
// of K's diagonal.
struct HeldStiffness {
  BlockMatrix matrix;
  std::vector<std::int32_t> row_of_node;  // -1: no row
  std::vector<std::int32_t> node_of_row;
};
HeldStiffness remove_held_dofs(const BlockMatrix& all, std::span<const std::array<std::uint8_t, 3>> fixed);

// K x for one vector of 3 * rows numbers. (Batches of columns: precompute/solver/batch_product.h.)
std::vector<double> multiply(const BlockMatrix& matrix, std::span<const double> x);

}  // namespace palpate
