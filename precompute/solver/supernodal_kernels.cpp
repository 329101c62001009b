#include "precompute/solver/supernodal_kernels.h"

namespace palpate {
namespace {

// A tile of the batch in registers: kRows rows of a strip that is kVectors registers wide. In this file x points to the first
// number of a row of the strip; the next row of the batch is `width` numbers further.
template <class Number, int kLanes, int kRows, int kVectors>
struct Tile {
  using Vector = typename VectorOf<kLanes, Number>::Type;
  Vector sum[kRows][kVectors];

  PALPATE_INLINE void load(int row, const Number* x) {
#pragma GCC unroll 6
    for (int v = 0; v < kVectors; ++v) sum[row][v] = *reinterpret_cast<const Vector*>(x + v * kLanes);
  }
  PALPATE_INLINE void clear(int row) {
#pragma GCC unroll 6
    for (int v = 0; v < kVectors; ++v) sum[row][v] = Vector{};
  }
  PALPATE_INLINE void store(int row, Number* x) const {
#pragma GCC unroll 6
    for (int v = 0; v < kVectors; ++v) *reinterpret_cast<Vector*>(x + v * kLanes) = sum[row][v];
  }
  PALPATE_INLINE void negate(int row) {
#pragma GCC unroll 6
    for (int v = 0; v < kVectors; ++v) sum[row][v] = -sum[row][v];
  }
  // sum -= a x^T, where x is one row of the strip and the kRows numbers of a are stride apart.
  PALPATE_INLINE void subtract(const Number* a, std::int64_t stride, const Number* x) {
    Vector b[kVectors];
#pragma GCC unroll 6
    for (int v = 0; v < kVectors; ++v) b[v] = *reinterpret_cast<const Vector*>(x + v * kLanes);
#pragma GCC unroll 6
    for (int r = 0; r < kRows; ++r)
#pragma GCC unroll 6
      for (int v = 0; v < kVectors; ++v) sum[r][v] -= a[r * stride] * b[v];
  }
  // sum = A^-1 sum, with the lower triangle A stored as a[kRows][kRows] whose diagonal holds reciprocals.
  PALPATE_INLINE void solve_lower(const Number* a) {
#pragma GCC unroll 6
    for (int r = 0; r < kRows; ++r) {
#pragma GCC unroll 6
      for (int v = 0; v < kVectors; ++v) sum[r][v] *= a[r * kRows + r];
#pragma GCC unroll 6
      for (int below = r + 1; below < kRows; ++below)
#pragma GCC unroll 6
        for (int v = 0; v < kVectors; ++v) sum[below][v] -= a[below * kRows + r] * sum[r][v];
    }
  }
  // sum = A^-T sum.
  PALPATE_INLINE void solve_transposed(const Number* a) {
#pragma GCC unroll 6
    for (int r = kRows - 1; r >= 0; --r) {
#pragma GCC unroll 6
      for (int v = 0; v < kVectors; ++v) sum[r][v] *= a[r * kRows + r];
#pragma GCC unroll 6
      for (int above = 0; above < r; ++above)
#pragma GCC unroll 6
        for (int v = 0; v < kVectors; ++v) sum[above][v] -= a[r * kRows + above] * sum[r][v];
    }
  }
};

// The kernels for one type of number and one size of block, kBlock x kBlock.
template <class Number, int kBlock>
struct Kernels {
  static constexpr int kWide = panel_blocks(kBlock);  // blocks in a panel
  static constexpr int kPanel = kWide * kBlock;       // columns in a panel
  template <int kDoubles>
  static constexpr int kLanes = kDoubles* static_cast<int>(sizeof(double) / sizeof(Number));
  // The forward substitution goes through the columns in groups of this many block columns. Rows below are updated once for
  // each group; a group is small enough that its rows of y stay in the cache.
  static constexpr std::int32_t kAtOnce = 32;

  // Pointer to the first number of the panel that begins at block column `column`.
  static PALPATE_INLINE const Number* panel_of(const Supernode<Number>& s, std::int32_t column) {
    const std::int64_t height = static_cast<std::int64_t>(s.columns) + s.below, before = column / kWide;
    return s.values + kPanel * kBlock * (before * height - kWide * (before * (before - 1) / 2));
  }

