#include "runtime/cut/dense_loops.h"

#include <cstring>

#include "runtime/base/instructions.h"

namespace palpate {
namespace {

#if defined(__GNUC__)
using Lanes = Eight;
#else
using Lanes = double;
#endif
constexpr std::int32_t kLanes = sizeof(Lanes) / sizeof(double);

template <int Rows, int Columns>
PALPATE_INLINE void product_tile(const double* const left, const double* const right, std::size_t stride,
                                 std::int32_t count, double* out, std::size_t out_stride) {
  Lanes sum[Rows][Columns] = {}, a, b;
  for (std::int32_t i = 0; i < count; i += kLanes) {
    Lanes of_right[Columns];
    for (int c = 0; c < Columns; ++c) {
      std::memcpy(&b, right + static_cast<std::size_t>(c) * stride + i, sizeof b);
      of_right[c] = b;
    }
    for (int r = 0; r < Rows; ++r) {
      std::memcpy(&a, left + static_cast<std::size_t>(r) * stride + i, sizeof a);
      for (int c = 0; c < Columns; ++c) sum[r][c] += a * of_right[c];
    }
  }
  for (int r = 0; r < Rows; ++r)
    for (int c = 0; c < Columns; ++c) {
      double part[kLanes], total = 0;
      std::memcpy(part, &sum[r][c], sizeof part);
      for (const double x : part) total += x;
      out[static_cast<std::size_t>(r) * out_stride + static_cast<std::size_t>(c)] = total;
    }
}

struct Products {
  const double *left, *right;
  std::int32_t rows, columns, count;
  std::size_t stride, out_stride;
  double* out;
};

template <int Rows, int Columns>
PALPATE_INLINE void product_columns(const Products& p, std::int32_t row) {
  std::int32_t c = 0;
  const double* const left = p.left + static_cast<std::size_t>(row) * p.stride;
  double* const out = p.out + static_cast<std::size_t>(row) * p.out_stride;
  for (; c + Columns <= p.columns; c += Columns)
    product_tile<Rows, Columns>(left, p.right + static_cast<std::size_t>(c) * p.stride, p.stride, p.count, out + c,
                                p.out_stride);
  for (; c < p.columns; ++c)
    product_tile<Rows, 1>(left, p.right + static_cast<std::size_t>(c) * p.stride, p.stride, p.count, out + c,
                          p.out_stride);
}
template <int Rows, int Columns>
PALPATE_INLINE void all_products(const Products& p) {
  std::int32_t r = 0;
  for (; r + Rows <= p.rows; r += Rows) product_columns<Rows, Columns>(p, r);
  for (; r < p.rows; ++r) product_columns<1, Columns>(p, r);
}

// Ten columns, of a tetrahedron of p1-anp, are two tiles of five.
template <int Rows, int Columns, int FewerRows, int MoreColumns>
PALPATE_INLINE void products_in_tiles(const Products& p) {
  if (p.columns % MoreColumns == 0)
    all_products<FewerRows, MoreColumns>(p);
  else
    all_products<Rows, Columns>(p);
}

PALPATE_INLINE void weigh_each(const PatternForces& patterns, std::int32_t count, const double* field, double* out) {
  constexpr std::int32_t kParts = kRowStep / kLanes;
  for (std::int32_t i = 0; i < count; ++i) {
    Lanes sum[kParts] = {}, x;
    for (std::int32_t at = patterns.first[i]; at < patterns.first[i + 1]; ++at) {
      const double* const from = field + 3 * kRowStep * static_cast<std::size_t>(patterns.slot[at]);
      for (int c = 0; c < 3; ++c)
        for (int part = 0; part < kParts; ++part) {
          std::memcpy(&x, from + c * kRowStep + part * kLanes, sizeof x);
          sum[part] += patterns.force[3 * static_cast<std::size_t>(at) + static_cast<std::size_t>(c)] * x;
        }
    }
    std::memcpy(out + kRowStep * static_cast<std::size_t>(i), sum, sizeof sum);
  }
}

struct Sums {
  double* to;
  std::int32_t rows, count, sources;
  std::size_t stride;
  const double* const* source;
  const double* coefficient;
};

template <int Rows, int Width>
PALPATE_INLINE void sum_tile(const Sums& s, std::int32_t row, std::int32_t begin) {
  Lanes sum[Rows][Width], x[Width];
  double* const to = s.to + static_cast<std::size_t>(row) * s.stride + begin;
  for (int r = 0; r < Rows; ++r)
    for (int w = 0; w < Width; ++w)
      std::memcpy(&sum[r][w], to + static_cast<std::size_t>(r) * s.stride + w * kLanes, sizeof(Lanes));
  const double* const coefficient = s.coefficient + static_cast<std::ptrdiff_t>(row) * s.sources;
  for (std::int32_t i = 0; i < s.sources; ++i) {
    for (int w = 0; w < Width; ++w) std::memcpy(&x[w], s.source[i] + begin + w * kLanes, sizeof(Lanes));
    for (int r = 0; r < Rows; ++r)
      for (int w = 0; w < Width; ++w) sum[r][w] += coefficient[r * s.sources + i] * x[w];
  }
  for (int r = 0; r < Rows; ++r)
    for (int w = 0; w < Width; ++w)
      std::memcpy(to + static_cast<std::size_t>(r) * s.stride + w * kLanes, &sum[r][w], sizeof(Lanes));
}
template <int Rows>
PALPATE_INLINE void sum_rows(const Sums& s, std::int32_t row, std::int32_t begin, std::int32_t end) {
  std::int32_t i = begin;
  for (; i + 2 * kLanes <= end; i += 2 * kLanes) sum_tile<Rows, 2>(s, row, i);
  for (; i < end; i += kLanes) sum_tile<Rows, 1>(s, row, i);
}
// Piece by piece of the rows, so that the sources' pieces stay in the first-level cache.
template <int Rows>
PALPATE_INLINE void all_sums(const Sums& s) {
  constexpr std::int32_t kPiece = 128;
  for (std::int32_t begin = 0; begin < s.count; begin += kPiece) {
    const std::int32_t end = begin + kPiece < s.count ? begin + kPiece : s.count;
    std::int32_t r = 0;
    for (; r + Rows <= s.rows; r += Rows) sum_rows<Rows>(s, r, begin, end);
    // The few columns of a change are rows here.
    if (r + 3 <= s.rows) sum_rows<3>(s, r, begin, end), r += 3;
    if (r + 2 <= s.rows) sum_rows<2>(s, r, begin, end), r += 2;
    if (r < s.rows) sum_rows<1>(s, r, begin, end);
  }
}

void products_baseline(const Products& p) {
  all_products<2, 3>(p);
}
void weigh_baseline(const PatternForces& patterns, std::int32_t count, const double* field, double* out) {
  weigh_each(patterns, count, field, out);
}
void sums_baseline(const Sums& s) {
  all_sums<2>(s);
}
#ifdef PALPATE_DISPATCHES
__attribute__((target(PALPATE_AVX2))) void products_avx2(const Products& p) {
  all_products<2, 3>(p);
}
__attribute__((target(PALPATE_AVX512))) void products_avx512(const Products& p) {
  products_in_tiles<8, 3, 4, 5>(p);
}
__attribute__((target(PALPATE_AVX2))) void weigh_avx2(const PatternForces& patterns, std::int32_t count,
                                                      const double* field, double* out) {
  weigh_each(patterns, count, field, out);
}
__attribute__((target(PALPATE_AVX512))) void weigh_avx512(const PatternForces& patterns, std::int32_t count,
                                                          const double* field, double* out) {
  weigh_each(patterns, count, field, out);
}
__attribute__((target(PALPATE_AVX2))) void sums_avx2(const Sums& s) {
  all_sums<2>(s);
}
__attribute__((target(PALPATE_AVX512))) void sums_avx512(const Sums& s) {
  all_sums<4>(s);
}
#endif

}  // namespace

void row_products(const double* left, std::int32_t rows, const double* right, std::int32_t columns, std::size_t stride,
                  std::int32_t count, double* out, std::size_t out_stride) {
  const Products p = {left, right, rows, columns, count, stride, out_stride, out};
#ifdef PALPATE_DISPATCHES
  const Instructions best = best_instructions();
  if (best == Instructions::avx512) return products_avx512(p);
  if (best == Instructions::avx2) return products_avx2(p);
#endif
  products_baseline(p);
}

void add_row_sums(double* to, std::int32_t rows, std::size_t stride, std::int32_t count, const double* const* source,
                  std::int32_t sources, const double* coefficient) {
  const Sums s = {to, rows, count, sources, stride, source, coefficient};
#ifdef PALPATE_DISPATCHES
  const Instructions best = best_instructions();
  if (best == Instructions::avx512) return sums_avx512(s);
  if (best == Instructions::avx2) return sums_avx2(s);
#endif
  sums_baseline(s);
}

void weigh_fields(const PatternForces& patterns, std::int32_t count, const double* field, double* out) {
#ifdef PALPATE_DISPATCHES
  const Instructions best = best_instructions();
  if (best == Instructions::avx512) return weigh_avx512(patterns, count, field, out);
  if (best == Instructions::avx2) return weigh_avx2(patterns, count, field, out);
#endif
  weigh_baseline(patterns, count, field, out);
}

}  // namespace palpate
