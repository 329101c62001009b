#include "runtime/dense/loaded_runs.h"

#include "formats/half.h"

#ifdef PALPATE_DISPATCHES
#include <immintrin.h>
#endif

namespace palpate {
namespace {

using Half = std::uint16_t;
using formats::ElementType;

// Runs that are fetched ahead: each run is read at a few distant places, which the processor does not foresee.
constexpr std::size_t kRunsAhead = 8;

template <class Stored>
void fetch_ahead(const Stored* at, std::size_t stride) {
  prefetch(reinterpret_cast<const char*>(at) + kRunsAhead * stride * sizeof(Stored));
}

// Each of the three dofs is summed over the loads by itself.
template <class Stored>
void multiply_loads(const Stored* run, const RunsOfSlots& runs, int from, const Loads& loads, float* y) {
  run += static_cast<std::size_t>(from) * runs.stride;
  for (int r = from; r < runs.count; ++r, run += runs.stride) {
    float sum[3] = {};
    for (int l = 0; l < loads.count; ++l) {
      const Stored* at = run + 3 * static_cast<std::ptrdiff_t>(loads.slot[l] - runs.slot);
      fetch_ahead(at, runs.stride);
      for (int d = 0; d < 3; ++d) sum[d] += loads.force[3 * l + d] * formats::float_of(at[d]);
    }
    y[r] += runs.scale * ((sum[0] + sum[1]) + sum[2]);
  }
}

#ifdef PALPATE_DISPATCHES
#define PALPATE_WITH_AVX2 __attribute__((target(PALPATE_AVX2)))

PALPATE_WITH_AVX2 inline __m128 read_four(const float* at) {
  return _mm_loadu_ps(at);
}
PALPATE_WITH_AVX2 inline __m128 read_four(const Half* at) {
  return _mm_cvtph_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(at)));
}

// Four runs side by side. Reads a fourth number at each place, which is not used; of the last run it may be outside.
template <class Stored>
PALPATE_WITH_AVX2 void multiply_loads_avx2(const Stored* run, const RunsOfSlots& runs, const Loads& loads, float* y) {
  const std::size_t stride = runs.stride;
  const __m128 scale = _mm_set1_ps(runs.scale);
  int r = 0;
  for (; r + 4 < runs.count; r += 4) {
    const Stored* first = run + static_cast<std::size_t>(r) * stride;
    __m128 a = _mm_setzero_ps(), b = a, c = a, d = a;
    for (int l = 0; l < loads.count; ++l) {
      const Stored* at = first + 3 * static_cast<std::ptrdiff_t>(loads.slot[l] - runs.slot);
      for (std::size_t k = 0; k < 4; ++k) fetch_ahead(at + k * stride, stride);
      const float* f = loads.force + 3 * static_cast<std::ptrdiff_t>(l);
      const __m128 force = _mm_setr_ps(f[0], f[1], f[2], 0);
      a = _mm_add_ps(a, _mm_mul_ps(force, read_four(at)));
      b = _mm_add_ps(b, _mm_mul_ps(force, read_four(at + stride)));
      c = _mm_add_ps(c, _mm_mul_ps(force, read_four(at + 2 * stride)));
      d = _mm_add_ps(d, _mm_mul_ps(force, read_four(at + 3 * stride)));
    }
    _MM_TRANSPOSE4_PS(a, b, c, d);
    const __m128 sum = _mm_add_ps(_mm_add_ps(a, b), c);
    _mm_storeu_ps(y + r, _mm_add_ps(_mm_loadu_ps(y + r), _mm_mul_ps(scale, sum)));
  }
  multiply_loads(run, runs, r, loads, y);
}
#endif

}  // namespace

void multiply_loads_onto(Instructions instructions, const RunsOfSlots& runs, const Loads& loads, float* y) {
  if (runs.type == ElementType::f64) return multiply_loads(static_cast<const double*>(runs.numbers), runs, 0, loads, y);
  const auto* halves = static_cast<const Half*>(runs.numbers);
  const auto* floats = static_cast<const float*>(runs.numbers);
  const bool half = runs.type == ElementType::f16;
#ifdef PALPATE_DISPATCHES
  if (instructions != Instructions::baseline)
    return half ? multiply_loads_avx2(halves, runs, loads, y) : multiply_loads_avx2(floats, runs, loads, y);
#else
  static_cast<void>(instructions);
#endif
  half ? multiply_loads(halves, runs, 0, loads, y) : multiply_loads(floats, runs, 0, loads, y);
}

void multiply_loads_onto(const RunsOfSlots& runs, const Loads& loads, float* y) {
  multiply_loads_onto(best_instructions(), runs, loads, y);
}

}  // namespace palpate
