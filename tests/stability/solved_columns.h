// Solves some columns of a body and reports iterations and true residual.
#pragma once

#include "precompute/solver/column_solver.h"
#include "tests/stability/solid.h"

namespace palpate::tests {

// Solves every dof of eight nodes with one preconditioner.
struct Solved {
  int iterations = 0;
  double residual = 0;
};
inline Solved solve(const ElasticBody& body, Element element, bool cholesky) {
  const Discretisation discretisation = discretise(body, element);
  const HeldStiffness held = remove_held_dofs(discretisation.stiffness, discretisation.fixed);
  ColumnSolverOptions options;
  options.cholesky = cholesky, options.width = 24, options.tolerance = 1e-7;
  ColumnSolver solver(held.matrix, row_coordinates(discretisation, held), options);
  const auto width = static_cast<std::size_t>(solver.width());
  std::vector<double> b(static_cast<std::size_t>(solver.dofs()) * width, 0.0), x(b.size());
  for (std::size_t c = 0; c < width; ++c) b[(c * 97 % solver.dofs()) * width + c] = 1;
  std::vector<ColumnReport> reports(width);
  solver.solve(b.data(), x.data(), reports);
  Solved solved;
  for (const ColumnReport& r : reports)
    solved.iterations = std::max(solved.iterations, r.iterations),
    solved.residual = std::max(solved.residual, r.residual);
  return solved;
}

}  // namespace palpate::tests
