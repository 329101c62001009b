// The displacement under the body force alone.
#pragma once

#include <array>
#include <vector>

#include "precompute/column_solver.h"
#include "precompute/elastic_body.h"
#include "precompute/stiffness.h"

namespace palpate {

struct Preload {
  std::vector<double> displacement;  // [3 N] m
  double residual = 0;               // true relative residual of K u = f
};

// gravity in m/s^2. Errors: OperationError when it does not converge.
Preload solve_preload(const ElasticBody& body, const HeldStiffness& held, const std::array<double, 3>& gravity,
                      ColumnSolver& solver);

}  // namespace palpate
