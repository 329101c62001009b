// The inner loops of the triangular solves: tiles of a block of columns held in registers, for the widest vectors of the
// processor that runs.
#pragma once

#include <cstdint>

#include "precompute/solver/vector_registers.h"

namespace palpate {

// A supernode's part of the factor. Its columns are cut into panels of six (the last may have three); a panel holds its
// rows from its own first column downwards, one after the other, as many numbers in each as the panel has columns. The
// first rows are the panel's lower triangle with the reciprocal of the diagonal.
struct Supernode {
  std::int32_t first = 0;              // block row of its first column
  std::int32_t columns = 0;            // block columns
  std::int32_t below = 0;              // block rows below
  const std::int32_t* rows = nullptr;  // [below]
  const double* values = nullptr;
};

// Numbers of such a part.
inline std::int64_t supernode_numbers(std::int64_t columns, std::int64_t below) {
  std::int64_t sum = 0;
  for (std::int64_t panel = 0; panel < columns; panel += 2)
    sum += 3 * (columns - panel < 2 ? 1 : 2) * 3 * (columns - panel + below);
  return sum;
}

// One supernode of a block of columns y: [dofs][width], width a multiple of 8; in place. own: the rows of the
// supernode's columns.
struct SupernodalKernels {
  void (*forward)(const Supernode& supernode, double* y, int width);  // own = L11^-1 own, below -= L21 own
  // own = L11^-T (own - L21^T below); from_zero takes own for zero without reading it.
  void (*backward)(const Supernode& supernode, bool from_zero, double* y, int width);
};
// lanes: doubles in a register; 8, 4 and 2 are there, and the processor must have them. Fused multiply-adds with 8 and 4:
// the same bits.
SupernodalKernels supernodal_kernels(int lanes = lanes_here());

}  // namespace palpate
