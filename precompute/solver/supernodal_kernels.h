// The inner loops of the triangular solves with a batch of columns. They keep a tile of a few rows and columns of the batch in
// registers and are compiled for several widths of vector registers.
#pragma once

#include <cstdint>

#include "precompute/solver/vector_registers.h"

namespace palpate {

// The columns of L stand in panels of this many blocks: six columns of 3 x 3 blocks, four of 4 x 4 blocks.
constexpr int panel_blocks(int block) {
  return block == 3 ? 2 : 1;
}

// The part of the factor L that belongs to a supernode. Its columns are stored in panels (the last panel may have fewer
// blocks). A panel stores its rows one after the other, from the row of its own first column down to the last row below,
// with one number for each column of the panel. Its first rows are a lower triangle, whose diagonal holds the reciprocals of
// L's diagonal. Number: double or float.
template <class Number>
struct Supernode {
  std::int32_t first = 0;              // block row of its first column
  std::int32_t columns = 0;            // in blocks
  std::int32_t below = 0;              // nonzero block rows below its columns
  const std::int32_t* rows = nullptr;  // [below]: these block rows
  const Number* values = nullptr;      // the panels, one after the other
};

// How many numbers its panels hold; columns and below as in Supernode; block: rows of a block, 3 or 4.
inline std::int64_t supernode_numbers(std::int64_t columns, std::int64_t below, int block) {
  const std::int64_t wide = panel_blocks(block);
  std::int64_t sum = 0;
  for (std::int64_t panel = 0; panel < columns; panel += wide)
    sum += block * (columns - panel < wide ? columns - panel : wide) * block * (columns - panel + below);
  return sum;
}

// One supernode's step of a triangular solve with L S L^T, in place on the batch y: [rows][width], width a multiple of the
// numbers in a register. S = I for blocks of 3; for blocks of 4 it is -1 at the last row of each block. "own" are the rows of
// y that belong to the supernode's columns, "below" its rows below; L11 and L21 are the parts of the supernode there.
template <class Number>
struct SupernodalKernels {
  void (*forward)(const Supernode<Number>& supernode, Number* y, int width);  // own = L11^-1 own, below -= L21 own
  // own = L11^-T (S own - L21^T below). from_zero: own is zero before, and is not read.
  void (*backward)(const Supernode<Number>& supernode, bool from_zero, Number* y, int width);
};
// lanes: doubles in a register, 8, 4 or 2; the processor must have such registers. 8 and 4 give the same bits; 2 gives others,
// because these registers come without fused multiply-add. Number: double or float; block: 3 or 4.
template <class Number>
SupernodalKernels<Number> supernodal_kernels(int block, int lanes = lanes_here());

}  // namespace palpate
