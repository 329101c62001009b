#include "precompute/tensors/tensors.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/errors.h"
#include "precompute/elements/matrix3.h"

namespace palpate {
namespace {

// C_kk^-1 on the dofs of node k that are free. The halves of C_kk come from different columns and differ by their
// residuals.
Matrix3 stiffness_of(const Matrix3& own, const std::array<std::uint8_t, 3>& held, std::int32_t node) {
  Matrix3 mean;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) mean[3 * i + j] = 0.5 * (own[3 * i + j] + own[3 * j + i]);
  Matrix3 inverse;
  if (!invert_on_free(mean, held.data(), &inverse))
    throw OperationError(fmt::format(
        "node {}: its own compliance is not positive definite, so that the solved columns cannot be right; lower "
        "--tolerance, and look for slivers and extreme contrasts of stiffness",
        node));
  return inverse;
}

}  // namespace

// A unit force on each free dof of each node of the batch, spread over the nodes through which that vertex is touched.
std::vector<Load> BatchTensors::loads() const {
  const auto& touch = discretisation_.touch;
  std::vector<Load> loads;
  const auto add = [&](std::int32_t node, double weight, std::size_t i) {
    const auto row = static_cast<std::int64_t>(held_.row_of_node[node]);
    for (int j = 0; j < 3; ++j)
      if (!held_dofs_[i][j] && !discretisation_.fixed[node][j])
        loads.push_back({3 * row + j, static_cast<std::int32_t>(3 * i) + j, weight});
  };
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (touch.weight.empty()) {
      add(nodes_[i], 1, i);
      continue;
    }
    for (auto at = touch.nodes.first[nodes_[i]]; at < touch.nodes.first[nodes_[i] + 1]; ++at)
      add(touch.nodes.item[at], touch.weight[at], i);
  }
  std::stable_sort(loads.begin(), loads.end(), [](const Load& a, const Load& b) { return a.dof < b.dof; });
  return loads;
}

// The columns at the vertices: the solution itself, or weighted sums of it where vertices are touched through several
// nodes; zero where a vertex is held.
void BatchTensors::read_vertices() {
  const auto& touch = discretisation_.touch;
  columns_ = x_.get();
  row_of_vertex_ = held_.row_of_node;
  if (touch.weight.empty()) return;
  const auto width = static_cast<std::size_t>(solver_.width());
  read_.assign(3 * width * static_cast<std::size_t>(discretisation_.vertices), 0.0);
  read_row_.resize(static_cast<std::size_t>(discretisation_.vertices));
  for (std::int32_t v = 0; v < discretisation_.vertices; ++v) {
    read_row_[v] = v;
    for (auto at = touch.nodes.first[v]; at < touch.nodes.first[v + 1]; ++at) {
      const auto row = held_.row_of_node[touch.nodes.item[at]];
      for (std::size_t d = 0; row >= 0 && d < 3; ++d) {
        if (discretisation_.fixed[v][d]) continue;
        const double* from = &x_[(3 * static_cast<std::size_t>(row) + d) * width];
        double* to = &read_[(3 * static_cast<std::size_t>(v) + d) * width];
        for (std::size_t c = 0; c < width; ++c) to[c] += touch.weight[at] * from[c];
      }
    }
  }
  columns_ = read_.data();
  row_of_vertex_ = read_row_;
}

void BatchTensors::solve(std::span<const std::int32_t> nodes) {
  nodes_.assign(nodes.begin(), nodes.end());
  held_dofs_.clear();
  for (const auto n : nodes) held_dofs_.push_back(discretisation_.fixed[n]);
  if (!x_ && solver_.has_result()) x_ = make_column_buffer(solver_.dofs(), solver_.width());
  reports_.assign(solver_.width(), {});
  try {
    solver_.solve(loads(), x_.get(), reports_);
  } catch (const NotConverged& worst) {
    throw OperationError(
        fmt::format("the column of node {} dof {} did not converge: true relative residual {:.2g} (PETSc: {}); double "
                    "precision allows "
                    "about {:.1g} here; raise --tolerance, or try another solver with \"-- -column_pc_type ...\"",
                    nodes_[worst.column / 3], "xyz"[worst.column % 3], worst.residual, worst.reason, worst.floor));
  }
  if (!solver_.has_result()) return;
  read_vertices();
  stiffness_.clear();
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    stiffness_.push_back(stiffness_of(compliance(nodes_[i], i), held_dofs_[i], nodes_[i]));
}

std::array<double, 9> BatchTensors::compliance(std::int32_t node, std::size_t i) const {
  std::array<double, 9> c{};
  const auto row = row_of_vertex_[node];
  const int width = solver_.width();
  if (row >= 0)
    for (int d = 0; d < 3; ++d)
      for (int j = 0; j < 3; ++j) c[3 * d + j] = columns_[(3 * static_cast<std::size_t>(row) + d) * width + 3 * i + j];
  return c;
}

template <class Value>
void BatchTensors::displacement(std::int32_t first, std::int32_t count, Value* out, CastLoss* loss) const {
  const std::size_t run = 3 * static_cast<std::size_t>(count);
  displacement_rows(columns_, solver_.width(), row_of_vertex_.subspan(first, count), stiffness_, out, loss);
  // C_kk C_kk^-1 is the identity; the product above has rounding errors.
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    if (nodes_[i] >= first && nodes_[i] < first + count)
      for (int j = 0; j < 3; ++j)
        for (int d = 0; d < 3; ++d)
          out[(3 * i + j) * run + 3 * static_cast<std::size_t>(nodes_[i] - first) + d] =
              static_cast<Value>(d == j && !held_dofs_[i][j] ? 1 : 0);
}

template void BatchTensors::displacement(std::int32_t, std::int32_t, float*, CastLoss*) const;
template void BatchTensors::displacement(std::int32_t, std::int32_t, double*, CastLoss*) const;

ColumnReport BatchTensors::report(std::size_t i, int j) const {
  return held_dofs_[i][j] ? ColumnReport{} : reports_[3 * i + j];
}

}  // namespace palpate
