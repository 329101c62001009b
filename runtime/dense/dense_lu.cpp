#include "runtime/dense/dense_lu.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "runtime/dense/dense_rows.h"

namespace palpate {
namespace {

constexpr std::int32_t kBlock = 8;  // rows of a panel, and columns of L that are finished together

struct Matrix {
  double* numbers;
  std::size_t stride;
  double* row(std::int32_t i) const { return numbers + static_cast<std::size_t>(i) * stride; }
};

// Rows [top, top + rows) of the columns [begin, begin + a vector's lanes times Width): subtracts sum over k < end of l_ik u_kj, in
// the order of k. Rows beyond the last one are computed from the first one and not stored.
template <class Vector, int Width>
PALPATE_INLINE void eliminate_tile(const Matrix& a, std::int32_t top, std::int32_t rows, std::int32_t begin,
                                   std::int32_t end) {
  constexpr int kLanes = sizeof(Vector) / sizeof(double), kRows = 4;
  for (std::int32_t at = 0; at < rows; at += kRows) {
    double* row[kRows];
    Vector sum[kRows][Width], x;
    for (int r = 0; r < kRows; ++r) row[r] = a.row(top + at + (at + r < rows ? r : 0));
    for (int r = 0; r < kRows; ++r)
      for (int w = 0; w < Width; ++w) std::memcpy(&sum[r][w], row[r] + begin + w * kLanes, sizeof x);
    for (std::int32_t k = 0; k < end; ++k) {
      const double* upper = a.row(k) + begin;
      for (int w = 0; w < Width; ++w) {
        std::memcpy(&x, upper + w * kLanes, sizeof x);
        for (int r = 0; r < kRows; ++r) sum[r][w] -= row[r][k] * x;
      }
    }
    for (int r = 0; r < kRows && at + r < rows; ++r)
      for (int w = 0; w < Width; ++w) std::memcpy(row[r] + begin + w * kLanes, &sum[r][w], sizeof x);
  }
}

// Columns [begin, end), and up to two vectors less one number after them.
template <class Vector>
PALPATE_INLINE void eliminate(const Matrix& a, std::int32_t top, std::int32_t rows, std::int32_t begin,
                              std::int32_t end, std::int32_t pivots) {
  constexpr int kLanes = sizeof(Vector) / sizeof(double);
  for (; begin + kLanes < end; begin += 2 * kLanes) eliminate_tile<Vector, 2>(a, top, rows, begin, pivots);
  for (; begin < end; begin += kLanes) eliminate_tile<Vector, 1>(a, top, rows, begin, pivots);
}

// Finishes the block of columns [begin, end) of L in the rows of a panel that lie below the block's pivots.
void divide_block(const Matrix& a, std::int32_t top, std::int32_t rows, std::int32_t begin, std::int32_t end) {
  for (std::int32_t j = begin; j < end; ++j) {
    const double* upper = a.row(j);
    for (std::int32_t r = 0; r < rows; ++r) {
      double* row = a.row(top + r);
      const double factor = row[j] /= upper[j];
      for (std::int32_t i = j + 1; i < end; ++i) row[i] -= factor * upper[i];
    }
  }
}

// The panel's corner: its own L and U.
bool factor_corner(const Matrix& a, std::int32_t top, std::int32_t rows) {
  for (std::int32_t j = 0; j < rows; ++j) {
    const double* upper = a.row(top + j) + top;
    if (!std::isfinite(upper[j]) || upper[j] == 0) return false;
    for (std::int32_t r = j + 1; r < rows; ++r) {
      double* row = a.row(top + r) + top;
      const double factor = row[j] /= upper[j];
      for (std::int32_t i = j + 1; i < rows; ++i) row[i] -= factor * upper[i];
    }
  }
  return true;
}

// A panel of rows at a time: first its part of L, a block of columns after the other, then its corner, then its part of U.
template <class Vector>
PALPATE_INLINE bool factor(std::int32_t n, double* numbers, std::size_t stride) {
  const Matrix a = {numbers, stride};
  for (std::int32_t top = 0; top < n; top += kBlock) {
    const std::int32_t rows = std::min(kBlock, n - top), right = top + rows;
    for (std::int32_t block = 0; block < top; block += kBlock) {
      eliminate<Vector>(a, top, rows, block, block + kBlock, block);
      divide_block(a, top, rows, block, block + kBlock);
    }
    eliminate<Vector>(a, top, rows, top, n, top);
    if (!factor_corner(a, top, rows)) return false;
    for (std::int32_t r = 1; r < rows; ++r)
      for (std::int32_t s = 0; s < r; ++s) {
        const double factor = a.row(top + r)[top + s], *upper = a.row(top + s);
        double* row = a.row(top + r);
        for (std::int32_t j = right; j < n; ++j) row[j] -= factor * upper[j];
      }
  }
  return true;
}

#ifdef PALPATE_DISPATCHES
__attribute__((target(PALPATE_AVX2))) bool factor_avx2(std::int32_t n, double* a, std::size_t stride) {
  return factor<Four>(n, a, stride);
}
__attribute__((target(PALPATE_AVX512))) bool factor_avx512(std::int32_t n, double* a, std::size_t stride) {
  return factor<Eight>(n, a, stride);
}
#endif

}  // namespace

bool factor_lu(Instructions instructions, std::int32_t n, double* a, std::size_t stride) {
#ifdef PALPATE_DISPATCHES
  if (instructions == Instructions::avx512) return factor_avx512(n, a, stride);
  if (instructions == Instructions::avx2) return factor_avx2(n, a, stride);
#else
  static_cast<void>(instructions);
#endif
  return factor<Two>(n, a, stride);
}

bool factor_lu(std::int32_t n, double* a, std::size_t stride) {
  return factor_lu(best_instructions(), n, a, stride);
}

void solve_lu(std::int32_t n, const double* a, std::size_t stride, double* x) {
  const auto row = [&](std::int32_t i) { return a + static_cast<std::size_t>(i) * stride; };
  for (std::int32_t i = 1; i < n; ++i) x[i] -= dot_rows(i, row(i), x);
  for (std::int32_t i = n - 1; i >= 0; --i) x[i] = (x[i] - dot_rows(n - 1 - i, row(i) + i + 1, x + i + 1)) / row(i)[i];
}

}  // namespace palpate
