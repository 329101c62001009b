// PETSc vectors that hold a batch of columns and compute their numbers only when something reads them.
//
// PETSc's CG begins with  w = K x,  r = b - w,  ||r||.  Executed literally, that writes K x, reads b and writes r, and
// reads r: four sweeps over a batch that does not fit in the cache. Where the factor is the preconditioner the initial
// guess already meets the tolerance, and nothing reads r afterwards. So a batch vector records what it is ("K x",
// "b - K x", "these loads"), answers VecNorm from that record in one pass over x (residual_norms), and computes its
// numbers when an operation asks for them. Every other operation is that of PETSc's VECSEQ.
#pragma once

#include <petscvec.h>

#include <limits>
#include <span>
#include <vector>

#include "precompute/solver/batch_product.h"

namespace palpate {

// What the batch vectors of one operator share; it must outlive them.
struct BatchSpace {
  const BlockMatrix& matrix;
  int width;
  std::vector<double> norms = {};                          // of each column, at the last VecNorm ...
  double norm = std::numeric_limits<double>::quiet_NaN();  // ... that gave this norm of the whole batch

  std::int64_t dofs() const { return 3 * static_cast<std::int64_t>(matrix.rows); }
};

// A vector of dofs x width numbers, all zero. VecDuplicate of it gives another one. Its memory is taken when its numbers
// are first written; VecPlaceArray gives it the caller's.
Vec create_batch_vector(BatchSpace& space);

// b = the sum of the loads (dofs ascending), which are kept as such.
void hold_loads(Vec b, std::span<const Load> loads);

// The loads of a vector that is recorded as their sum; null where it holds numbers.
const std::vector<Load>* loads_of(Vec vector);

// product = K x, to be computed when it is read.
PetscErrorCode hold_product(Vec product, Vec x);

// What is recorded as K x or b - K x is not needed any more: whoever changes x next does not compute it first.
void forget_products_of(Vec x);

}  // namespace palpate
