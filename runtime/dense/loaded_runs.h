// Products of a few forces with stored numbers: blocks of a compliance whose rows are loaded (runtime/bundle).
#pragma once

#include <cstddef>
#include <cstdint>

#include "formats/bundle_layout.h"
#include "runtime/base/instructions.h"

namespace palpate {

// Runs of numbers with three for each slot from `slot` on, `stride` numbers from one run to the next. The numbers times scale are meant.
struct RunsOfSlots {
  formats::ElementType type = formats::ElementType::f32;
  const void* numbers = nullptr;  // any alignment
  std::size_t stride = 0;
  int count = 0;
  std::int32_t slot = 0;
  float scale = 1;
};

// Forces on slots.
struct Loads {
  const std::int32_t* slot = nullptr;  // [count]
  const float* force = nullptr;        // [count][3] N
  int count = 0;
  Loads part(int first, int end) const {
    return {slot + first, force + 3 * static_cast<std::ptrdiff_t>(first), end - first};
  }
};

/// y[r] += scale * the sum over the loads of their force times the three numbers that run r has for their slot: a product with the
/// transpose, of which few places are read. Numbers may be f64 too, rounded to single precision as they are read.
/// @param y  [runs.count]
/// Cost: a cache line for each run and load.
void multiply_loads_onto(const RunsOfSlots& runs, const Loads& loads, float* y);

/// The same with given instructions, which the processor must have; for tests.
void multiply_loads_onto(Instructions instructions, const RunsOfSlots& runs, const Loads& loads, float* y);

}  // namespace palpate
