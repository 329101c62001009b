// u = sum_j c_j T_j: the displacement field as a sum of tensor columns (eq. 9 of the paper), at the speed of memory.
#pragma once

#include <cstddef>

#include "formats/bundle_layout.h"
#include "runtime/base/instructions.h"

namespace palpate {

/// out[i] = sum_j coefficient[j] * column[j][first + i], i in [0, count), summed in single precision in the order of the columns.
/// @param type         of the stored numbers: f32, f64 (rounded to single precision as they are read) or f16
/// @param column       [column_count] of at least first + count numbers, any alignment
/// @param coefficient  [column_count] m: the imposed displacement times the column's scale
/// @param[out] out     [count] overwritten; zero where there are no columns; must not overlap a column
/// Cost: reads each column once, in groups of twelve, at the speed of a plain read (docs/speed.md). Uses the
/// best instructions the processor has; the result is the same to the bit with any.
void superpose(formats::ElementType type, const void* const* column, const float* coefficient, int column_count,
               std::size_t first, std::size_t count, float* out);

/// out[i] += the same sum.
void superpose_onto(formats::ElementType type, const void* const* column, const float* coefficient, int column_count,
                    std::size_t first, std::size_t count, float* out);

/// The same with given instructions, which the processor must have; for tests and benchmarks.
void superpose(Instructions instructions, formats::ElementType type, const void* const* column,
               const float* coefficient, int column_count, std::size_t first, std::size_t count, float* out);

}  // namespace palpate
