// Solves K u = load with displacements imposed at the held dofs, with the assembly and solver of palpate-precompute.
#pragma once

#include "precompute/elements/discretisation.h"
#include "precompute/solver/column_solver.h"
#include "studies/bodies/bodies.h"

namespace palpate {

using Point = std::array<double, 3>;
using Field = std::function<Point(const Point&)>;

// Returns the displacement of all nodes. Held dofs take their value from field; load ([3 nodes] N) acts on the others:
// K u = load - K u_held on the free dofs.
inline std::vector<double> solve_with_imposed(const Discretisation& discretisation, const Field& field,
                                              const std::vector<double>& load, double tolerance = 1e-12) {
  const auto& fixed = discretisation.fixed;
  const HeldStiffness held = remove_held_dofs(discretisation.stiffness, fixed);
  std::vector<double> u(3 * fixed.size(), 0.0);
  for (std::size_t n = 0; n < fixed.size(); ++n)
    for (int d = 0; d < 3; ++d)
      if (fixed[n][d]) u[3 * n + d] = field(discretisation.coordinates[n])[d];
  const std::vector<double> reaction = multiply(discretisation.stiffness, u);
  ColumnSolver solver(held.matrix, row_coordinates(discretisation, held), {.tolerance = tolerance, .width = 8});
  std::vector<double> b(8 * static_cast<std::size_t>(solver.dofs()), 0.0), x(b.size());
  for (std::size_t row = 0; row < held.node_of_row.size(); ++row)
    for (std::size_t d = 0; d < 3; ++d) {
      const auto dof = 3 * static_cast<std::size_t>(held.node_of_row[row]) + d;
      if (!fixed[dof / 3][d]) b[8 * (3 * row + d)] = load[dof] - reaction[dof];
    }
  std::vector<ColumnReport> reports(8);
  solver.solve(b.data(), x.data(), reports);
  for (std::size_t row = 0; row < held.node_of_row.size(); ++row)
    for (std::size_t d = 0; d < 3; ++d) {
      const auto dof = 3 * static_cast<std::size_t>(held.node_of_row[row]) + d;
      if (!fixed[dof / 3][d]) u[dof] = x[8 * (3 * row + d)];
    }
  return u;
}

// The same with linear tetrahedra.
inline std::vector<double> solve_with_imposed(const ElasticBody& body, const Field& field,
                                              const std::vector<double>& load, double tolerance = 1e-12) {
  return solve_with_imposed(discretise(body, Element::p1), field, load, tolerance);
}

}  // namespace palpate
