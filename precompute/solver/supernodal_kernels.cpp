#include "precompute/solver/supernodal_kernels.h"

namespace palpate {
namespace {

// A tile of the batch in registers: kRows rows of a strip that is kVectors registers wide. In this file x points to the first
// number of a row of the strip; the next row of the batch is `width` numbers further.
template <int kLanes, int kRows, int kVectors>
struct Tile {
  using Vector = typename VectorOf<kLanes>::Type;
  Vector sum[kRows][kVectors];

  PALPATE_INLINE void load(int row, const double* x) {
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) sum[row][v] = *reinterpret_cast<const Vector*>(x + v * kLanes);
  }
  PALPATE_INLINE void clear(int row) {
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) sum[row][v] = Vector{};
  }
  PALPATE_INLINE void store(int row, double* x) const {
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) *reinterpret_cast<Vector*>(x + v * kLanes) = sum[row][v];
  }
  // sum -= a x^T, where x is one row of the strip and the kRows numbers of a are stride apart.
  PALPATE_INLINE void subtract(const double* a, std::int64_t stride, const double* x) {
    Vector b[kVectors];
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) b[v] = *reinterpret_cast<const Vector*>(x + v * kLanes);
#pragma GCC unroll 6
    for (int r = 0; r < kRows; ++r)
#pragma GCC unroll 4
      for (int v = 0; v < kVectors; ++v) sum[r][v] -= a[r * stride] * b[v];
  }
  // sum = A^-1 sum, with the lower triangle A stored as a[kRows][kRows] whose diagonal holds reciprocals.
  PALPATE_INLINE void solve_lower(const double* a) {
#pragma GCC unroll 6
    for (int r = 0; r < kRows; ++r) {
#pragma GCC unroll 4
      for (int v = 0; v < kVectors; ++v) sum[r][v] *= a[r * kRows + r];
#pragma GCC unroll 6
      for (int below = r + 1; below < kRows; ++below)
#pragma GCC unroll 4
        for (int v = 0; v < kVectors; ++v) sum[below][v] -= a[below * kRows + r] * sum[r][v];
    }
  }
  // sum = A^-T sum.
  PALPATE_INLINE void solve_transposed(const double* a) {
#pragma GCC unroll 6
    for (int r = kRows - 1; r >= 0; --r) {
#pragma GCC unroll 4
      for (int v = 0; v < kVectors; ++v) sum[r][v] *= a[r * kRows + r];
#pragma GCC unroll 6
      for (int above = 0; above < r; ++above)
#pragma GCC unroll 4
        for (int v = 0; v < kVectors; ++v) sum[above][v] -= a[r * kRows + above] * sum[r][v];
    }
  }
};

// Pointer to the first number of the panel that begins at block column `column`.
PALPATE_INLINE const double* panel_of(const Supernode& s, std::int32_t column) {
  const std::int64_t height = static_cast<std::int64_t>(s.columns) + s.below, pairs = column / 2;
  return s.values + 18 * (pairs * height - pairs * (pairs - 1));
}

// tile -= L x for the block columns from .. to - 1 of the supernode. The rows of the tile are the block rows from `row` on,
// counted from the first row of the supernode.
template <int kLanes, int kRows, int kVectors>
PALPATE_INLINE void subtract_columns(Tile<kLanes, kRows, kVectors>& tile, const Supernode& s, std::int64_t row,
                                     std::int32_t from, std::int32_t to, const double* own, std::int64_t width) {
  const std::int64_t height = static_cast<std::int64_t>(s.columns) + s.below;
  const double* panel = panel_of(s, from);
  std::int32_t at = from;
  for (; at + 2 <= to; at += 2) {
    const double* a = panel + (row - at) * 18;
    const double* x = own + 3 * at * width;
#pragma GCC unroll 6
    for (int k = 0; k < 6; ++k) tile.subtract(a + k, 6, x + k * width);
    panel += (height - at) * 18;
  }
  if (at < to) {  // the last panel has one block column
    const double* a = panel + (row - at) * 9;
    const double* x = own + 3 * at * width;
#pragma GCC unroll 3
    for (int k = 0; k < 3; ++k) tile.subtract(a + k, 3, x + k * width);
  }
}

// Forward substitution of one panel of the supernode's own rows: subtracts the product with the columns between `from` and the
// panel, then solves with the panel's triangle.
template <int kLanes, int kRows, int kVectors>
PALPATE_INLINE void forward_own(const Supernode& s, std::int32_t from, std::int32_t column, double* own,
                                std::int64_t width) {
  Tile<kLanes, kRows, kVectors> tile;
  double* x = own + 3 * column * width;
#pragma GCC unroll 6
  for (int r = 0; r < kRows; ++r) tile.load(r, x + r * width);
  subtract_columns(tile, s, column, from, column, own, width);
  tile.solve_lower(panel_of(s, column));
#pragma GCC unroll 6
  for (int r = 0; r < kRows; ++r) tile.store(r, x + r * width);
}

