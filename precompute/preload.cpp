#include "precompute/preload.h"

#include <fmt/format.h>

#include "formats/errors.h"

namespace palpate {

Preload solve_preload(const ElasticBody& body, const HeldStiffness& held, const std::array<double, 3>& gravity,
                      ColumnSolver& solver) {
  const std::vector<double> load = gravity_load(body, gravity);
  const int width = solver.width();
  std::vector<double> b(static_cast<std::size_t>(solver.dofs()) * width, 0.0), x(b.size());
  for (std::size_t row = 0; row < held.node_of_row.size(); ++row)
    for (int d = 0; d < 3; ++d) {
      const auto n = static_cast<std::size_t>(held.node_of_row[row]);
      if (!body.fixed[n][d]) b[(3 * row + d) * width] = load[3 * n + d];
    }
  std::vector<ColumnReport> reports(width);
  try {
    solver.solve(b.data(), x.data(), reports);
  } catch (const NotConverged& worst) {
    throw OperationError(
        fmt::format("the preload did not converge: true relative residual {:.2g} (PETSc: {}); double precision allows "
                    "about {:.1g} here",
                    worst.residual, worst.reason, worst.floor));
  }
  Preload preload{std::vector<double>(3 * body.nodes.size(), 0.0), reports[0].residual};
  for (std::size_t row = 0; row < held.node_of_row.size(); ++row)
    for (int d = 0; d < 3; ++d) preload.displacement[3 * held.node_of_row[row] + d] = x[(3 * row + d) * width];
  return preload;
}

}  // namespace palpate
