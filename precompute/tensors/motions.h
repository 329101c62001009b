// The displacement of the body per unit of each of its motions: supports that move, pressure, gravity.
#pragma once

#include <vector>

#include "precompute/elements/motion_loads.h"
#include "precompute/solver/column_solver.h"

namespace palpate {

struct SolvedMotions {
  std::vector<std::vector<double>> displacement;  // of each motion, of the vertices, [3 N] m per unit
  std::vector<double> residual;                   // of each: true relative residual of K u = g
  std::vector<double> volume;  // [M][M] m^3 per unit: row i what motion j makes the surface of pressure i
                               // sweep; empty where there is no pressure
};

// Solves K u = g for all of them, in the solver's batches; collective where the solver is. A held dof has what the motion imposes on it.
// Errors: OperationError where a solve does not converge.
SolvedMotions solve_motions(const Discretisation& discretisation, const HeldStiffness& held,
                            const std::vector<MotionLoad>& loads, ColumnSolver& solver);

}  // namespace palpate