  // tile -= L x for the block columns from .. to - 1 of the supernode; from stands at the begin of a panel. The rows of the
  // tile are the block rows from `row` on, counted from the first row of the supernode.
  template <int kWidth, int kRows, int kVectors>
  static PALPATE_INLINE void subtract_columns(Tile<Number, kWidth, kRows, kVectors>& tile, const Supernode<Number>& s,
                                              std::int64_t row, std::int32_t from, std::int32_t to, const Number* own,
                                              std::int64_t width) {
    const std::int64_t height = static_cast<std::int64_t>(s.columns) + s.below;
    const Number* panel = panel_of(s, from);
    std::int32_t at = from;
    for (; at + kWide <= to; at += kWide) {
      const Number* a = panel + (row - at) * (kPanel * kBlock);
      const Number* x = own + kBlock * at * width;
#pragma GCC unroll 6
      for (int k = 0; k < kPanel; ++k) tile.subtract(a + k, kPanel, x + k * width);
      panel += (height - at) * (kPanel * kBlock);
    }
    if (kWide > 1 && at < to) {  // the last panel has one block column
      const Number* a = panel + (row - at) * (kBlock * kBlock);
      const Number* x = own + kBlock * at * width;
#pragma GCC unroll 4
      for (int k = 0; k < kBlock; ++k) tile.subtract(a + k, kBlock, x + k * width);
    }
  }

  // Forward substitution of one panel of the supernode's own rows: subtracts the product with the columns between `from` and
  // the panel, then solves with the panel's triangle.
  template <int kWidth, int kRows, int kVectors>
  static PALPATE_INLINE void forward_own(const Supernode<Number>& s, std::int32_t from, std::int32_t column,
                                         Number* own, std::int64_t width) {
    Tile<Number, kWidth, kRows, kVectors> tile;
    Number* x = own + kBlock * column * width;
#pragma GCC unroll 6
    for (int r = 0; r < kRows; ++r) tile.load(r, x + r * width);
    subtract_columns(tile, s, column, from, column, own, width);
    tile.solve_lower(panel_of(s, column));
#pragma GCC unroll 6
    for (int r = 0; r < kRows; ++r) tile.store(r, x + r * width);
  }

  // Forward substitution of rows below the columns from .. to - 1: block row `row`, which stands at x0 and, where kRows is two
  // blocks, the block row after it, which stands at x1.
  template <int kWidth, int kRows, int kVectors>
  static PALPATE_INLINE void forward_under(const Supernode<Number>& s, std::int32_t from, std::int32_t to,
                                           std::int64_t row, Number* x0, Number* x1, const Number* own,
                                           std::int64_t width) {
    Tile<Number, kWidth, kRows, kVectors> tile;
#pragma GCC unroll 6
    for (int r = 0; r < kRows; ++r) tile.load(r, (r < kBlock ? x0 : x1) + (r % kBlock) * width);
    subtract_columns(tile, s, row, from, to, own, width);
#pragma GCC unroll 6
    for (int r = 0; r < kRows; ++r) tile.store(r, (r < kBlock ? x0 : x1) + (r % kBlock) * width);
  }

  // Backward substitution of one panel: subtracts the product with all rows below the panel, then solves with the transposed
  // triangle.
  template <int kWidth, int kRows, int kVectors>
  static PALPATE_INLINE void backward_panel(const Supernode<Number>& s, std::int32_t column, bool from_zero, Number* y,
                                            Number* own, std::int64_t width) {
    Tile<Number, kWidth, kRows, kVectors> tile;
    const Number* panel = panel_of(s, column);
    Number* x = own + kBlock * column * width;
    if (from_zero) {
#pragma GCC unroll 6
      for (int r = 0; r < kRows; ++r) tile.clear(r);
    } else {
#pragma GCC unroll 6
      for (int r = 0; r < kRows; ++r) {
        tile.load(r, x + r * width);
        if (kBlock == 4 && r % 4 == 3) tile.negate(r);
      }
    }
    const Number* a = panel + kRows * kRows;
    const Number* from = x + kRows * width;
    for (std::int32_t c = column + kRows / kBlock; c < s.columns; ++c, a += kBlock * kRows, from += kBlock * width)
#pragma GCC unroll 4
      for (int k = 0; k < kBlock; ++k) tile.subtract(a + k * kRows, 1, from + k * width);
    for (std::int32_t i = 0; i < s.below; ++i, a += kBlock * kRows) {
      from = y + kBlock * static_cast<std::int64_t>(s.rows[i]) * width;
#pragma GCC unroll 4
      for (int k = 0; k < kBlock; ++k) tile.subtract(a + k * kRows, 1, from + k * width);
    }
    tile.solve_transposed(panel);
#pragma GCC unroll 6
    for (int r = 0; r < kRows; ++r) tile.store(r, x + r * width);
  }

