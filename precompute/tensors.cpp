#include "precompute/tensors.h"

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
void TensorBlock::set_loads() {
  const int width = solver_.width();
  b_.assign(static_cast<std::size_t>(solver_.dofs()) * width, 0.0);
  const auto& touch = discretisation_.touch;
  const auto add = [&](std::int32_t node, double weight, std::size_t i) {
    const auto row = held_.row_of_node[node];
    for (int j = 0; j < 3; ++j)
      if (!held_dofs_[i][j] && !discretisation_.fixed[node][j])
        b_[(3 * static_cast<std::size_t>(row) + j) * width + 3 * i + j] = weight;
  };
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (touch.weight.empty()) {
      add(nodes_[i], 1, i);
      continue;
    }
    for (auto at = touch.nodes.first[nodes_[i]]; at < touch.nodes.first[nodes_[i] + 1]; ++at)
      add(touch.nodes.item[at], touch.weight[at], i);
  }
}

// The columns at the vertices: those of the solution, or their sums by the functionals, zero where a vertex is held.
void TensorBlock::read_vertices() {
  const auto& touch = discretisation_.touch;
  columns_ = x_.data();
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
  set_loads();
  x_.resize(b_.size());
  reports_.assign(solver_.width(), {});
  try {
    solver_.solve(b_.data(), x_.data(), reports_);
  } catch (const NotConverged& worst) {
    throw OperationError(
        fmt::format("the column of node {} dof {} did not converge: true relative residual {:.2g} (PETSc: {}); double "
                    "precision allows "
                    "about {:.1g} here; raise --tolerance, or try another solver with \"-- -column_pc_type ...\"",
                    nodes_[worst.column / 3], "xyz"[worst.column % 3], worst.residual, worst.reason, worst.floor));
  }
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
void TensorBlock::displacement(std::int32_t first, std::int32_t count, Value* out) const {
  const int width = solver_.width();
  const std::size_t run = 3 * static_cast<std::size_t>(count);
  constexpr std::int32_t kTile = 8;  // nodes: reads stay in cache while each row gets a line's worth
  for (std::int32_t tile = 0; tile < count; tile += kTile)
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const auto& f = force_[i];
      for (std::int32_t n = tile; n < std::min(tile + kTile, count); ++n) {
        const auto row = row_of_vertex_[first + n];
        Value* to = out + 3 * i * run + 3 * static_cast<std::size_t>(n);
        for (int d = 0; d < 3; ++d) {
          double c[3] = {0, 0, 0};
          if (row >= 0) std::copy_n(&columns_[(3 * static_cast<std::size_t>(row) + d) * width + 3 * i], 3, c);
          for (int j = 0; j < 3; ++j)
            to[j * run + d] = static_cast<Value>(c[0] * f[j] + c[1] * f[3 + j] + c[2] * f[6 + j]);
        }
      }
    }
  // C_kk C_kk^-1, without its rounding.
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    if (nodes_[i] >= first && nodes_[i] < first + count)
      for (int j = 0; j < 3; ++j)
        for (int d = 0; d < 3; ++d)
          out[(3 * i + j) * run + 3 * static_cast<std::size_t>(nodes_[i] - first) + d] =
              static_cast<Value>(d == j && !held_dofs_[i][j] ? 1 : 0);
}

template void TensorBlock::displacement(std::int32_t, std::int32_t, float*) const;
template void TensorBlock::displacement(std::int32_t, std::int32_t, double*) const;

ColumnReport TensorBlock::report(std::size_t i, int j) const {
  return held_dofs_[i][j] ? ColumnReport{} : reports_[3 * i + j];
}

double TensorBlock::cast_error(std::int32_t first, std::int32_t count) const {
  const int width = solver_.width();
  std::vector<double> whole(3 * nodes_.size(), 0.0), lost(3 * nodes_.size(), 0.0);
  for (std::int32_t n = first; n < first + count; ++n) {
    const auto row = row_of_vertex_[n];
    if (row < 0) continue;
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      for (int d = 0; d < 3; ++d) {
        const double* c = &columns_[(3 * static_cast<std::size_t>(row) + d) * width + 3 * i];
        const auto& f = force_[i];
        for (int j = 0; j < 3; ++j) {
          const double value = c[0] * f[j] + c[1] * f[3 + j] + c[2] * f[6 + j];
          const double error = value - static_cast<double>(static_cast<float>(value));
          whole[3 * i + j] += value * value;
          lost[3 * i + j] += error * error;
        }
      }
  }
  double worst = 0;
  for (std::size_t c = 0; c < whole.size(); ++c)
    if (whole[c] > 0) worst = std::max(worst, std::sqrt(lost[c] / whole[c]));
  return worst;
}

}  // namespace palpate
