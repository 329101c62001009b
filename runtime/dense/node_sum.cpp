#include "runtime/dense/node_sum.h"

#include <algorithm>
#include <cstdint>
#include <type_traits>

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

// Numbers of a run that are completed at a time: their sums stay in the first-level cache while all columns are added.
constexpr std::size_t kTile = 192;

// Adds Width columns to the sums of one side, in their order. As in superposition.cpp, the function is inlined into one function per
// instruction set, and every product and every sum is rounded by itself.
template <int Width, class Stored>
PALPATE_INLINE void add_to_side(const Stored* const* at, const double* coefficient, std::size_t count,
                                double* __restrict sum) {
  for (std::size_t i = 0; i < count; ++i) {
    double s = sum[i];
    for (int k = 0; k < Width; ++k) s += coefficient[k] * as_double(at[k][i]);
    sum[i] = s;
  }
}

// The columns j, j + 4 and j + 8 of one side in one pass over its sums.
template <class Stored>
PALPATE_INLINE void add_to_sides(const void* const* column, const double* coefficient, int column_count,
                                 std::size_t first, std::size_t count, double sum[kSide][kTile]) {
  constexpr int kTogether = 3;
  int j = 0;
  for (; j + kTogether * kSide <= column_count; j += kTogether * kSide)
    for (int side = 0; side < kSide; ++side) {
      const Stored* at[kTogether];
      double c[kTogether];
      for (int k = 0; k < kTogether; ++k) {
        const int from = j + side + k * kSide;
        at[k] = static_cast<const Stored*>(column[from]) + first, c[k] = coefficient[from];
      }
      add_to_side<kTogether>(at, c, count, sum[side]);
    }
  for (; j < column_count; ++j) {
    const Stored* const at = static_cast<const Stored*>(column[j]) + first;
    add_to_side<1>(&at, coefficient + j, count, sum[j % kSide]);
  }
}

// The instruction set that the build targets.
struct Baseline {
  template <class Stored>
  static void add(const void* const* column, const double* coefficient, int column_count, std::size_t first,
                  std::size_t count, double sum[kSide][kTile]) {
    add_to_sides<Stored>(column, coefficient, column_count, first, count, sum);
  }
};

#ifdef PALPATE_DISPATCHES
struct Avx2 {
  template <class Stored>
  PALPATE_WITH_AVX2 static void add(const void* const* column, const double* coefficient, int column_count,
                                    std::size_t first, std::size_t count, double sum[kSide][kTile]) {
    if constexpr (std::is_same_v<Stored, Half>) {
      // Four numbers at a time by the processor's conversion, which gives the same numbers as float_of_half.
      for (int j = 0; j < column_count; ++j) {
        const Half* const at = static_cast<const Half*>(column[j]) + first;
        double* const to = sum[j % kSide];
        std::size_t i = 0;
        for (; i + 4 <= count; i += 4)
          _mm256_storeu_pd(to + i, _mm256_add_pd(_mm256_loadu_pd(to + i),
                                                 _mm256_mul_pd(_mm256_set1_pd(coefficient[j]), read_four(at + i))));
        for (; i < count; ++i) to[i] += coefficient[j] * as_double(at[i]);
      }
    } else {
      add_to_sides<Stored>(column, coefficient, column_count, first, count, sum);
    }
  }
};

struct Avx512 {
  template <class Stored>
  __attribute__((target(PALPATE_AVX512))) static void add(const void* const* column, const double* coefficient,
                                                          int column_count, std::size_t first, std::size_t count,
                                                          double sum[kSide][kTile]) {
    add_to_sides<Stored>(column, coefficient, column_count, first, count, sum);
  }
};
#endif

using AddToSides = void (*)(const void* const* column, const double* coefficient, int column_count, std::size_t first,
                            std::size_t count, double sum[kSide][kTile]);

template <class Stored>
AddToSides add_to_sides_with([[maybe_unused]] Instructions instructions) {
#ifdef PALPATE_DISPATCHES
  if (instructions == Instructions::avx512 && !std::is_same_v<Stored, Half>) return &Avx512::add<Stored>;
  if (instructions != Instructions::baseline) return &Avx2::add<Stored>;
#endif
  return &Baseline::add<Stored>;
}

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

void sum_at_run(formats::ElementType type, const void* const* column, const double* coefficient, int column_count,
                std::size_t first, std::size_t count, double* out) {
  sum_at_run(best_instructions(), type, column, coefficient, column_count, first, count, out);
}

void sum_at_run(Instructions instructions, formats::ElementType type, const void* const* column,
                const double* coefficient, int column_count, std::size_t first, std::size_t count, double* out) {
  const AddToSides add = type == formats::ElementType::f32   ? add_to_sides_with<float>(instructions)
                         : type == formats::ElementType::f64 ? add_to_sides_with<double>(instructions)
                                                             : add_to_sides_with<Half>(instructions);
  double sum[kSide][kTile];
  for (std::size_t begin = 0; begin < count; begin += kTile) {
    const std::size_t size = std::min(kTile, count - begin);
    for (double* side : sum) std::fill(side, side + size, 0.0);
    add(column, coefficient, column_count, first + begin, size, sum);
    for (std::size_t i = 0; i < size; ++i) out[begin + i] = (sum[0][i] + sum[1][i]) + (sum[2][i] + sum[3][i]);
  }
}

}  // namespace palpate
