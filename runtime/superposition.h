// u = sum_j c_j T_j: the deformed field from whole tensor columns (eq. 9 of the paper), at the memory's speed.
#pragma once

#include <cstddef>

namespace palpate {

/// out[i] = sum_j coefficient[j] * column[j][first + i], i in [0, count).
/// @param column       column_count runs of at least first + count floats, any alignment
/// @param coefficient  m per unit displacement of the column's degree of freedom
/// @param[out] out     overwritten; zero without columns; must not overlap a column
/// Cost: reads each column once, in groups of twelve; no allocation.
void superpose(const float* const* column, const float* coefficient, int column_count, std::size_t first,
               std::size_t count, float* out);

}  // namespace palpate
