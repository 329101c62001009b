#include "precompute/tensors/motions.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/errors.h"

namespace palpate {
namespace {

// The motions first .. first + count - 1 as columns 0 .. count - 1.
std::vector<Load> columns_of(const Discretisation& discretisation, const HeldStiffness& held,
                             const std::vector<MotionLoad>& loads, std::size_t first, std::size_t count) {
  std::vector<Load> columns;
  for (std::size_t row = 0; row < held.node_of_row.size(); ++row)
    for (std::size_t d = 0; d < 3; ++d) {
      const auto n = static_cast<std::size_t>(held.node_of_row[row]);
      for (std::size_t c = 0; c < count && !discretisation.fixed[n][d]; ++c)
        if (const double force = loads[first + c].force[3 * n + d]; force != 0)
          columns.push_back({static_cast<std::int64_t>(3 * row + d), static_cast<std::int32_t>(c), force});
    }
  return columns;
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// Of the vertices; read_vertices() has zeros where they are held.
std::vector<double> read_moved_vertices(const Discretisation& discretisation, const MotionLoad& load,
                                        const std::vector<double>& nodes) {
  std::vector<double> vertices = read_vertices(discretisation, nodes);
  for (std::size_t i = 0; i < vertices.size() && !load.imposed.empty(); ++i)
    if (discretisation.fixed[i / 3][i % 3]) vertices[i] = load.imposed[i];
  return vertices;
}

}  // namespace

SolvedMotions solve_motions(const Discretisation& discretisation, const HeldStiffness& held,
                            const std::vector<MotionLoad>& loads, ColumnSolver& solver) {
  const auto width = static_cast<std::size_t>(solver.width());
  const bool has_pressure =
      std::any_of(loads.begin(), loads.end(), [](const MotionLoad& load) { return !load.sweep.empty(); });
  SolvedMotions solved;
  if (has_pressure) solved.volume.assign(loads.size() * loads.size(), 0.0);
  std::vector<double> x(solver.has_result() ? static_cast<std::size_t>(solver.dofs()) * width : 0);
  std::vector<ColumnReport> reports(width);
  for (std::size_t first = 0; first < loads.size(); first += width) {
    const std::size_t count = std::min(width, loads.size() - first);
    try {
      solver.solve(columns_of(discretisation, held, loads, first, count), x.data(), reports);
    } catch (const NotConverged& worst) {
      throw OperationError(
          fmt::format("motion {} did not converge: true relative residual {:.2g} (PETSc: {}); double precision allows "
                      "about {:.1g} here",
                      first + static_cast<std::size_t>(worst.column), worst.residual, worst.reason, worst.floor));
    }
    for (std::size_t c = 0; solver.has_result() && c < count; ++c) {
      const MotionLoad& load = loads[first + c];
      std::vector<double> nodes(3 * discretisation.coordinates.size(), 0.0);
      if (!load.imposed.empty()) nodes = load.imposed;
      for (std::size_t row = 0; row < held.node_of_row.size(); ++row)
        for (std::size_t d = 0; d < 3; ++d) {
          const auto n = static_cast<std::size_t>(held.node_of_row[row]);
          if (!discretisation.fixed[n][d]) nodes[3 * n + d] = x[(3 * row + d) * width + c];
        }
      for (std::size_t i = 0; i < loads.size(); ++i)
        if (!loads[i].sweep.empty()) solved.volume[i * loads.size() + first + c] = dot(loads[i].sweep, nodes);
      solved.displacement.push_back(read_moved_vertices(discretisation, load, nodes));
      solved.residual.push_back(reports[c].residual);
    }
  }
  return solved;
}

}  // namespace palpate
