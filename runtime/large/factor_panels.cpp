#include "runtime/large/factor_panels.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace palpate {
namespace {

// The loops for one instruction set: tiles of Width vectors of rows and six columns, which stay in registers while k runs. A contact's
// and a node's columns come in threes.
template <class Vector, int Width>
struct Panels {
  static constexpr int kLanes = static_cast<int>(sizeof(Vector) / sizeof(double)), kRows = Width * kLanes;
  static_assert(kRows <= kPanelMargin);

  // c -= a b^T of `rows` rows, at most those of Vectors vectors, and Columns columns. Fresh: c counts as zero.
  template <bool Fresh, int Vectors, int Columns>
  static PALPATE_INLINE void tile(std::int32_t rows, std::int32_t k, const double* a, std::int32_t a_stride,
                                  const double* b, std::int32_t b_stride, double* c, std::int32_t c_stride) {
    Vector sum[Columns][Vectors] = {};
    for (std::int32_t l = 0; l < k; ++l, a += a_stride, b += b_stride) {
      Vector left[Vectors];
      for (int v = 0; v < Vectors; ++v) std::memcpy(&left[v], a + v * kLanes, sizeof(Vector));
      for (int j = 0; j < Columns; ++j)
        for (int v = 0; v < Vectors; ++v) sum[j][v] += left[v] * b[j];
    }
    for (int j = 0; j < Columns; ++j, c += c_stride) {
      if (rows == Vectors * kLanes) {
        for (int v = 0; v < Vectors; ++v) {
          Vector old = {};
          if (!Fresh) std::memcpy(&old, c + v * kLanes, sizeof old);
          old -= sum[j][v];
          std::memcpy(c + v * kLanes, &old, sizeof old);
        }
      } else {
        double part[Vectors * kLanes];
        for (int v = 0; v < Vectors; ++v) std::memcpy(part + v * kLanes, &sum[j][v], sizeof(Vector));
        for (std::int32_t i = 0; i < rows; ++i) c[i] = (Fresh ? 0 : c[i]) - part[i];
      }
    }
  }

  template <bool Fresh, int Vectors>
  static PALPATE_INLINE void rows_of_tiles(std::int32_t rows, std::int32_t n, std::int32_t k, const double* a,
                                           std::int32_t a_stride, const double* b, std::int32_t b_stride, double* c,
                                           std::int32_t c_stride) {
    std::int32_t j = 0;
    const auto at = [&](std::int32_t column) { return c + static_cast<std::int64_t>(column) * c_stride; };
    for (; j + 6 <= n; j += 6) tile<Fresh, Vectors, 6>(rows, k, a, a_stride, b + j, b_stride, at(j), c_stride);
    for (; j + 3 <= n; j += 3) tile<Fresh, Vectors, 3>(rows, k, a, a_stride, b + j, b_stride, at(j), c_stride);
    for (; j < n; ++j) tile<Fresh, Vectors, 1>(rows, k, a, a_stride, b + j, b_stride, at(j), c_stride);
  }

  template <bool Fresh>
  static PALPATE_INLINE void product(std::int32_t m, std::int32_t n, std::int32_t k, const double* a,
                                     std::int32_t a_stride, const double* b, std::int32_t b_stride, double* c,
                                     std::int32_t c_stride) {
    std::int32_t i = 0;
    for (; i + kRows / 2 < m; i += kRows)
      rows_of_tiles<Fresh, Width>(std::min(m - i, kRows), n, k, a + i, a_stride, b, b_stride, c + i, c_stride);
    for (; i < m; i += kRows / 2)
      rows_of_tiles<Fresh, Width / 2>(std::min(m - i, kRows / 2), n, k, a + i, a_stride, b, b_stride, c + i, c_stride);
  }

  // Of few columns, one after the other.
  static PALPATE_INLINE bool factorise_columns(std::int32_t rows, std::int32_t columns, double* panel,
                                               std::int32_t stride) {
    for (std::int32_t c = 0; c < columns; ++c) {
      double* const column = panel + static_cast<std::int64_t>(c) * stride;
      if (!(column[c] > 0)) return false;
      const double root = std::sqrt(column[c]);
      for (std::int32_t i = c; i < rows; ++i) column[i] /= root;
      for (std::int32_t d = c + 1; d < columns; ++d) {
        double* const other = panel + static_cast<std::int64_t>(d) * stride;
        const double factor = column[d];
        for (std::int32_t i = d; i < rows; ++i) other[i] -= factor * column[i];
      }
    }
    return true;
  }

