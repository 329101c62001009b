#include "runtime/superposition.h"

#include <cstdint>
#include <utility>

#include "runtime/half.h"

#if defined(__GNUC__) && defined(__x86_64__)
#define PALPATE_HAS_F16C_KERNEL 1
#include <immintrin.h>
#endif

namespace palpate {
namespace {

// A block of the output that stays in the first-level cache while every group of columns adds to it.
constexpr std::size_t kBlock = 3072;
constexpr int kGroup = 12;

using Kernel = void (*)(const void* const* column, const float* coefficient, std::size_t begin, std::size_t count,
                        float* __restrict out);
using Half = std::uint16_t;

inline float as_float(float stored) {
  return stored;
}
inline float as_float(double stored) {
  return static_cast<float>(stored);
}
inline float as_float(Half stored) {
  return float_of_half(stored);
}

// Width columns at a time: one load of each, one load and store of the output.
template <class Stored, int Width, bool First>
void add_group(const void* const* column, const float* coefficient, std::size_t begin, std::size_t count,
               float* __restrict out) {
  const Stored* p[Width];
  float c[Width];
  for (int j = 0; j < Width; ++j) p[j] = static_cast<const Stored*>(column[j]) + begin, c[j] = coefficient[j];
  for (std::size_t i = 0; i < count; ++i) {
    float sum = First ? 0.0f : out[i];
    for (int j = 0; j < Width; ++j) sum += c[j] * as_float(p[j][i]);
    out[i] = sum;
  }
}

// The kernels of one element type by width, 1 .. kGroup.
struct Kernels {
  Kernel first[kGroup], next[kGroup];
};

template <class Stored, int... I>
constexpr Kernels kernels_of(std::integer_sequence<int, I...>) {
  return {{add_group<Stored, I + 1, true>...}, {add_group<Stored, I + 1, false>...}};
}
template <class Stored>
constexpr Kernels kKernels = kernels_of<Stored>(std::make_integer_sequence<int, kGroup>{});

#ifdef PALPATE_HAS_F16C_KERNEL
// The same sums in the same order, eight at a time.
template <int Width, bool First>
__attribute__((target("avx2,f16c"))) void add_group_f16c(const void* const* column, const float* coefficient,
                                                         std::size_t begin, std::size_t count, float* __restrict out) {
  const Half* p[Width];
  __m256 c[Width];
  for (int j = 0; j < Width; ++j)
    p[j] = static_cast<const Half*>(column[j]) + begin, c[j] = _mm256_set1_ps(coefficient[j]);
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8) {
    __m256 sum = First ? _mm256_setzero_ps() : _mm256_loadu_ps(out + i);
    for (int j = 0; j < Width; ++j) {
      const __m128i stored = _mm_loadu_si128(reinterpret_cast<const __m128i*>(p[j] + i));
      sum = _mm256_add_ps(sum, _mm256_mul_ps(c[j], _mm256_cvtph_ps(stored)));
    }
    _mm256_storeu_ps(out + i, sum);
  }
  for (; i < count; ++i) {
    float sum = First ? 0.0f : out[i];
    for (int j = 0; j < Width; ++j) sum += coefficient[j] * as_float(p[j][i]);
    out[i] = sum;
  }
}

template <int... I>
constexpr Kernels f16c_kernels(std::integer_sequence<int, I...>) {
  return {{add_group_f16c<I + 1, true>...}, {add_group_f16c<I + 1, false>...}};
}
constexpr Kernels kF16cKernels = f16c_kernels(std::make_integer_sequence<int, kGroup>{});
#endif

const Kernels& kernels(formats::ElementType type) {
  if (type == formats::ElementType::f64) return kKernels<double>;
  if (type == formats::ElementType::f32) return kKernels<float>;
#ifdef PALPATE_HAS_F16C_KERNEL
  // Every processor with AVX2 has F16C; not every compiler can ask for the latter.
  if (__builtin_cpu_supports("avx2")) return kF16cKernels;
#endif
  return kKernels<Half>;
}

}  // namespace

void superpose(formats::ElementType type, const void* const* column, const float* coefficient, int column_count,
               std::size_t first, std::size_t count, float* out) {
  const Kernels& use = kernels(type);
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t size = count - begin < kBlock ? count - begin : kBlock;
    if (column_count == 0)
      for (std::size_t i = 0; i < size; ++i) out[begin + i] = 0;
    for (int j = 0; j < column_count; j += kGroup) {
      const int width = column_count - j < kGroup ? column_count - j : kGroup;
      const Kernel add = (j == 0 ? use.first : use.next)[width - 1];
      add(column + j, coefficient + j, first + begin, size, out + begin);
    }
  }
}

}  // namespace palpate
