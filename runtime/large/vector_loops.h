// Sums over long vectors of single precision, with the same bits for every instruction set.
#pragma once

#include <cstddef>

#include "runtime/large/lanes.h"

namespace palpate {

inline constexpr int kVectorStep = 2 * kLanesOf<EightFloats>;

// Counts are multiples of kVectorStep.
double dot_product(const float* a, const float* b, std::size_t count);
// y += factor x
void add_multiple(float factor, const float* x, std::size_t count, float* y);

}  // namespace palpate
