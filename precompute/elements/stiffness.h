// The stiffness matrix as sparse 3 x 3 blocks, whatever the element, and what is done with it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

// Square, symmetric, one 3 x 3 block (row-major, N/m) per pair of coupled nodes; columns ascending.
struct BlockMatrix {
  std::int32_t rows = 0;             // block rows
  std::vector<std::int64_t> first;   // [rows + 1] into column
  std::vector<std::int32_t> column;  // block columns
  std::vector<std::array<double, 9>> block;
};

// Lists of small numbers: list i is item[first[i]] .. item[first[i + 1] - 1].
struct Lists {
  std::vector<std::int64_t> first = {0};
  std::vector<std::int32_t> item;

  std::size_t size() const { return first.size() - 1; }
  std::span<const std::int32_t> operator[](std::size_t i) const {
    return {item.data() + first[i], item.data() + first[i + 1]};
  }
  void append(std::span<const std::int32_t> list);
};

// For each number below count, the lists that hold it, ascending.
Lists lists_around(const Lists& lists, std::int32_t count);

// Zero blocks for all pairs of nodes that stand in a list together, for nodes 0 .. rows - 1.
BlockMatrix coupled_blocks(const Lists& coupled, std::int32_t rows);

// Where column is in row; it must be there.
std::int64_t place_of(const BlockMatrix& matrix, std::int32_t row, std::int32_t column);

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

}  // namespace palpate
