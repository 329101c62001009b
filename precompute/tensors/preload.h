// The displacement of the body under its own weight, before anything touches it.
#pragma once

#include <array>
#include <vector>

#include "precompute/elements/discretisation.h"
#include "precompute/solver/column_solver.h"

namespace palpate {

struct Preload {
  std::vector<double> displacement;  // of the vertices, [3 N] m
  double residual = 0;               // true relative residual of K u = f
};

// Solves K u = f with f = mass * gravity; gravity in m/s^2. Errors: OperationError where the solve does not converge.
Preload solve_preload(const Discretisation& discretisation, const HeldStiffness& held,
                      const std::array<double, 3>& gravity, ColumnSolver& solver);

}  // namespace palpate
