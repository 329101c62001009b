#include "precompute/tensors/corridor_columns.h"

#include <algorithm>
#include <iterator>
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
    result_.cut_compliance.assign(9 * (request.cut.size() * (request.cut.size() + 1) / 2), 0.0);
    result_.cut_residual.assign(3 * request.cut.size(), 0.0);
  }

  // nodes: of the batch.
  void take(const BatchTensors& solved, std::span<const std::int32_t> nodes) {
    std::vector<Column> corridor, cut;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (const auto slot = slot_of(request_.nodes, nodes[i])) corridor.push_back({i, *slot, nodes[i]});
      if (const auto slot = slot_of(request_.cut, nodes[i])) cut.push_back({i, *slot, nodes[i]});
    }
    take_residuals(solved, corridor, result_.residual);
    take_residuals(solved, cut, result_.cut_residual);
    const std::int32_t surface = request_.surface_nodes, all = discretisation_.vertices;
    take_rows(solved, corridor, 0, surface, result_.surface);
    if (request_.interior) take_rows(solved, corridor, surface, all - surface, result_.interior);
    for (std::size_t l = 0; l < request_.nodes.size(); ++l)
      for_each_entry(solved, corridor, request_.nodes[l], [&](std::size_t column, std::size_t d, double value) {
        compliance_[column * dofs_ + 3 * l + d] = value;
      });
    for (std::size_t b = 0; b < request_.cut.size(); ++b)
      for_each_entry(solved, cut, request_.cut[b], [&](std::size_t column, std::size_t d, double value) {
        add_half_to_cut(column / 3, column % 3, b, d, value / 2);
        if (column / 3 == b) add_half_to_cut(b, d, b, column % 3, value / 2);
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
  struct Column {
    std::size_t place, slot;  // in the batch and in the request's list
    std::int32_t node;
  };
  static std::optional<std::size_t> slot_of(std::span<const std::int32_t> list, std::int32_t node) {
    const auto at = std::lower_bound(list.begin(), list.end(), node);
    if (at == list.end() || *at != node) return {};
    return static_cast<std::size_t>(at - list.begin());
  }

  void take_residuals(const BatchTensors& solved, const std::vector<Column>& columns, std::vector<double>& residual) {
    for (const Column& column : columns)
      for (int j = 0; j < 3; ++j) {
        const ColumnReport report = solved.report(column.place, j);
        residual[3 * column.slot + static_cast<std::size_t>(j)] = report.residual;
        result_.floor = std::max(result_.floor, report.floor);
      }
  }

  // put(column 3 slot + j, dof d of the node, m/N), where neither dof is held.
  template <class Put>
  void for_each_entry(const BatchTensors& solved, const std::vector<Column>& columns, std::int32_t node,
                      const Put& put) const {
    for (const Column& column : columns) {
      const auto entry = solved.compliance(node, column.place);
      const auto& held = discretisation_.fixed[column.node];
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t d = 0; d < 3; ++d)
          if (!held[j] && !discretisation_.fixed[node][d]) put(3 * column.slot + j, d, entry[3 * d + j]);
    }
  }

  void take_rows(const BatchTensors& solved, const std::vector<Column>& columns, std::int32_t first, std::int32_t count,
                 std::vector<float>& out) const {
    const std::size_t run = 3 * static_cast<std::size_t>(count);
    for (std::int32_t n = 0; n < count; ++n)
      for_each_entry(solved, columns, first + n, [&](std::size_t column, std::size_t d, double value) {
        out[column * run + 3 * static_cast<std::size_t>(n) + d] = static_cast<float>(value);
      });
  }

  // The displacement of dof d of node b for a unit force on dof j of node a. Two columns have each number, and each of them gives half of it.
  void add_half_to_cut(std::size_t a, std::size_t j, std::size_t b, std::size_t d, double half) {
    const auto at = [](std::size_t high, std::size_t low, std::size_t row, std::size_t column) {
      return 9 * (high * (high + 1) / 2 + low) + 3 * row + column;
    };
    result_.cut_compliance[b >= a ? at(b, a, d, j) : at(a, b, j, d)] += half;
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
  std::vector<std::int32_t> all, free;  // free: those that have a column to solve
  std::ranges::set_union(request.nodes, request.cut, std::back_inserter(all));
  std::ranges::copy_if(all, std::back_inserter(free), [&](std::int32_t node) { return held.row_of_node[node] >= 0; });
  std::optional<CorridorColumns> columns;
  if (solver.has_result()) columns.emplace(discretisation, request);
  BatchTensors batch(solver, discretisation, held);
  const auto most = static_cast<std::size_t>(BatchTensors::nodes_per_solve(solver));
  for (std::size_t first = 0; first < free.size(); first += most) {
    const auto nodes = std::span(free).subspan(first, std::min(most, free.size() - first));
    batch.solve(nodes);
    if (columns) columns->take(batch, nodes);
  }
  return columns ? columns->finish() : SolvedCorridor{};
}

double corridor_bytes(std::size_t corridor_nodes, std::size_t stored) {
  return 36.0 * static_cast<double>(corridor_nodes) * static_cast<double>(corridor_nodes + stored);
}

double cut_bytes(std::size_t cut_nodes) {
  return 36.0 * static_cast<double>(cut_nodes) * static_cast<double>(cut_nodes + 1);
}

}  // namespace palpate
