// Elimination in a dense symmetric matrix, a panel of rows at a time: the inner loop of the factorisation.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/instructions.h"

namespace palpate {

constexpr std::int32_t kPanelRows = 8;

/// One step of A = U^T U by rows. Rows of U above `first` are final. For the panel's rows i = first .. first + rows - 1 and
/// columns j = begin .. end - 1, subtracts the part of the rows above: u[i][j] -= sum over k < first of u[k][i] u[k][j], in the
/// order of k, each product and each sum rounded by itself.
/// @param u       upper triangle by rows; up to 16 numbers after `end` in each row are overwritten
/// @param stride  numbers from one row to the next
/// @param rows    1 .. kPanelRows
/// @param divide  also eliminates within the panel, whose corner [first, first + rows) is final: the columns become final
/// Cost: first * rows * (end - begin) multiply-adds. Uses the best instructions that the processor has; the result is the same
/// to the bit with any, and with any division into panels.
void eliminate_rows(double* u, std::size_t stride, std::int32_t first, std::int32_t rows, std::int32_t begin,
                    std::int32_t end, bool divide);

/// The same with given instructions, which the processor must have; for tests.
void eliminate_rows(Instructions instructions, double* u, std::size_t stride, std::int32_t first, std::int32_t rows,
                    std::int32_t begin, std::int32_t end, bool divide);

}  // namespace palpate
