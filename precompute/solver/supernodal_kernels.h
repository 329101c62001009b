// The inner loops of the triangular solves with a batch of columns. They keep a tile of a few rows and columns of the batch in
// registers and are compiled for several widths of vector registers.
#pragma once

#include <cstdint>

#include "precompute/solver/vector_registers.h"

namespace palpate {

// The part of the factor L that belongs to a supernode. Its columns are stored in panels of six columns (the last panel may
// have three). A panel stores its rows one after the other, from the row of its own first column down to the last row below,
// with one number for each column of the panel. Its first rows are a lower triangle, whose diagonal holds the reciprocals of
// L's diagonal.
struct Supernode {
  std::int32_t first = 0;              // block row of its first column
  std::int32_t columns = 0;            // in blocks of three
  std::int32_t below = 0;              // nonzero block rows below its columns
  const std::int32_t* rows = nullptr;  // [below]: these block rows
  const double* values = nullptr;      // the panels, one after the other
};

// How many numbers its panels hold; columns and below as in Supernode.
inline std::int64_t supernode_numbers(std::int64_t columns, std::int64_t below) {
  std::int64_t sum = 0;
  for (std::int64_t panel = 0; panel < columns; panel += 2)
    sum += 3 * (columns - panel < 2 ? 1 : 2) * 3 * (columns - panel + below);
  return sum;
}

// One supernode's step of a triangular solve, in place on the batch y: [dofs][width], width a multiple of 8. "own" are the
// rows of y that belong to the supernode's columns, "below" its rows below; L11 and L21 are the parts of the supernode there.
struct SupernodalKernels {
  void (*forward)(const Supernode& supernode, double* y, int width);  // own = L11^-1 own, below -= L21 own
  // own = L11^-T (own - L21^T below). from_zero: own is zero before, and is not read.
  void (*backward)(const Supernode& supernode, bool from_zero, double* y, int width);
};
// lanes: doubles in a register, 8, 4 or 2; the processor must have such registers. 8 and 4 give the same bits; 2 gives others,
// because these registers come without fused multiply-add.
SupernodalKernels supernodal_kernels(int lanes = lanes_here());

}  // namespace palpate
