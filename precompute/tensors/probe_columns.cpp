#include "precompute/tensors/probe_columns.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/errors.h"
#include "precompute/solver/column_solver.h"
#include "precompute/solver/solver_plan.h"
#include "precompute/tensors/tensors.h"

namespace palpate {

std::vector<NodeTensor> solve_node_tensors(const ElasticBody& body, Element element,
                                           std::span<const std::int32_t> nodes, double tolerance) {
  for (const auto n : nodes)
    if (n < 0 || static_cast<std::size_t>(n) >= body.nodes.size() ||
        (body.fixed[n][0] && body.fixed[n][1] && body.fixed[n][2]))
      throw InputError(
          fmt::format("node {}: expected one of the {} nodes with a free degree of freedom", n, body.nodes.size()));
  const Discretisation discretisation = discretise(body, element);
  const HeldStiffness held = remove_held_dofs(discretisation.stiffness, discretisation.fixed);
  std::shared_ptr<const PressureForm> form;
  if (element == Element::p1_anp) form = std::make_shared<const PressureForm>(pressure_form(body, held));
  ColumnSolverOptions options;
  options.tolerance = tolerance;
  std::vector<std::int32_t> column_rows;
  for (const auto n : nodes) column_rows.push_back(held.row_of_node[n]);
  const SolverPlan plan = make_plan({.matrix = held.matrix,
                                     .column_rows = column_rows,
                                     .stored_rows = held.matrix.rows,
                                     .available_bytes = memory_left_bytes(0, 1),
                                     .form = form.get()});
  options.width = plan.width();
  options.cholesky = plan.cholesky;
  options.single = plan.single;
  options.form = form;
  options.elimination = plan.elimination;
  options.node_of_row = held.node_of_row;
  ColumnSolver solver(held.matrix, row_coordinates(discretisation, held), options);
  BatchTensors batch(solver, discretisation, held);
  const auto per_batch = static_cast<std::size_t>(BatchTensors::nodes_per_solve(solver));
  const auto all = static_cast<std::int32_t>(body.nodes.size());
  std::vector<NodeTensor> result;
  for (std::size_t at = 0; at < nodes.size(); at += per_batch) {
    const auto some = nodes.subspan(at, std::min(per_batch, nodes.size() - at));
    batch.solve(some);
    std::vector<double> rows(some.size() * 9 * body.nodes.size());
    batch.displacement(0, all, rows.data());
    for (std::size_t i = 0; i < some.size(); ++i) {
      const auto from = rows.begin() + static_cast<std::ptrdiff_t>(9 * body.nodes.size() * i);
      NodeTensor tensor{
          some[i], batch.stiffness(i), {from, from + static_cast<std::ptrdiff_t>(9 * body.nodes.size())}, 0};
      for (int j = 0; j < 3; ++j) tensor.residual = std::max(tensor.residual, batch.report(i, j).residual);
      result.push_back(std::move(tensor));
    }
  }
  return result;
}

}  // namespace palpate
