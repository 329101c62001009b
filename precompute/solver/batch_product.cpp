#include "precompute/solver/batch_product.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "precompute/solver/vector_registers.h"

namespace palpate {
namespace {

// Computes the three rows of K x that one block row of K gives, for kVectors registers of columns. A prefetch asks for the
// rows of x that the block after the next one needs.
template <int kLanes, int kVectors>
PALPATE_INLINE void product_row(const std::int32_t* column, const std::array<double, 9>* block, std::int64_t count,
                                const double* x, std::int64_t width, double* out) {
  using Vector = typename VectorOf<kLanes>::Type;
  constexpr std::int64_t kAhead = 2;
  Vector sum[3][kVectors];
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i)
#pragma GCC unroll 8
    for (int v = 0; v < kVectors; ++v) sum[i][v] = Vector{};
  for (std::int64_t at = 0; at < count; ++at) {
    const double* from = x + 3 * column[at] * width;
    const double* k = block[at].data();
    const double* later = x + 3 * column[at + kAhead < count ? at + kAhead : at] * width;
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j)
      for (int c = 0; c < kLanes * kVectors; c += 8) __builtin_prefetch(later + j * width + c);
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j) {
      Vector b[kVectors];
#pragma GCC unroll 8
      for (int v = 0; v < kVectors; ++v) b[v] = *reinterpret_cast<const Vector*>(from + j * width + v * kLanes);
#pragma GCC unroll 3
      for (int i = 0; i < 3; ++i)
#pragma GCC unroll 8
        for (int v = 0; v < kVectors; ++v) sum[i][v] += k[3 * i + j] * b[v];
    }
  }
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i)
#pragma GCC unroll 8
    for (int v = 0; v < kVectors; ++v) *reinterpret_cast<Vector*>(out + i * width + v * kLanes) = sum[i][v];
}

// squares[c] += the sum of (K x - b)^2 over column c; product: null or K x. rows: work memory for 3 * width numbers.
template <int kLanes, int kMost>
PALPATE_INLINE void add_squares(const BlockMatrix& matrix, std::span<const Load> loads, const double* x, int width,
                                double* product, double* rows, double* squares) {
  auto load = loads.begin();
  for (std::int32_t row = 0; row < matrix.rows; ++row) {
    const auto begin = matrix.first[row], count = matrix.first[row + 1] - begin;
    over_strips<kLanes, kMost>(
        width, [&]<int kVectors>(int c) __attribute__((always_inline)) {
          product_row<kLanes, kVectors>(&matrix.column[begin], &matrix.block[begin], count, x + c, width, rows + c);
        });
    if (product) std::copy_n(rows, 3 * width, product + 3 * static_cast<std::int64_t>(row) * width);
    for (; load != loads.end() && load->dof < 3 * (static_cast<std::int64_t>(row) + 1); ++load)
      rows[(load->dof - 3 * static_cast<std::int64_t>(row)) * width + load->column] -= load->value;
    for (int i = 0; i < 3; ++i)
      for (int c = 0; c < width; ++c) squares[c] += rows[i * width + c] * rows[i * width + c];
  }
}

template <int kLanes, int kMost>
PALPATE_INLINE void multiply_rows(const BlockMatrix& matrix, const double* x, double* y, int width) {
  for (std::int32_t row = 0; row < matrix.rows; ++row) {
    const auto begin = matrix.first[row], count = matrix.first[row + 1] - begin;
    double* out = y + 3 * static_cast<std::int64_t>(row) * width;
    over_strips<kLanes, kMost>(
        width, [&]<int kVectors>(int c) __attribute__((always_inline)) {
          product_row<kLanes, kVectors>(&matrix.column[begin], &matrix.block[begin], count, x + c, width, out + c);
        });
  }
}

template <int kLanes, int>
PALPATE_INLINE void add_squares_of(const double* x, std::int64_t dofs, int width, double* squares) {
  for (std::int64_t i = 0; i < dofs; ++i)
    for (int c = 0; c < width; ++c) squares[c] += x[i * width + c] * x[i * width + c];
}

PALPATE_FOR_EACH_REGISTER(add_residual_squares,
                          (const BlockMatrix& matrix, std::span<const Load> loads, const double* x, int width,
                           double* product, double* rows, double* squares),
                          (matrix, loads, x, width, product, rows, squares), add_squares, 6, 4, 4)
PALPATE_FOR_EACH_REGISTER(multiply_with, (const BlockMatrix& matrix, const double* x, double* y, int width),
                          (matrix, x, y, width), multiply_rows, 6, 4, 4)
PALPATE_FOR_EACH_REGISTER(add_column_squares, (const double* x, std::int64_t dofs, int width, double* squares),
                          (x, dofs, width, squares), add_squares_of, 1, 1, 1)

std::vector<double> square_roots(std::vector<double> squares) {
  for (double& square : squares) square = std::sqrt(square);
  return squares;
}

}  // namespace

void multiply_batch(const BlockMatrix& matrix, const double* x, double* y, int width) {
  multiply_with(lanes_here())(matrix, x, y, width);
}

std::vector<double> residual_norms(const BlockMatrix& matrix, std::span<const Load> loads, const double* x, int width,
                                   double* product) {
  std::vector<double> rows(3 * static_cast<std::size_t>(width)), squares(static_cast<std::size_t>(width), 0.0);
  add_residual_squares(lanes_here())(matrix, loads, x, width, product, rows.data(), squares.data());
  return square_roots(std::move(squares));
}

std::vector<double> column_norms(const double* x, std::int64_t dofs, int width) {
  std::vector<double> squares(static_cast<std::size_t>(width), 0.0);
  add_column_squares(lanes_here())(x, dofs, width, squares.data());
  return square_roots(std::move(squares));
}

}  // namespace palpate
