// The numbers of the factor L of L S L^T, supernode by supernode, through BLAS.
#pragma once

#include <cstdint>
#include <vector>

#include "precompute/elements/pressure_form.h"
#include "precompute/elements/stiffness.h"
#include "precompute/solver/elimination.h"

namespace palpate {

class MachineMemory;

// A pivot that has the wrong sign, or is no number: the block row of the matrix at which the factorisation ended.
struct WrongPivot {
  std::int32_t row;
};

// How many numbers the factorisation holds while it runs: the supernodes as rectangles, and twice `work` beside them.
struct FactoringNumbers {
  std::int64_t rectangles = 0, work = 0;
};
FactoringNumbers factoring_numbers(const Elimination& elimination);

// Computes L with L S L^T = the matrix in elimination order; S = I for K and diag(1, 1, 1, -1, ...) for its pressure form.
// rectangles: [factoring_numbers().rectangles], overwritten; of each supernode its columns one after the other, each with the
// rows of the supernode's own columns (of which the lower triangle counts) and then the rows below. Left-looking: a supernode
// takes the products of all supernodes before it that have rows in its columns, then factors its own triangle. Number: double or
// float, in which everything is computed. Cost: elimination.factor_flops().
// machine: rectangles lies in its memory, and its ranks, which all call this, divide the work: subtrees of the elimination tree
// each to one rank, then the supernodes above them by columns and rows. The numbers do not depend on how many ranks there are.
// null: this process works alone. Errors: WrongPivot, bad_alloc; on every rank alike.
template <class Number, int kBlock>
void factorise(const BlockMatrixOf<kBlock>& matrix, const Elimination& elimination, Number* rectangles,
               MachineMemory* machine = nullptr);

}  // namespace palpate
