// Elimination in dense symmetric systems, a block of rows at a time: the inner loop of the factorisation.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/instructions.h"

namespace palpate {

constexpr std::int32_t kBlockRows = 8;

/// Rows of U above `first` are final. Of rows first .. first + rows - 1, columns begin .. end - 1: takes off what the rows
/// above contribute, u[i][j] -= sum over k < first of u[k][i] u[k][j], in the order of k, each product and sum rounded by
/// itself. divide: goes on through the rows of the block, whose own corner is final, so that these columns become final.
/// @param u       upper triangle by rows; up to 16 numbers after `end` in each row are overwritten
/// @param stride  numbers per row
/// @param rows    1 .. kBlockRows
/// Cost: first * rows * (end - begin) multiply-adds. Uses the best instructions the processor has; the result is the same
/// to the bit with any, and with any division into blocks.
void eliminate_rows(double* u, std::size_t stride, std::int32_t first, std::int32_t rows, std::int32_t begin,
                    std::int32_t end, bool divide);

/// The same with instructions of the caller's choice, at most the best; for tests.
void eliminate_rows(Instructions instructions, double* u, std::size_t stride, std::int32_t first, std::int32_t rows,
                    std::int32_t begin, std::int32_t end, bool divide);

}  // namespace palpate
