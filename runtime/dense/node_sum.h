// The displacement of one node, or of neighbours in the list of nodes: sum_j c_j T_j (eq. 9 of the paper), in double precision.
#pragma once

#include <cstddef>

#include "formats/bundle_layout.h"
#include "runtime/base/instructions.h"

namespace palpate {

/// out[d] = sum_j coefficient[j] * column[j][first + d], d in [0, 3), in double precision. Four sums run side by side, of the
/// columns j, j + 4, j + 8, ..., and are added at the end, so that no addition waits for the one before it.
/// @param type         of the stored numbers
/// @param column       [column_count] of column_size numbers each, any alignment
/// @param coefficient  [column_count]
/// @param first        at most column_size - 3
/// @param[out] out     [3]
/// Cost: one read at a distant address for each column. The result is the same to the bit with any instructions.
void sum_at_node(formats::ElementType type, const void* const* column, const double* coefficient, int column_count,
                 std::size_t first, std::size_t column_size, double* out);

/// The same with given instructions, which the processor must have; for tests.
void sum_at_node(Instructions instructions, formats::ElementType type, const void* const* column,
                 const double* coefficient, int column_count, std::size_t first, std::size_t column_size, double* out);

/// The same numbers, to the bit, for a run of numbers that lie side by side: out[i] as sum_at_node() gives it for the number
/// first + i, i in [0, count).
/// Cost: each column is read in pieces of some hundred numbers; for a whole column a fifth of what sum_at_node() takes for its nodes.
void sum_at_run(formats::ElementType type, const void* const* column, const double* coefficient, int column_count,
                std::size_t first, std::size_t count, double* out);
void sum_at_run(Instructions instructions, formats::ElementType type, const void* const* column,
                const double* coefficient, int column_count, std::size_t first, std::size_t count, double* out);

}  // namespace palpate
