// The factor of a small dense matrix that is not symmetric.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/instructions.h"

namespace palpate {

/// A = L U in place, without pivoting: L below the diagonal, its own diagonal of ones not stored; U on and above it. Meant for
/// matrices whose leading minors are not near zero; the caller checks what the factor yields.
/// @param a       n rows, `stride` numbers from one row to the next; up to 16 numbers after each row's end are overwritten
/// @return false where a pivot is zero or not finite; the numbers of `a` are then of no use
/// Cost: n^3 / 3 multiply-adds. Uses the best instructions that the processor has; the result is the same to the bit with any.
bool factor_lu(std::int32_t n, double* a, std::size_t stride);

/// The same with given instructions, which the processor must have; for tests.
bool factor_lu(Instructions instructions, std::int32_t n, double* a, std::size_t stride);

/// x = (L U)^-1 x. Cost: n^2 multiply-adds.
void solve_lu(std::int32_t n, const double* a, std::size_t stride, double* x);

}  // namespace palpate
