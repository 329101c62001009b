#include "runtime/dense/dense_panels.h"

#include <cstring>

namespace palpate {
namespace {

struct Panel {
  double* u;
  std::size_t stride;
  std::int32_t first, rows;
  bool divide;
  double* row(std::int32_t i) const { return u + static_cast<std::size_t>(i) * stride; }
};

// Rows [at, at + Rows) of the panel, columns [begin, begin + Width vectors). Rows beyond the panel's last one are computed from
// the first one and not stored. All inner loops are short and of constant length, so the compiler unrolls them and keeps the
// sums in registers.
template <class Vector, int Rows, int Width>
PALPATE_INLINE void eliminate_tile(const Panel& panel, std::int32_t at, std::int32_t begin) {
  constexpr int kLanes = sizeof(Vector) / sizeof(double);
  const std::int32_t top = panel.first + at, rows = panel.rows - at;
  Vector sum[Rows][Width], x;
  for (int r = 0; r < Rows; ++r)
    for (int w = 0; w < Width; ++w)
      std::memcpy(&sum[r][w], panel.row(top + (r < rows ? r : 0)) + begin + w * kLanes, sizeof x);
  // With division, the panel's rows above this tile are final too.
  const std::int32_t end = panel.divide ? top : panel.first;
  for (std::int32_t k = 0; k < end; ++k) {
    const double *row = panel.row(k), *left = row + top;
    for (int w = 0; w < Width; ++w) {
      std::memcpy(&x, row + begin + w * kLanes, sizeof x);
      for (int r = 0; r < Rows; ++r) sum[r][w] -= left[r] * x;
    }
  }
  for (int r = 0; r < Rows; ++r) {
    if (r >= rows) break;
    double* to = panel.row(top + r);
    if (panel.divide) {
      for (int s = 0; s < r; ++s)
        for (int w = 0; w < Width; ++w) sum[r][w] -= panel.row(top + s)[top + r] * sum[s][w];
      const double inverse = 1 / to[top + r];
      for (int w = 0; w < Width; ++w) sum[r][w] *= inverse;
    }
    for (int w = 0; w < Width; ++w) std::memcpy(to + begin + w * kLanes, &sum[r][w], sizeof x);
  }
}

// Two vectors side by side while there are enough columns, then one.
template <class Vector, int Rows>
PALPATE_INLINE void eliminate_with(const Panel& panel, std::int32_t begin, std::int32_t end) {
  constexpr int kLanes = sizeof(Vector) / sizeof(double);
  for (; begin + kLanes < end; begin += 2 * kLanes)
    for (std::int32_t at = 0; at < panel.rows; at += Rows) eliminate_tile<Vector, Rows, 2>(panel, at, begin);
  for (; begin < end; begin += kLanes)
    for (std::int32_t at = 0; at < panel.rows; at += Rows) eliminate_tile<Vector, Rows, 1>(panel, at, begin);
}

void eliminate_baseline(const Panel& panel, std::int32_t begin, std::int32_t end) {
  eliminate_with<Two, 4>(panel, begin, end);
}
#ifdef PALPATE_DISPATCHES
__attribute__((target(PALPATE_AVX2))) void eliminate_avx2(const Panel& panel, std::int32_t begin, std::int32_t end) {
  eliminate_with<Four, 4>(panel, begin, end);
}
__attribute__((target(PALPATE_AVX512))) void eliminate_avx512(const Panel& panel, std::int32_t begin,
                                                              std::int32_t end) {
  eliminate_with<Eight, 8>(panel, begin, end);
}
#endif

}  // namespace

void eliminate_rows(Instructions instructions, double* u, std::size_t stride, std::int32_t first, std::int32_t rows,
                    std::int32_t begin, std::int32_t end, bool divide) {
  if (begin >= end || (first == 0 && !divide)) return;  // no column, or no row to eliminate them with
  const Panel panel = {u, stride, first, rows, divide};
#ifdef PALPATE_DISPATCHES
  if (instructions == Instructions::avx512) return eliminate_avx512(panel, begin, end);
  if (instructions == Instructions::avx2) return eliminate_avx2(panel, begin, end);
#else
  static_cast<void>(instructions);
#endif
  eliminate_baseline(panel, begin, end);
}

void eliminate_rows(double* u, std::size_t stride, std::int32_t first, std::int32_t rows, std::int32_t begin,
                    std::int32_t end, bool divide) {
  eliminate_rows(best_instructions(), u, stride, first, rows, begin, end, divide);
}

}  // namespace palpate
