#include "runtime/dense/superposition.h"

#include <cstdint>
#include <cstring>
#include <iterator>
#include <type_traits>

#include "formats/half.h"

#ifdef PALPATE_DISPATCHES
#include <immintrin.h>
#endif

namespace palpate {
namespace {

// Numbers of the output that are completed at a time: they stay in the first-level cache while all columns are added.
constexpr std::size_t kTile = 3072;

using Kernel = void (*)(const void* const* column, const float* coefficient, std::size_t begin, std::size_t count,
                        float* __restrict out);
using Half = std::uint16_t;

// Distance in bytes at which each column is prefetched: a read from memory takes 0.1 us, in which three columns advance by six lines, and
// twelve by less. 256 to 512 take a fifth less time than 1024, whose requests wait for one another (touch_and_shape of runtime_bench). Without it, the
// processor's own prefetcher starts again at every page of every column.
constexpr std::size_t kAhead = 384;

// Adds Width columns at a time: each output number is loaded and stored once for all of them. The function is inlined into one
// function per instruction set, and the compiler uses that set's vector width. Every product and every sum is rounded by
// itself, in the order of the columns, so every instruction set gives the same bits.
template <class Stored, int Width>
PALPATE_INLINE void add_columns(const void* const* column, const float* coefficient, std::size_t begin,
                                std::size_t count, float* __restrict out) {
  constexpr std::size_t kLine = 64 / sizeof(Stored);
  const Stored* p[Width];
  float c[Width];
  for (int j = 0; j < Width; ++j) p[j] = static_cast<const Stored*>(column[j]) + begin, c[j] = coefficient[j];
  std::size_t i = 0;
  for (; i + kLine <= count; i += kLine) {
    for (int j = 0; j < Width; ++j) prefetch(reinterpret_cast<const char*>(p[j] + i) + kAhead);
    for (std::size_t lane = i; lane < i + kLine; ++lane) {
      float sum = out[lane];
      for (int j = 0; j < Width; ++j) sum += c[j] * formats::float_of(p[j][lane]);
      out[lane] = sum;
    }
  }
  for (; i < count; ++i) {
    float sum = out[i];
    for (int j = 0; j < Width; ++j) sum += c[j] * formats::float_of(p[j][i]);
    out[i] = sum;
  }
}

// The instruction set that the build targets: SSE2 on x86-64, NEON on AArch64.
struct Baseline {
  template <class Stored, int Width>
  static void add(const void* const* column, const float* coefficient, std::size_t begin, std::size_t count,
                  float* __restrict out) {
    add_columns<Stored, Width>(column, coefficient, begin, count, out);
  }
};

#ifdef PALPATE_DISPATCHES
#define PALPATE_WITH_AVX2 __attribute__((target(PALPATE_AVX2)))

// Eight numbers of out with Width columns of f16 numbers added, by the processor's conversion instruction, which gives the same
// numbers as float_of_half.
template <int Width>
PALPATE_WITH_AVX2 inline __m256 eight_with_halves(const Half* const* p, const float* coefficient, std::size_t lane,
                                                  const float* out) {
  __m256 sum = _mm256_loadu_ps(out + lane);
  for (int j = 0; j < Width; ++j) {
    const __m256 stored = _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p[j] + lane)));
    sum = _mm256_add_ps(sum, _mm256_mul_ps(_mm256_set1_ps(coefficient[j]), stored));
  }
  return sum;
}

template <int Width>
PALPATE_WITH_AVX2 void add_halves_avx2(const void* const* column, const float* coefficient, std::size_t begin,
                                       std::size_t count, float* __restrict out) {
  const Half* p[Width];
  for (int j = 0; j < Width; ++j) p[j] = static_cast<const Half*>(column[j]) + begin;
  std::size_t i = 0;
  for (; i + 32 <= count; i += 32) {
    for (int j = 0; j < Width; ++j) prefetch(reinterpret_cast<const char*>(p[j] + i) + kAhead);
    for (std::size_t lane = i; lane < i + 32; lane += 8)
      _mm256_storeu_ps(out + lane, eight_with_halves<Width>(p, coefficient, lane, out));
  }
  for (; i + 8 <= count; i += 8) _mm256_storeu_ps(out + i, eight_with_halves<Width>(p, coefficient, i, out));
  if (i == count) return;
  if (count < 8) return add_columns<Half, Width>(column, coefficient, begin + i, count - i, out + i);
  // The last numbers: eight, of which the first ones are complete already.
  float last[8];
  _mm256_storeu_ps(last, eight_with_halves<Width>(p, coefficient, count - 8, out));
  std::memcpy(out + i, last + (8 - (count - i)), (count - i) * sizeof(float));
}