  // Blocks of columns take what the columns before them subtract, all at once.
  static PALPATE_INLINE bool factorise(std::int32_t rows, std::int32_t columns, double* panel, std::int32_t stride) {
    constexpr std::int32_t few = 6;
    const auto at = [&](std::int32_t row, std::int32_t column) {
      return panel + static_cast<std::int64_t>(column) * stride + row;
    };
    for (std::int32_t block = 0; block < columns; block += kBlockColumns) {
      const std::int32_t end = std::min(block + kBlockColumns, columns);
      product<false>(rows - block, end - block, block, at(block, 0), stride, at(block, 0), stride, at(block, block),
                     stride);
      for (std::int32_t c = block; c < end; c += few) {
        const std::int32_t count = std::min(few, end - c);
        product<false>(rows - c, count, c - block, at(c, block), stride, at(c, block), stride, at(c, c), stride);
        if (!factorise_columns(rows - c, count, at(c, c), stride)) return false;
      }
    }
    return true;
  }

  // Of few columns. What is above the diagonal is zero. column: [size]
  static PALPATE_INLINE void invert_small(std::int32_t size, double* panel, std::int32_t stride, double* column) {
    for (std::int32_t c = 0; c < size; ++c) {
      std::fill(column, column + size, 0.0);
      column[c] = 1;
      for (std::int32_t k = c; k < size; ++k) {
        const double* const l = panel + static_cast<std::int64_t>(k) * stride;
        column[k] /= l[k];
        for (std::int32_t i = k + 1; i < size; ++i) column[i] -= column[k] * l[i];
      }
      // Column c of L is not read again: later columns of the inverse begin below it.
      std::copy(column + c, column + size, panel + static_cast<std::int64_t>(c) * stride + c);
    }
  }