// Forward substitution of rows below the columns from .. to - 1: block row `row`, which stands at x0 and, where kRows is 6,
// the block row after it, which stands at x1.
template <int kLanes, int kRows, int kVectors>
PALPATE_INLINE void forward_under(const Supernode& s, std::int32_t from, std::int32_t to, std::int64_t row, double* x0,
                                  double* x1, const double* own, std::int64_t width) {
  Tile<kLanes, kRows, kVectors> tile;
#pragma GCC unroll 6
  for (int r = 0; r < kRows; ++r) tile.load(r, (r < 3 ? x0 : x1) + (r % 3) * width);
  subtract_columns(tile, s, row, from, to, own, width);
#pragma GCC unroll 6
  for (int r = 0; r < kRows; ++r) tile.store(r, (r < 3 ? x0 : x1) + (r % 3) * width);
}

// Backward substitution of one panel: subtracts the product with all rows below the panel, then solves with the transposed
// triangle.
template <int kLanes, int kRows, int kVectors>
PALPATE_INLINE void backward_panel(const Supernode& s, std::int32_t column, bool from_zero, double* y, double* own,
                                   std::int64_t width) {
  Tile<kLanes, kRows, kVectors> tile;
  const double* panel = panel_of(s, column);
  double* x = own + 3 * column * width;
  if (from_zero) {
#pragma GCC unroll 6
    for (int r = 0; r < kRows; ++r) tile.clear(r);
  } else {
#pragma GCC unroll 6
    for (int r = 0; r < kRows; ++r) tile.load(r, x + r * width);
  }
  const double* a = panel + kRows * kRows;
  const double* from = x + kRows * width;
  for (std::int32_t c = column + kRows / 3; c < s.columns; ++c, a += 3 * kRows, from += 3 * width)
#pragma GCC unroll 3
    for (int k = 0; k < 3; ++k) tile.subtract(a + k * kRows, 1, from + k * width);
  for (std::int32_t i = 0; i < s.below; ++i, a += 3 * kRows) {
    from = y + 3 * static_cast<std::int64_t>(s.rows[i]) * width;
#pragma GCC unroll 3
    for (int k = 0; k < 3; ++k) tile.subtract(a + k * kRows, 1, from + k * width);
  }
  tile.solve_transposed(panel);
#pragma GCC unroll 6
  for (int r = 0; r < kRows; ++r) tile.store(r, x + r * width);
}

// Block columns whose rows are solved before all rows below them are updated: so few that their rows of y stay in the cache.
constexpr std::int32_t kAtOnce = 32;

template <int kLanes, int kMost>
PALPATE_INLINE void forward(const Supernode& s, double* y, int width) {
  double* own = y + 3 * static_cast<std::int64_t>(s.first) * width;
  const std::int64_t run = 3 * static_cast<std::int64_t>(width);
  for (std::int32_t from = 0; from < s.columns; from += kAtOnce) {
    const std::int32_t to = from + kAtOnce < s.columns ? from + kAtOnce : s.columns;
    std::int32_t column = from;
    for (; column + 2 <= to; column += 2)
      over_strips<kLanes, kMost>(
          width, [&]<int kVectors>(int at) __attribute__((always_inline)) {
            forward_own<kLanes, 6, kVectors>(s, from, column, own + at, width);
          });
    if (column < to)
      over_strips<kLanes, kMost>(
          width, [&]<int kVectors>(int at) __attribute__((always_inline)) {
            forward_own<kLanes, 3, kVectors>(s, from, column, own + at, width);
          });
    const std::int64_t height = static_cast<std::int64_t>(s.columns) + s.below;
    const auto place = [&](std::int64_t row) __attribute__((always_inline)) {
      return row < s.columns ? own + row * run : y + s.rows[row - s.columns] * run;
    };
    std::int64_t row = to;
    for (; row + 2 <= height; row += 2) {
      double *x0 = place(row), *x1 = place(row + 1);
      over_strips<kLanes, kMost>(
          width, [&]<int kVectors>(int at) __attribute__((always_inline)) {
            forward_under<kLanes, 6, kVectors>(s, from, to, row, x0 + at, x1 + at, own + at, width);
          });
    }
    if (row < height) {
      double* x0 = place(row);
      over_strips<kLanes, kMost>(
          width, [&]<int kVectors>(int at) __attribute__((always_inline)) {
            forward_under<kLanes, 3, kVectors>(s, from, to, row, x0 + at, x0 + at, own + at, width);
          });
    }
  }
}

template <int kLanes, int kMost>
PALPATE_INLINE void backward(const Supernode& s, bool from_zero, double* y, int width) {
  double* own = y + 3 * static_cast<std::int64_t>(s.first) * width;
  std::int32_t column = s.columns;
  if (column % 2) {
    --column;
    over_strips<kLanes, kMost>(
        width, [&]<int kVectors>(int at) __attribute__((always_inline)) {
          backward_panel<kLanes, 3, kVectors>(s, column, from_zero, y + at, own + at, width);
        });
  }
  while (column > 0) {
    column -= 2;
    over_strips<kLanes, kMost>(
        width, [&]<int kVectors>(int at) __attribute__((always_inline)) {
          backward_panel<kLanes, 6, kVectors>(s, column, from_zero, y + at, own + at, width);
        });
  }
}

PALPATE_FOR_EACH_REGISTER(forward_with, (const Supernode& s, double* y, int width), (s, y, width), forward, 4, 2, 2)
PALPATE_FOR_EACH_REGISTER(backward_with, (const Supernode& s, bool from_zero, double* y, int width),
                          (s, from_zero, y, width), backward, 4, 2, 2)

}  // namespace

SupernodalKernels supernodal_kernels(int lanes) {
  return {forward_with(lanes), backward_with(lanes)};
}

}  // namespace palpate
