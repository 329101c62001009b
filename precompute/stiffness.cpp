#include "precompute/stiffness.h"

#include <Eigen/Dense>
#include <algorithm>

#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__)
#define PALPATE_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define PALPATE_WIDE
#endif

namespace palpate {
namespace {

using Gradients = Eigen::Matrix<double, 3, 4>;

// Gradients of the four barycentric coordinates and the volume.
double shape_gradients(const std::array<std::array<double, 3>, 4>& p, Gradients* gradients) {
  Eigen::Matrix3d edges;
  for (int a = 0; a < 3; ++a)
    for (int d = 0; d < 3; ++d) edges(a, d) = p[a + 1][d] - p[0][d];
  gradients->rightCols<3>() = edges.inverse();
  gradients->col(0) = -gradients->rightCols<3>().rowwise().sum();
  return edges.determinant() / 6;
}

std::array<std::array<double, 3>, 4> corners(const ElasticBody& body, const std::array<std::int32_t, 4>& t) {
  return {body.nodes[t[0]], body.nodes[t[1]], body.nodes[t[2]], body.nodes[t[3]]};
}

// Rows and columns of the blocks: the nodes of the tetrahedra around each node.
BlockMatrix pattern(const ElasticBody& body) {
  const auto count = static_cast<std::int32_t>(body.nodes.size());
  std::vector<std::int32_t> first(count + 1, 0), around(body.tetrahedra.size() * 4);
  for (const auto& t : body.tetrahedra)
    for (const auto n : t) ++first[n + 1];
  for (std::int32_t n = 0; n < count; ++n) first[n + 1] += first[n];
  std::vector<std::int32_t> next(first.begin(), first.end() - 1);
  for (std::size_t t = 0; t < body.tetrahedra.size(); ++t)
    for (const auto n : body.tetrahedra[t]) around[next[n]++] = static_cast<std::int32_t>(t);

  BlockMatrix matrix;
  matrix.rows = count;
  matrix.first.assign(1, 0);
  std::vector<std::int32_t> seen_from(count, -1), row;
  for (std::int32_t n = 0; n < count; ++n) {
    row.clear();
    for (std::int32_t i = first[n]; i < first[n + 1]; ++i)
      for (const auto m : body.tetrahedra[around[i]])
        if (seen_from[m] != n) seen_from[m] = n, row.push_back(m);
    std::sort(row.begin(), row.end());
    matrix.column.insert(matrix.column.end(), row.begin(), row.end());
    matrix.first.push_back(static_cast<std::int64_t>(matrix.column.size()));
  }
  matrix.block.assign(matrix.column.size(), {});
  return matrix;
}

std::array<double, 9>& block_at(BlockMatrix& matrix, std::int32_t row, std::int32_t column) {
  const auto begin = matrix.column.begin() + matrix.first[row], end = matrix.column.begin() + matrix.first[row + 1];
  return matrix.block[std::lower_bound(begin, end, column) - matrix.column.begin()];
}

double mean_diagonal(const BlockMatrix& matrix) {
  double sum = 0;
  for (std::int32_t row = 0; row < matrix.rows; ++row)
    for (auto at = matrix.first[row]; at < matrix.first[row + 1]; ++at)
      if (matrix.column[at] == row) sum += matrix.block[at][0] + matrix.block[at][4] + matrix.block[at][8];
  return sum / (3.0 * std::max(matrix.rows, 1));
}

// Width vectors of one block row; a compile-time width keeps the sums in registers.
template <int kWidth>
inline __attribute__((always_inline)) void multiply_row(const std::int32_t* column, const std::array<double, 9>* block,
                                                        std::int64_t count, const double* x, double* y, int stride) {
  double sum[3][kWidth] = {};
  for (std::int64_t at = 0; at < count; ++at) {
    const double* v = x + 3 * static_cast<std::int64_t>(column[at]) * stride;
    const auto& k = block[at];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        for (int c = 0; c < kWidth; ++c) sum[i][c] += k[3 * i + j] * v[j * stride + c];
  }
  for (int i = 0; i < 3; ++i)
    for (int c = 0; c < kWidth; ++c) y[i * stride + c] = sum[i][c];
}

PALPATE_WIDE void multiply_all(const BlockMatrix& matrix, const double* x, double* y, int width) {
  for (std::int32_t row = 0; row < matrix.rows; ++row) {
    const auto begin = matrix.first[row], count = matrix.first[row + 1] - begin;
    double* out = y + 3 * static_cast<std::int64_t>(row) * width;
    int c = 0;
    for (; c + 32 <= width; c += 32)
      multiply_row<32>(&matrix.column[begin], &matrix.block[begin], count, x + c, out + c, width);
    for (; c < width; c += 8)
      multiply_row<8>(&matrix.column[begin], &matrix.block[begin], count, x + c, out + c, width);
  }
}

}  // namespace

ElementStiffness element_stiffness(const std::array<std::array<double, 3>, 4>& points, const Material& material) {
  Gradients g;
  const double volume = shape_gradients(points, &g);
  const double mu = volume * material.young / (2 * (1 + material.poisson));
  const double lambda =
      volume * material.young * material.poisson / ((1 + material.poisson) * (1 - 2 * material.poisson));
  ElementStiffness k;
  for (int a = 0; a < 4; ++a)
    for (int b = a; b < 4; ++b) {
      const double shear = mu * g.col(a).dot(g.col(b));
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const double value = a == b && j < i
                                   ? k[a][a][3 * j + i]
                                   : lambda * (g(i, a) * g(j, b)) + mu * (g(j, a) * g(i, b)) + (i == j ? shear : 0);
          k[a][b][3 * i + j] = value;
          k[b][a][3 * j + i] = value;
        }
    }
  return k;
}

BlockMatrix assemble_stiffness(const ElasticBody& body) {
  BlockMatrix matrix = pattern(body);
  for (std::size_t t = 0; t < body.tetrahedra.size(); ++t) {
    const auto& nodes = body.tetrahedra[t];
    const auto k = element_stiffness(corners(body, nodes), body.materials[body.region[t]]);
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        auto& block = block_at(matrix, nodes[a], nodes[b]);
        for (int i = 0; i < 9; ++i) block[i] += k[a][b][i];
      }
  }
  return matrix;
}

HeldStiffness eliminate_held(const BlockMatrix& all, std::span<const std::array<std::uint8_t, 3>> fixed) {
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

void multiply(const BlockMatrix& matrix, const double* x, double* y, int width) {
  multiply_all(matrix, x, y, width);
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

std::vector<double> gravity_load(const ElasticBody& body, const std::array<double, 3>& gravity) {
  std::vector<double> load(3 * body.nodes.size(), 0.0);
  Gradients unused;
  for (std::size_t t = 0; t < body.tetrahedra.size(); ++t) {
    const double volume = shape_gradients(corners(body, body.tetrahedra[t]), &unused);
    const double quarter = body.materials[body.region[t]].density * volume / 4;
    for (const auto n : body.tetrahedra[t])
      for (int d = 0; d < 3; ++d) load[3 * static_cast<std::size_t>(n) + d] += quarter * gravity[d];
  }
  return load;
}

}  // namespace palpate
