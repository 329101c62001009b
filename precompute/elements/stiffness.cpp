#include "precompute/elements/stiffness.h"

#include <algorithm>

namespace palpate {
namespace {

double mean_diagonal(const BlockMatrix& matrix) {
  double sum = 0;
  for (std::int32_t row = 0; row < matrix.rows; ++row)
    for (auto at = matrix.first[row]; at < matrix.first[row + 1]; ++at)
      if (matrix.column[at] == row) sum += matrix.block[at][0] + matrix.block[at][4] + matrix.block[at][8];
  return sum / (3.0 * std::max(matrix.rows, 1));
}

}  // namespace

void Lists::append(std::span<const std::int32_t> list) {
  item.insert(item.end(), list.begin(), list.end());
  first.push_back(static_cast<std::int64_t>(item.size()));
}

Lists lists_around(const Lists& lists, std::int32_t count) {
  Lists around;
  around.first.assign(static_cast<std::size_t>(count) + 1, 0);
  around.item.resize(lists.item.size());
  for (const auto n : lists.item) ++around.first[n + 1];
  for (std::int32_t n = 0; n < count; ++n) around.first[n + 1] += around.first[n];
  std::vector<std::int64_t> next(around.first.begin(), around.first.end() - 1);
  for (std::size_t i = 0; i < lists.size(); ++i)
    for (const auto n : lists[i]) around.item[next[n]++] = static_cast<std::int32_t>(i);
  return around;
}

BlockMatrix coupled_blocks(const Lists& coupled, std::int32_t rows) {
  const Lists around = lists_around(coupled, rows);
  BlockMatrix matrix;
  matrix.rows = rows;
  matrix.first.assign(1, 0);
  std::vector<std::int32_t> seen_from(rows, -1), row;
  for (std::int32_t n = 0; n < rows; ++n) {
    row.clear();
    for (const auto list : around[n])
      for (const auto m : coupled[list])
        if (seen_from[m] != n) seen_from[m] = n, row.push_back(m);
    std::sort(row.begin(), row.end());
    matrix.column.insert(matrix.column.end(), row.begin(), row.end());
    matrix.first.push_back(static_cast<std::int64_t>(matrix.column.size()));
  }
  matrix.block.assign(matrix.column.size(), {});
  return matrix;
}

HeldStiffness remove_held_dofs(const BlockMatrix& all, std::span<const std::array<std::uint8_t, 3>> fixed) {
  HeldStiffness result;
  result.row_of_node.assign(all.rows, -1);
  for (std::int32_t n = 0; n < all.rows; ++n)
    if (!(fixed[n][0] && fixed[n][1] && fixed[n][2])) {
      result.row_of_node[n] = static_cast<std::int32_t>(result.node_of_row.size());
      result.node_of_row.push_back(n);
    }
  const double held_diagonal = mean_diagonal(all);
  BlockMatrix& matrix = result.matrix;
  matrix.rows = static_cast<std::int32_t>(result.node_of_row.size());
  matrix.first.assign(1, 0);
  for (const auto n : result.node_of_row) {
    for (auto at = all.first[n]; at < all.first[n + 1]; ++at) {
      const auto m = all.column[at];
      if (result.row_of_node[m] < 0) continue;
      auto block = all.block[at];
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          if (fixed[n][i] || fixed[m][j]) block[3 * i + j] = n == m && i == j ? held_diagonal : 0.0;
      matrix.column.push_back(result.row_of_node[m]);
      matrix.block.push_back(block);
    }
    matrix.first.push_back(static_cast<std::int64_t>(matrix.column.size()));
  }
  return result;
}

std::vector<double> multiply(const BlockMatrix& matrix, std::span<const double> x) {
  std::vector<double> y(3 * static_cast<std::size_t>(matrix.rows), 0.0);
  for (std::int32_t row = 0; row < matrix.rows; ++row)
    for (auto at = matrix.first[row]; at < matrix.first[row + 1]; ++at)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          y[3 * row + i] += matrix.block[at][3 * i + j] * x[3 * static_cast<std::size_t>(matrix.column[at]) + j];
  return y;
}

}  // namespace palpate
