#include "precompute/solver/block_residual.h"

#include <cmath>

#include "precompute/solver/vector_registers.h"

namespace palpate {
namespace {

// The three rows of one block row of K x; kVectors registers of columns. The rows of x that come two blocks later are
// fetched meanwhile.
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

// squares[c] += sum of (K x - b)^2 down column c. rows: room for 3 * width numbers.
template <int kLanes, int kMost>
PALPATE_INLINE void add_squares(const BlockMatrix& matrix, std::span<const Load> loads, const double* x, int width,
                                double* rows, double* squares) {
  auto load = loads.begin();
  for (std::int32_t row = 0; row < matrix.rows; ++row) {
    const auto begin = matrix.first[row], count = matrix.first[row + 1] - begin;
    over_strips<kLanes, kMost>(
        width, [&]<int kVectors>(int c) __attribute__((always_inline)) {
          product_row<kLanes, kVectors>(&matrix.column[begin], &matrix.block[begin], count, x + c, width, rows + c);
        });
    for (; load != loads.end() && load->dof < 3 * (static_cast<std::int64_t>(row) + 1); ++load)
      rows[(load->dof - 3 * static_cast<std::int64_t>(row)) * width + load->column] -= load->value;
    for (int i = 0; i < 3; ++i)
      for (int c = 0; c < width; ++c) squares[c] += rows[i * width + c] * rows[i * width + c];
  }
}

#if defined(__x86_64__)
__attribute__((target("avx512f"))) void add_squares_512(const BlockMatrix& matrix, std::span<const Load> loads,
                                                        const double* x, int width, double* rows, double* squares) {
  add_squares<8, 6>(matrix, loads, x, width, rows, squares);
}
__attribute__((target("avx2,fma"))) void add_squares_256(const BlockMatrix& matrix, std::span<const Load> loads,
                                                         const double* x, int width, double* rows, double* squares) {
  add_squares<4, 4>(matrix, loads, x, width, rows, squares);
}
#endif
void add_squares_128(const BlockMatrix& matrix, std::span<const Load> loads, const double* x, int width, double* rows,
                     double* squares) {
  add_squares<2, 4>(matrix, loads, x, width, rows, squares);
}

}  // namespace

std::vector<double> residual_norms(const BlockMatrix& matrix, std::span<const Load> loads, const double* x, int width) {
  std::vector<double> rows(3 * static_cast<std::size_t>(width)), squares(static_cast<std::size_t>(width), 0.0);
#if defined(__x86_64__)
  if (lanes_here() == 8)
    add_squares_512(matrix, loads, x, width, rows.data(), squares.data());
  else if (lanes_here() == 4)
    add_squares_256(matrix, loads, x, width, rows.data(), squares.data());
  else
#endif
    add_squares_128(matrix, loads, x, width, rows.data(), squares.data());
  for (double& square : squares) square = std::sqrt(square);
  return squares;
}

}  // namespace palpate