struct Avx2 {
  template <class Stored, int Width>
  __attribute__((target(PALPATE_AVX2))) static void add(const void* const* column, const float* coefficient,
                                                        std::size_t begin, std::size_t count, float* __restrict out) {
    if constexpr (std::is_same_v<Stored, Half>)
      add_halves_avx2<Width>(column, coefficient, begin, count, out);
    else
      add_columns<Stored, Width>(column, coefficient, begin, count, out);
  }
};

// For f32 alone; the other types are as fast with AVX2.
struct Avx512 {
  template <class Stored, int Width>
  __attribute__((target(PALPATE_AVX512))) static void add(const void* const* column, const float* coefficient,
                                                          std::size_t begin, std::size_t count, float* __restrict out) {
    add_columns<Stored, Width>(column, coefficient, begin, count, out);
  }
};
#endif

// The kernels of one element type by the number of columns, widest first. A contact node has three columns; the last kernel
// handles the columns that remain of any other number.
constexpr int kWidths[] = {12, 9, 6, 3, 1};
struct Kernels {
  Kernel add[std::size(kWidths)];
};
template <class Instructions, class Stored>
constexpr Kernels kKernels = {{&Instructions::template add<Stored, 12>, &Instructions::template add<Stored, 9>,
                               &Instructions::template add<Stored, 6>, &Instructions::template add<Stored, 3>,
                               &Instructions::template add<Stored, 1>}};

#ifdef PALPATE_DISPATCHES
// On x86-64 nearly every processor has wider instructions, so the baseline has few kernels.
template <class Stored>
constexpr Kernels kKernels<Baseline, Stored> = {
    {nullptr, nullptr, &Baseline::add<Stored, 6>, &Baseline::add<Stored, 3>, &Baseline::add<Stored, 1>}};
#endif
// Converting halves one by one takes nearly all the time, so wider kernels would only add code.
template <>
constexpr Kernels kKernels<Baseline, Half> = {
    {nullptr, nullptr, nullptr, &Baseline::add<Half, 3>, &Baseline::add<Half, 1>}};

template <class Instructions>
const Kernels& kernels(formats::ElementType type) {
  if (type == formats::ElementType::f64) return kKernels<Instructions, double>;
  if (type == formats::ElementType::f32) return kKernels<Instructions, float>;
  return kKernels<Instructions, Half>;
}

const Kernels& kernels(Instructions instructions, formats::ElementType type) {
#ifdef PALPATE_DISPATCHES
  if (instructions == Instructions::avx512 && type == formats::ElementType::f32) return kKernels<Avx512, float>;
  if (instructions != Instructions::baseline) return kernels<Avx2>(type);
#else
  static_cast<void>(instructions);
#endif
  return kernels<Baseline>(type);
}

// onto: adds to the numbers in out; otherwise the sum starts at zero.
void add_all(const Kernels& use, const void* const* column, const float* coefficient, int column_count,
             std::size_t first, std::size_t count, bool onto, float* out) {
  for (std::size_t begin = 0; begin < count; begin += kTile) {
    const std::size_t size = count - begin < kTile ? count - begin : kTile;
    if (!onto) std::memset(out + begin, 0, size * sizeof(float));
    int done = 0;
    for (std::size_t w = 0; w < std::size(kWidths); ++w)
      for (; use.add[w] && column_count - done >= kWidths[w]; done += kWidths[w])
        use.add[w](column + done, coefficient + done, first + begin, size, out + begin);
  }
}

}  // namespace

void superpose(formats::ElementType type, const void* const* column, const float* coefficient, int column_count,
               std::size_t first, std::size_t count, float* out) {
  superpose(best_instructions(), type, column, coefficient, column_count, first, count, out);
}

void superpose_onto(formats::ElementType type, const void* const* column, const float* coefficient, int column_count,
                    std::size_t first, std::size_t count, float* out) {
  add_all(kernels(best_instructions(), type), column, coefficient, column_count, first, count, true, out);
}

void superpose(Instructions instructions, formats::ElementType type, const void* const* column,
               const float* coefficient, int column_count, std::size_t first, std::size_t count, float* out) {
  add_all(kernels(instructions, type), column, coefficient, column_count, first, count, false, out);
}

}  // namespace palpate