  // From the last block of columns to the first: with X the inverse of what is behind a block and A the block's part below its
  // diagonal block D, the block becomes D^-1 above -X A D^-1.
  static PALPATE_INLINE void invert(std::int32_t size, double* panel, std::int32_t stride, double* scratch) {
    double* const turned = scratch;  // [few][few] D^-1, then [rows][few] A D^-1, rows first
    double* const below =
        scratch + static_cast<std::size_t>(kBlockColumns) * (static_cast<std::size_t>(size) + kBlockColumns);
    const auto at = [&](std::int32_t row, std::int32_t column) {
      return panel + static_cast<std::int64_t>(column) * stride + row;
    };
    for (std::int32_t c = 0; c < size; ++c) std::fill(at(0, c), at(c, c), 0.0);
    for (std::int32_t block = (size - 1) / kBlockColumns * kBlockColumns; block >= 0; block -= kBlockColumns) {
      const std::int32_t few = std::min(kBlockColumns, size - block), first = block + few, rows = size - first;
      invert_small(few, at(block, block), stride, below);
      if (rows == 0) continue;
      for (std::int32_t c = 0; c < few; ++c)
        for (std::int32_t r = 0; r < few; ++r) turned[few * r + c] = *at(block + r, block + c);
      product<true>(rows, few, few, at(first, block), stride, turned, few, below, rows);  // -A D^-1
      for (std::int32_t c = 0; c < few; ++c)
        for (std::int32_t r = 0; r < rows; ++r) turned[few * r + c] = -below[static_cast<std::int64_t>(c) * rows + r];
      for (std::int32_t top = 0; top < rows; top += kBlockColumns) {
        const std::int32_t count = std::min(kBlockColumns, rows - top);
        product<true>(count, few, top + count, at(first + top, first), stride, turned, few, at(first + top, block),
                      stride);
      }
    }
  }
};

using Plain = Panels<Two, 2>;
#ifdef PALPATE_DISPATCHES
using WithAvx2 = Panels<Four, 2>;
using WithAvx512 = Panels<Eight, 4>;

template <bool Fresh>
__attribute__((target(PALPATE_AVX2))) void product_avx2(std::int32_t m, std::int32_t n, std::int32_t k, const double* a,
                                                        std::int32_t a_stride, const double* b, std::int32_t b_stride,
                                                        double* c, std::int32_t c_stride) {
  WithAvx2::product<Fresh>(m, n, k, a, a_stride, b, b_stride, c, c_stride);
}
template <bool Fresh>
__attribute__((target(PALPATE_AVX512))) void product_avx512(std::int32_t m, std::int32_t n, std::int32_t k,
                                                            const double* a, std::int32_t a_stride, const double* b,
                                                            std::int32_t b_stride, double* c, std::int32_t c_stride) {
  WithAvx512::product<Fresh>(m, n, k, a, a_stride, b, b_stride, c, c_stride);
}
__attribute__((target(PALPATE_AVX2))) bool factorise_avx2(std::int32_t rows, std::int32_t columns, double* panel,
                                                          std::int32_t stride) {
  return WithAvx2::factorise(rows, columns, panel, stride);
}
__attribute__((target(PALPATE_AVX512))) bool factorise_avx512(std::int32_t rows, std::int32_t columns, double* panel,
                                                              std::int32_t stride) {
  return WithAvx512::factorise(rows, columns, panel, stride);
}
__attribute__((target(PALPATE_AVX2))) void invert_avx2(std::int32_t size, double* panel, std::int32_t stride,
                                                       double* scratch) {
  WithAvx2::invert(size, panel, stride, scratch);
}
__attribute__((target(PALPATE_AVX512))) void invert_avx512(std::int32_t size, double* panel, std::int32_t stride,
                                                           double* scratch) {
  WithAvx512::invert(size, panel, stride, scratch);
}
#endif

template <bool Fresh>
void product_with(Instructions instructions, std::int32_t m, std::int32_t n, std::int32_t k, const double* a,
                  std::int32_t a_stride, const double* b, std::int32_t b_stride, double* c, std::int32_t c_stride) {
#ifdef PALPATE_DISPATCHES
  if (instructions == Instructions::avx512)
    return product_avx512<Fresh>(m, n, k, a, a_stride, b, b_stride, c, c_stride);
  if (instructions == Instructions::avx2) return product_avx2<Fresh>(m, n, k, a, a_stride, b, b_stride, c, c_stride);
#else
  static_cast<void>(instructions);
#endif
  Plain::product<Fresh>(m, n, k, a, a_stride, b, b_stride, c, c_stride);
}

}  // namespace

void subtract_product(Instructions instructions, std::int32_t m, std::int32_t n, std::int32_t k, const double* a,
                      std::int32_t a_stride, const double* b, std::int32_t b_stride, double* c, std::int32_t c_stride) {
  product_with<false>(instructions, m, n, k, a, a_stride, b, b_stride, c, c_stride);
}
void negative_product(Instructions instructions, std::int32_t m, std::int32_t n, std::int32_t k, const double* a,
                      std::int32_t a_stride, const double* b, std::int32_t b_stride, double* c, std::int32_t c_stride) {
  product_with<true>(instructions, m, n, k, a, a_stride, b, b_stride, c, c_stride);
}

bool factorise_panel(Instructions instructions, std::int32_t rows, std::int32_t columns, double* panel,
                     std::int32_t stride) {
#ifdef PALPATE_DISPATCHES
  if (instructions == Instructions::avx512) return factorise_avx512(rows, columns, panel, stride);
  if (instructions == Instructions::avx2) return factorise_avx2(rows, columns, panel, stride);
#else
  static_cast<void>(instructions);
#endif
  return Plain::factorise(rows, columns, panel, stride);
}

void invert_triangle(Instructions instructions, std::int32_t size, double* panel, std::int32_t stride,
                     double* scratch) {
#ifdef PALPATE_DISPATCHES
  if (instructions == Instructions::avx512) return invert_avx512(size, panel, stride, scratch);
  if (instructions == Instructions::avx2) return invert_avx2(size, panel, stride, scratch);
#else
  static_cast<void>(instructions);
#endif
  Plain::invert(size, panel, stride, scratch);
}

}  // namespace palpate
