#include "precompute/tensors/corridor_columns.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "precompute/tensors/tensors.h"

namespace palpate {
namespace {

class CorridorColumns {
 public:
  CorridorColumns(const Discretisation& discretisation, const CorridorRequest& request)
      : discretisation_(discretisation), request_(request), dofs_(3 * request.nodes.size()) {
    const auto surface = static_cast<std::size_t>(request.surface_nodes);
    const auto inside = static_cast<std::size_t>(discretisation.vertices) - surface;
    result_.surface.assign(3 * dofs_ * surface, 0.0f);
    if (request.interior) result_.interior.assign(3 * dofs_ * inside, 0.0f);
    result_.residual.assign(dofs_, 0.0);
    compliance_.assign(dofs_ * dofs_, 0.0);
  }

  // slots: of the batch's nodes in request.nodes.
  void take(const BatchTensors& solved, std::span<const std::size_t> slots) {
    for (std::size_t i = 0; i < slots.size(); ++i)
      for (int j = 0; j < 3; ++j) {
        const ColumnReport report = solved.report(i, j);
        result_.residual[3 * slots[i] + static_cast<std::size_t>(j)] = report.residual;
        result_.floor = std::max(result_.floor, report.floor);
      }
    const std::int32_t surface = request_.surface_nodes, all = discretisation_.vertices;
    take_rows(solved, slots, 0, surface, result_.surface);
    if (request_.interior) take_rows(solved, slots, surface, all - surface, result_.interior);
    for (std::size_t l = 0; l < request_.nodes.size(); ++l)
      for_each_entry(solved, slots, request_.nodes[l], [&](std::size_t column, std::size_t d, double value) {
        compliance_[column * dofs_ + 3 * l + d] = value;
      });
  }

  // The halves of the compliance come from different columns and differ by their residuals.
  SolvedCorridor finish() {
    result_.compliance.resize(dofs_ * dofs_);
    for (std::size_t a = 0; a < dofs_; ++a)
      for (std::size_t b = 0; b <= a; ++b) {
        const auto mean = static_cast<float>(0.5 * (compliance_[a * dofs_ + b] + compliance_[b * dofs_ + a]));
        result_.compliance[a * dofs_ + b] = result_.compliance[b * dofs_ + a] = mean;
      }
    const std::size_t run = result_.interior.size() / dofs_;
    for (std::size_t column = 0; column < dofs_ && run > 0; ++column)
      for (std::size_t i = 0; i < dofs_; ++i) {
        const auto node = static_cast<std::size_t>(request_.nodes[i / 3] - request_.surface_nodes);
        result_.interior[column * run + 3 * node + i % 3] = result_.compliance[column * dofs_ + i];
      }
    return std::move(result_);
  }

 private:
  // put(column 3 k + j, dof d of the node, m/N), where neither dof is held.
  template <class Put>
  void for_each_entry(const BatchTensors& solved, std::span<const std::size_t> slots, std::int32_t node,
                      const Put& put) const {
    for (std::size_t i = 0; i < slots.size(); ++i) {
      const auto entry = solved.compliance(node, i);
      const auto& held = discretisation_.fixed[request_.nodes[slots[i]]];
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t d = 0; d < 3; ++d)
          if (!held[j] && !discretisation_.fixed[node][d]) put(3 * slots[i] + j, d, entry[3 * d + j]);
    }
  }

  void take_rows(const BatchTensors& solved, std::span<const std::size_t> slots, std::int32_t first, std::int32_t count,
                 std::vector<float>& out) const {
    const std::size_t run = 3 * static_cast<std::size_t>(count);
    for (std::int32_t n = 0; n < count; ++n)
      for_each_entry(solved, slots, first + n, [&](std::size_t column, std::size_t d, double value) {
        out[column * run + 3 * static_cast<std::size_t>(n) + d] = static_cast<float>(value);
      });
  }

  const Discretisation& discretisation_;
  const CorridorRequest& request_;
  std::size_t dofs_;
  std::vector<double> compliance_;  // [3 K][3 K]
  SolvedCorridor result_;
};

}  // namespace

SolvedCorridor solve_corridor(const Discretisation& discretisation, const HeldStiffness& held,
                              const CorridorRequest& request, ColumnSolver& solver) {
  std::vector<std::size_t> free;  // slots of the nodes that have a column to solve
  for (std::size_t k = 0; k < request.nodes.size(); ++k)
    if (held.row_of_node[request.nodes[k]] >= 0) free.push_back(k);
  std::optional<CorridorColumns> columns;
  if (solver.has_result()) columns.emplace(discretisation, request);
  BatchTensors batch(solver, discretisation, held);
  const auto most = static_cast<std::size_t>(BatchTensors::nodes_per_solve(solver));
  for (std::size_t first = 0; first < free.size(); first += most) {
    const auto slots = std::span(free).subspan(first, std::min(most, free.size() - first));
    std::vector<std::int32_t> nodes;
    for (const std::size_t k : slots) nodes.push_back(request.nodes[k]);
    batch.solve(nodes);
    if (columns) columns->take(batch, slots);
  }
  return columns ? columns->finish() : SolvedCorridor{};
}

double corridor_bytes(std::size_t corridor_nodes, std::size_t stored) {
  return 36.0 * static_cast<double>(corridor_nodes) * static_cast<double>(corridor_nodes + stored);
}

}  // namespace palpate
