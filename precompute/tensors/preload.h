// The displacement under the body force alone.
#pragma once

#include <array>
#include <vector>

#include "precompute/elements/discretisation.h"
#include "precompute/solver/column_solver.h"

namespace palpate {

struct Preload {
  std::vector<double> displacement;  // [3 N] m, of the vertices
  double residual = 0;               // true relative residual of K u = f
};

// gravity in m/s^2. Errors: OperationError when it does not converge.
Preload solve_preload(const Discretisation& discretisation, const HeldStiffness& held,
                      const std::array<double, 3>& gravity, BlockSolver& solver);

}  // namespace palpate
