// K times a batch of columns, and how far K x is from b.
//
// A batch of columns is an array [dofs][width]: the numbers of one degree of freedom (dof) stand side by side, one for
// each column. width is a multiple of 8.
#pragma once

#include <span>
#include <vector>

#include "precompute/elements/stiffness.h"
#include "precompute/solver/batch_preconditioner.h"

namespace palpate {

// y = K x; x and y must not overlap.
void multiply_batch(const BlockMatrix& matrix, const double* x, double* y, int width);

// ||b - K x|| of each column, in one pass over x. loads: b, dofs ascending. product: K x is written there, with the numbers of
// multiply_batch(); null: no array of the size of x is written. It must not overlap x.
std::vector<double> residual_norms(const BlockMatrix& matrix, std::span<const Load> loads, const double* x, int width,
                                   double* product = nullptr);

// ||x|| of each column.
std::vector<double> column_norms(const double* x, std::int64_t dofs, int width);

}  // namespace palpate