  template <int kDoubles, int kMost>
  static PALPATE_INLINE void forward(const Supernode<Number>& s, Number* y, int width) {
    constexpr int kWidth = kLanes<kDoubles>;
    Number* own = y + kBlock * static_cast<std::int64_t>(s.first) * width;
    const std::int64_t run = kBlock * static_cast<std::int64_t>(width);
    for (std::int32_t from = 0; from < s.columns; from += kAtOnce) {
      const std::int32_t to = from + kAtOnce < s.columns ? from + kAtOnce : s.columns;
      std::int32_t column = from;
      for (; column + kWide <= to; column += kWide)
        over_strips<kWidth, kMost>(
            width, [&]<int kVectors>(int at) __attribute__((always_inline)) {
              forward_own<kWidth, kPanel, kVectors>(s, from, column, own + at, width);
            });
      if (kWide > 1 && column < to)
        over_strips<kWidth, kMost>(
            width, [&]<int kVectors>(int at) __attribute__((always_inline)) {
              forward_own<kWidth, kBlock, kVectors>(s, from, column, own + at, width);
            });
      const std::int64_t height = static_cast<std::int64_t>(s.columns) + s.below;
      const auto place = [&](std::int64_t row) __attribute__((always_inline)) {
        return row < s.columns ? own + row * run : y + s.rows[row - s.columns] * run;
      };
      std::int64_t row = to;
      for (; row + kWide <= height; row += kWide) {
        Number *x0 = place(row), *x1 = place(row + kWide - 1);
        over_strips<kWidth, kMost>(
            width, [&]<int kVectors>(int at) __attribute__((always_inline)) {
              forward_under<kWidth, kPanel, kVectors>(s, from, to, row, x0 + at, x1 + at, own + at, width);
            });
      }
      if (kWide > 1 && row < height) {
        Number* x0 = place(row);
        over_strips<kWidth, kMost>(
            width, [&]<int kVectors>(int at) __attribute__((always_inline)) {
              forward_under<kWidth, kBlock, kVectors>(s, from, to, row, x0 + at, x0 + at, own + at, width);
            });
      }
    }
  }

  template <int kDoubles, int kMost>
  static PALPATE_INLINE void backward(const Supernode<Number>& s, bool from_zero, Number* y, int width) {
    constexpr int kWidth = kLanes<kDoubles>;
    Number* own = y + kBlock * static_cast<std::int64_t>(s.first) * width;
    std::int32_t column = s.columns;
    if (kWide > 1 && column % kWide) {
      --column;
      over_strips<kWidth, kMost>(
          width, [&]<int kVectors>(int at) __attribute__((always_inline)) {
            backward_panel<kWidth, kBlock, kVectors>(s, column, from_zero, y + at, own + at, width);
          });
    }
    while (column > 0) {
      column -= kWide;
      over_strips<kWidth, kMost>(
          width, [&]<int kVectors>(int at) __attribute__((always_inline)) {
            backward_panel<kWidth, kPanel, kVectors>(s, column, from_zero, y + at, own + at, width);
          });
    }
  }
};

using Double3 = Kernels<double, 3>;
using Double4 = Kernels<double, 4>;
using Float3 = Kernels<float, 3>;
using Float4 = Kernels<float, 4>;

// A tile and the row of the batch that it takes up fill the registers: 6 x 4 of 32, or 6 x 2 of 16; 4 x 6, or 4 x 3.
#define PALPATE_KERNELS_OF(Kind, Number, most8, most4, most2)                                                    \
  PALPATE_FOR_EACH_REGISTER(forward_##Kind, (const Supernode<Number>& s, Number* y, int width), (s, y, width),   \
                            Kind::forward, most8, most4, most2)                                                  \
  PALPATE_FOR_EACH_REGISTER(backward_##Kind, (const Supernode<Number>& s, bool from_zero, Number* y, int width), \
                            (s, from_zero, y, width), Kind::backward, most8, most4, most2)
PALPATE_KERNELS_OF(Double3, double, 4, 2, 2)
PALPATE_KERNELS_OF(Double4, double, 6, 3, 3)
PALPATE_KERNELS_OF(Float3, float, 4, 2, 2)
PALPATE_KERNELS_OF(Float4, float, 6, 3, 3)

}  // namespace

template <>
SupernodalKernels<double> supernodal_kernels(int block, int lanes) {
  if (block == 4) return {forward_Double4(lanes), backward_Double4(lanes)};
  return {forward_Double3(lanes), backward_Double3(lanes)};
}

template <>
SupernodalKernels<float> supernodal_kernels(int block, int lanes) {
  if (block == 4) return {forward_Float4(lanes), backward_Float4(lanes)};
  return {forward_Float3(lanes), backward_Float3(lanes)};
}

}  // namespace palpate
