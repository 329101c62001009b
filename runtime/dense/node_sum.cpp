#include "runtime/dense/node_sum.h"

#include <cstdint>

#include "formats/half.h"
#include "runtime/base/instructions.h"

#ifdef PALPATE_DISPATCHES
#include <immintrin.h>
#endif

namespace palpate {
namespace {

using Half = std::uint16_t;

constexpr int kSide = 4;  // sums side by side

double as_double(float stored) {
  return static_cast<double>(stored);
}
double as_double(double stored) {
  return stored;
}
double as_double(Half stored) {
  return static_cast<double>(formats::float_of_half(stored));
}

template <class Stored>
void sum_columns(const void* const* column, const double* coefficient, int column_count, std::size_t first,
                 double* out) {
  double sum[kSide][3] = {};
  const auto add = [&](int j, int side) {
    const Stored* at = static_cast<const Stored*>(column[j]) + first;
    for (int d = 0; d < 3; ++d) sum[side][d] += coefficient[j] * as_double(at[d]);
  };
  int j = 0;
  for (; j + kSide <= column_count; j += kSide)
    for (int side = 0; side < kSide; ++side) add(j + side, side);
  for (int side = 0; j < column_count; ++j, ++side) add(j, side);
  for (int d = 0; d < 3; ++d) out[d] = (sum[0][d] + sum[1][d]) + (sum[2][d] + sum[3][d]);
}

#ifdef PALPATE_DISPATCHES
#define PALPATE_WITH_AVX2 __attribute__((target(PALPATE_AVX2)))

// Four numbers from `at` on. The fourth one is not used.
PALPATE_WITH_AVX2 inline __m256d read_four(const float* at) {
  return _mm256_cvtps_pd(_mm_loadu_ps(at));
}
PALPATE_WITH_AVX2 inline __m256d read_four(const double* at) {
  return _mm256_loadu_pd(at);
}
PALPATE_WITH_AVX2 inline __m256d read_four(const Half* at) {
  return _mm256_cvtps_pd(_mm_cvtph_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(at))));
}

template <class Stored>
PALPATE_WITH_AVX2 void sum_columns_avx2(const void* const* column, const double* coefficient, int column_count,
                                        std::size_t first, double* out) {
  __m256d sum[kSide] = {_mm256_setzero_pd(), _mm256_setzero_pd(), _mm256_setzero_pd(), _mm256_setzero_pd()};
  const auto product = [&](int j) PALPATE_WITH_AVX2 {
    return _mm256_mul_pd(_mm256_set1_pd(coefficient[j]), read_four(static_cast<const Stored*>(column[j]) + first));
  };
  int j = 0;
  for (; j + kSide <= column_count; j += kSide)
    for (int side = 0; side < kSide; ++side) sum[side] = _mm256_add_pd(sum[side], product(j + side));
  for (int side = 0; j < column_count; ++j, ++side) sum[side] = _mm256_add_pd(sum[side], product(j));
  double all[4];
  _mm256_storeu_pd(all, _mm256_add_pd(_mm256_add_pd(sum[0], sum[1]), _mm256_add_pd(sum[2], sum[3])));
  for (int d = 0; d < 3; ++d) out[d] = all[d];
}
#endif

template <class Stored>
void sum_stored([[maybe_unused]] Instructions instructions, const void* const* column, const double* coefficient,
                int column_count, std::size_t first, [[maybe_unused]] std::size_t column_size, double* out) {
#ifdef PALPATE_DISPATCHES
  // The number after a column's last node is not there to be read.
  if (first + 4 <= column_size && instructions != Instructions::baseline)
    return sum_columns_avx2<Stored>(column, coefficient, column_count, first, out);
#endif
  sum_columns<Stored>(column, coefficient, column_count, first, out);
}

}  // namespace

void sum_at_node(formats::ElementType type, const void* const* column, const double* coefficient, int column_count,
                 std::size_t first, std::size_t column_size, double* out) {
  sum_at_node(best_instructions(), type, column, coefficient, column_count, first, column_size, out);
}

void sum_at_node(Instructions instructions, formats::ElementType type, const void* const* column,
                 const double* coefficient, int column_count, std::size_t first, std::size_t column_size, double* out) {
  if (type == formats::ElementType::f32)
    return sum_stored<float>(instructions, column, coefficient, column_count, first, column_size, out);
  if (type == formats::ElementType::f64)
    return sum_stored<double>(instructions, column, coefficient, column_count, first, column_size, out);
  sum_stored<Half>(instructions, column, coefficient, column_count, first, column_size, out);
}

}  // namespace palpate
