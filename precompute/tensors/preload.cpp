#include "precompute/tensors/preload.h"

#include <fmt/format.h>

#include "formats/errors.h"

namespace palpate {

Preload solve_preload(const Discretisation& discretisation, const HeldStiffness& held,
                      const std::array<double, 3>& gravity, ColumnSolver& solver) {
  const int width = solver.width();
  std::vector<Load> loads;
  for (std::size_t row = 0; row < held.node_of_row.size(); ++row)
    for (int d = 0; d < 3; ++d) {
      const auto n = held.node_of_row[row];
      if (!discretisation.fixed[n][d])
        loads.push_back({static_cast<std::int64_t>(3 * row) + d, 0, discretisation.mass[n] * gravity[d]});
    }
  std::vector<double> x(solver.has_result() ? static_cast<std::size_t>(solver.dofs()) * width : 0);
  std::vector<ColumnReport> reports(width);
  try {
    solver.solve(loads, x.data(), reports);
  } catch (const NotConverged& worst) {
    throw OperationError(
        fmt::format("the preload did not converge: true relative residual {:.2g} (PETSc: {}); double precision allows "
                    "about {:.1g} here",
                    worst.residual, worst.reason, worst.floor));
  }
  if (!solver.has_result()) return {};
  std::vector<double> nodes(3 * discretisation.coordinates.size(), 0.0);
  for (std::size_t row = 0; row < held.node_of_row.size(); ++row)
    for (int d = 0; d < 3; ++d) nodes[3 * held.node_of_row[row] + d] = x[(3 * row + d) * width];
  return {read_vertices(discretisation, nodes), reports[0].residual};
}

}  // namespace palpate
