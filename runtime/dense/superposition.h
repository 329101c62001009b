// u = sum_j c_j T_j: the deformed field from whole tensor columns (eq. 9 of the paper), at the memory's speed.
#pragma once

#include <cstddef>

#include "formats/bundle_layout.h"
#include "runtime/base/instructions.h"

namespace palpate {

/// out[i] = sum_j coefficient[j] * column[j][first + i], i in [0, count), summed in float, in the order of the columns.
/// @param type         of the stored numbers: f32, f64 (rounded to float as they are read) or f16
/// @param column       column_count runs of at least first + count numbers, any alignment
/// @param coefficient  m per unit displacement of the column's degree of freedom, the column's scale included
/// @param[out] out     overwritten; zero without columns; must not overlap a column
/// Cost: reads each column once, in groups of twelve, at the speed of a plain read (bench/README); no allocation. Uses the
/// best instructions the processor has; the result is the same to the bit with any.
void superpose(formats::ElementType type, const void* const* column, const float* coefficient, int column_count,
               std::size_t first, std::size_t count, float* out);

/// out[i] += the same sum.
void superpose_onto(formats::ElementType type, const void* const* column, const float* coefficient, int column_count,
                    std::size_t first, std::size_t count, float* out);

/// The same with instructions of the caller's choice, at most the best; for tests and benchmarks.
void superpose(Instructions instructions, formats::ElementType type, const void* const* column,
               const float* coefficient, int column_count, std::size_t first, std::size_t count, float* out);

}  // namespace palpate
