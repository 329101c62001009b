// The certificate's arithmetic: how far K x is from b, column by column, in one pass over x.
#pragma once

#include <span>
#include <vector>

#include "precompute/elements/stiffness.h"
#include "precompute/solver/block_preconditioner.h"

namespace palpate {

// ||b - K x|| of each of the width columns of x: [dofs][width], width a multiple of 8. loads: b, dofs ascending.
// Nothing of the size of x is written.
std::vector<double> residual_norms(const BlockMatrix& matrix, std::span<const Load> loads, const double* x, int width);

}  // namespace palpate
