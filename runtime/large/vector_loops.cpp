#include "runtime/large/vector_loops.h"

#include <cstring>

namespace palpate {
namespace {

// Sums of 512 products at most stand in single precision.
PALPATE_INLINE double dot_of(const float* a, const float* b, std::size_t count) {
  constexpr std::size_t lanes = kLanesOf<EightFloats>, piece = 512 * lanes;
  double total = 0;
  for (std::size_t begin = 0; begin < count; begin += piece) {
    const std::size_t end = begin + piece < count ? begin + piece : count;
    EightFloats sum[2] = {};
    for (std::size_t i = begin; i < end; i += 2 * lanes)
      for (std::size_t k = 0; k < 2; ++k) {
        EightFloats x, y;
        std::memcpy(&x, a + i + k * lanes, sizeof x);
        std::memcpy(&y, b + i + k * lanes, sizeof y);
        sum[k] = sum[k] + x * y;
      }
    const EightFloats both = sum[0] + sum[1];
    float part[lanes];
    std::memcpy(part, &both, sizeof part);
    for (const float x : part) total += static_cast<double>(x);
  }
  return total;
}
PALPATE_INLINE void add_to(float factor, const float* x, std::size_t count, float* y) {
  for (std::size_t i = 0; i < count; ++i) y[i] += factor * x[i];
}

#ifdef PALPATE_DISPATCHES
#define PALPATE_WITH_AVX2 __attribute__((target(PALPATE_AVX2)))
PALPATE_WITH_AVX2 double dot_with_avx2(const float* a, const float* b, std::size_t count) {
  return dot_of(a, b, count);
}
PALPATE_WITH_AVX2 void add_with_avx2(float factor, const float* x, std::size_t count, float* y) {
  add_to(factor, x, count, y);
}
#endif

}  // namespace

double dot_product(const float* a, const float* b, std::size_t count) {
#ifdef PALPATE_DISPATCHES
  if (best_instructions() != Instructions::baseline) return dot_with_avx2(a, b, count);
#endif
  return dot_of(a, b, count);
}

void add_multiple(float factor, const float* x, std::size_t count, float* y) {
#ifdef PALPATE_DISPATCHES
  if (best_instructions() != Instructions::baseline) return add_with_avx2(factor, x, count, y);
#endif
  add_to(factor, x, count, y);
}

}  // namespace palpate
