#include "precompute/tensors/tensors.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "formats/errors.h"

namespace palpate {
namespace {

using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Inverse on the dofs that are free, zero on the others; symmetric to the last bit.
std::array<double, 9> inverse_on_free(Matrix3 c, const std::array<std::uint8_t, 3>& held) {
  c = (0.5 * (c + c.transpose())).eval();
  for (int i = 0; i < 3; ++i)
    if (held[i]) c.row(i).setZero(), c.col(i).setZero(), c(i, i) = 1;
  Matrix3 inverse = c.inverse();
  inverse = (0.5 * (inverse + inverse.transpose())).eval();
  for (int i = 0; i < 3; ++i)
    if (held[i]) inverse.row(i).setZero(), inverse.col(i).setZero();
  std::array<double, 9> result;
  std::copy(inverse.data(), inverse.data() + 9, result.begin());
  return result;
}

}  // namespace

// A unit force on each dof of each node, spread by its functional over the nodes that are not held.
std::vector<Load> TensorBlock::loads() const {
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

// The columns at the vertices: those of the solution, or their sums by the functionals, zero where a vertex is held.
void TensorBlock::read_vertices() {
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

void TensorBlock::solve(std::span<const std::int32_t> nodes) {
  nodes_.assign(nodes.begin(), nodes.end());
  held_dofs_.clear();
  for (const auto n : nodes) held_dofs_.push_back(discretisation_.fixed[n]);
  if (!x_ && solver_.has_result()) x_ = make_block(solver_.dofs(), solver_.width());
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
  force_.clear();
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const auto c = compliance(nodes_[i], i);
    force_.push_back(inverse_on_free(Eigen::Map<const Matrix3>(c.data()), held_dofs_[i]));
  }
}

std::array<double, 9> TensorBlock::compliance(std::int32_t node, std::size_t i) const {
  std::array<double, 9> c{};
  const auto row = row_of_vertex_[node];
  const int width = solver_.width();
  if (row >= 0)
    for (int d = 0; d < 3; ++d)
      for (int j = 0; j < 3; ++j) c[3 * d + j] = columns_[(3 * static_cast<std::size_t>(row) + d) * width + 3 * i + j];
  return c;
}

template <class Value>
void TensorBlock::displacement(std::int32_t first, std::int32_t count, Value* out, CastLoss* loss) const {
  const std::size_t run = 3 * static_cast<std::size_t>(count);
  displacement_rows(columns_, solver_.width(), row_of_vertex_.subspan(first, count), force_, out, loss);
  // C_kk C_kk^-1, without its rounding.
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    if (nodes_[i] >= first && nodes_[i] < first + count)
      for (int j = 0; j < 3; ++j)
        for (int d = 0; d < 3; ++d)
          out[(3 * i + j) * run + 3 * static_cast<std::size_t>(nodes_[i] - first) + d] =
              static_cast<Value>(d == j && !held_dofs_[i][j] ? 1 : 0);
}

template void TensorBlock::displacement(std::int32_t, std::int32_t, float*, CastLoss*) const;
template void TensorBlock::displacement(std::int32_t, std::int32_t, double*, CastLoss*) const;

ColumnReport TensorBlock::report(std::size_t i, int j) const {
  return held_dofs_[i][j] ? ColumnReport{} : reports_[3 * i + j];
}

}  // namespace palpate
