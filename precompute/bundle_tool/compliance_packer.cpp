#include "precompute/bundle_tool/compliance_packer.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "formats/half.h"
#include "formats/program.h"

namespace palpate {

using namespace formats;

namespace {

// Appends a matrix as halves. Returns its scale.
template <class Number>
float append_halves(const Number* numbers, std::size_t count, std::vector<char>* values) {
  double largest = 0;
  for (std::size_t i = 0; i < count; ++i) largest = std::max(largest, std::abs(static_cast<double>(numbers[i])));
  const float scale = half_scale(largest);
  const std::size_t first = values->size();
  values->resize(first + 2 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint16_t half = formats::half_of(static_cast<double>(numbers[i]) / static_cast<double>(scale));
    std::memcpy(values->data() + first + 2 * i, &half, 2);
  }
  return scale;
}

constexpr std::int32_t kLeafNodes = 32;
// Two clusters are apart where the diameter of the smaller one is at most kApart times their distance. On the liver, 2
// gave fewer bytes than 1 at every error from 1e-2 to 1e-4.
constexpr double kApart = 2;

// ---- tree of clusters -----------------------------------------------------------------------------------------------

struct Cluster {
  std::int32_t begin = 0, end = 0;     // positions
  std::int32_t left = -1, right = -1;  // children, or -1
  std::int32_t leaf_begin = 0, leaf_end = 0;
  std::array<double, 3> low{}, high{};
  std::int32_t size() const { return end - begin; }
  bool is_leaf() const { return left < 0; }
};

class Tree {
 public:
  explicit Tree(const ComplianceSource& source, std::int32_t leaf_nodes) : source_(source), leaf_nodes_(leaf_nodes) {}

  // Adds these nodes at the next positions of order, as a tree; returns its root, or -1 where there are no nodes.
  std::int32_t add(std::vector<std::int32_t> nodes) {
    if (nodes.empty()) return -1;
    const auto begin = static_cast<std::int32_t>(order.size());
    order.insert(order.end(), nodes.begin(), nodes.end());
    return split(begin, static_cast<std::int32_t>(order.size()));
  }

  std::vector<std::int32_t> order;  // node at each position
  std::vector<Cluster> clusters;
  std::vector<std::int32_t> leaf_ends;

 private:
  double coordinate(std::int32_t node, int d) const { return source_.position[3 * static_cast<std::size_t>(node) + d]; }

  // Halves the cluster along the longest side of its bounding box, down to leaf_nodes_.
  std::int32_t split(std::int32_t begin, std::int32_t end) {
    Cluster c;
    c.begin = begin, c.end = end, c.leaf_begin = static_cast<std::int32_t>(leaf_ends.size());
    int longest = 0;
    for (int d = 0; d < 3; ++d) {
      c.low[d] = std::numeric_limits<double>::infinity(), c.high[d] = -c.low[d];
      for (std::int32_t p = begin; p < end; ++p) {
        c.low[d] = std::min(c.low[d], coordinate(order[p], d));
        c.high[d] = std::max(c.high[d], coordinate(order[p], d));
      }
      if (c.high[d] - c.low[d] > c.high[longest] - c.low[longest]) longest = d;
    }
    if (end - begin <= leaf_nodes_) {
      leaf_ends.push_back(end);
    } else {
      std::sort(order.begin() + begin, order.begin() + end, [&](std::int32_t a, std::int32_t b) {
        const double x = coordinate(a, longest), y = coordinate(b, longest);
        return x != y ? x < y : a < b;
      });
      c.left = split(begin, begin + (end - begin) / 2);
      c.right = split(begin + (end - begin) / 2, end);
    }
    c.leaf_end = static_cast<std::int32_t>(leaf_ends.size());
    clusters.push_back(c);
    return static_cast<std::int32_t>(clusters.size()) - 1;
  }

  const ComplianceSource& source_;
  std::int32_t leaf_nodes_;
};

double diameter(const Cluster& a) {
  return std::hypot(a.high[0] - a.low[0], a.high[1] - a.low[1], a.high[2] - a.low[2]);
}

bool are_apart(const Cluster& a, const Cluster& b) {
  double gap[3];
  for (int d = 0; d < 3; ++d) gap[d] = std::max({0.0, a.low[d] - b.high[d], b.low[d] - a.high[d]});
  return std::min(diameter(a), diameter(b)) <= kApart * std::hypot(gap[0], gap[1], gap[2]);
}

// ---- low rank -------------------------------------------------------------------------------------------------------

struct Factors {
  Eigen::MatrixXd u, v;  // [3 rows][rank], [3 columns][rank]: block = u v^T
};

// The error that a block may have at each of its nodes: in T^u, for dof j, and in C, for all dofs.
struct Budget {
  std::vector<std::array<double, 3>> of_t;
  std::vector<double> of_c;
  std::vector<Eigen::Matrix3d> stiffness;
};

// The smallest rank at which the error of every dof of every node is at most 0.9 of its budget. sigma: the singular
// values. Rows 3 n .. 3 n + 2 of v times T^f of node n give the share of each rank in the columns of T^u of that node.
Eigen::Index least_rank(const Eigen::MatrixXd& v, const Eigen::VectorXd& sigma, const Budget& budget) {
  Eigen::Index least = 0;
  for (std::size_t n = 0; n < budget.stiffness.size(); ++n) {
    const Eigen::MatrixXd of_t = budget.stiffness[n].transpose() * v.middleRows(3 * static_cast<Eigen::Index>(n), 3);
    for (int j = 0; j < 3; ++j) {
      const double most = std::pow(0.9 * budget.of_t[n][j], 2);
      double missed = 0;
      Eigen::Index rank = sigma.size();
      while (rank > 0) {
        missed += std::pow(sigma[rank - 1] * of_t(j, rank - 1), 2);
        if (missed > most) break;
        --rank;
      }
      least = std::max(least, rank);
    }
  }
  return least;
}

// Whether the residual is at most a tenth of the budget at every node, the nodes being those of the columns.
bool is_small(const Eigen::MatrixXd& residual, const Budget& budget) {
  for (std::size_t n = 0; n < budget.of_c.size(); ++n)
    if (residual.middleCols(3 * static_cast<Eigen::Index>(n), 3).norm() > 0.1 * budget.of_c[n]) return false;
  return true;
}
// The same where the nodes are those of the rows.
bool is_small_by_rows(const Eigen::MatrixXd& residual, const Budget& budget) {
  for (std::size_t n = 0; n < budget.of_c.size(); ++n)
    if (residual.middleRows(3 * static_cast<Eigen::Index>(n), 3).norm() > 0.1 * budget.of_c[n]) return false;
  return true;
}

// Rows of fixed dofs are zero in the block; rounding must not change that.
void keep_zero_rows(const Eigen::MatrixXd& block, Eigen::MatrixXd& factor) {
  for (Eigen::Index r = 0; r < block.rows(); ++r)
    if (block.row(r).cwiseAbs().maxCoeff() == 0) factor.row(r).setZero();
}

// Cross approximation with full pivoting (Bebendorf 2000), then the smallest rank by singular values. rows: the budget
// of the nodes of the rows; null where these are not touchable and so have no columns. block: not zero. Nothing where low
// rank would take as many numbers as the dense block.
std::optional<Factors> low_rank(const Eigen::MatrixXd& block, const Budget& columns, const Budget* rows) {
  const Eigen::Index most = block.size() / (block.rows() + block.cols());
  // The singular values later drop some of the ranks that the crosses took.
  const Eigen::Index most_crosses = std::min(most + most / 2 + 4, std::min(block.rows(), block.cols()));
  Eigen::MatrixXd residual = block, u(block.rows(), most_crosses), v(block.cols(), most_crosses);
  Eigen::Index crosses = 0;
  // A block that is within the budget without any cross still takes one: its rank is at least 1.
  while (crosses == 0 || !is_small(residual, columns) || (rows && !is_small_by_rows(residual, *rows))) {
    if (crosses == most_crosses) return {};
    Eigen::Index row = 0, column = 0;
    residual.cwiseAbs().maxCoeff(&row, &column);
    const double pivot = residual(row, column);
    if (pivot == 0) break;
    u.col(crosses) = residual.col(column) / pivot;
    v.col(crosses) = residual.row(row).transpose();
    residual.noalias() -= u.col(crosses) * v.col(crosses).transpose();
    ++crosses;
  }
  const Eigen::HouseholderQR<Eigen::MatrixXd> of_u(u.leftCols(crosses)), of_v(v.leftCols(crosses));
  const Eigen::MatrixXd ru = of_u.matrixQR().topRows(crosses).triangularView<Eigen::Upper>();
  const Eigen::MatrixXd rv = of_v.matrixQR().topRows(crosses).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Eigen::MatrixXd> core(ru * rv.transpose(), Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd sigma = core.singularValues();
  Factors f;
  f.u = of_u.householderQ() * Eigen::MatrixXd::Identity(block.rows(), crosses) * core.matrixU();
  f.v = of_v.householderQ() * Eigen::MatrixXd::Identity(block.cols(), crosses) * core.matrixV();
  Eigen::Index rank = least_rank(f.v, sigma, columns);
  if (rows) rank = std::max(rank, least_rank(f.u, sigma, *rows));
  if (rank >= most) return {};
  rank = std::max<Eigen::Index>(rank, 1);
  const Eigen::VectorXd root = sigma.head(rank).cwiseSqrt();
  f.u = (f.u.leftCols(rank) * root.asDiagonal()).eval();
  f.v = (f.v.leftCols(rank) * root.asDiagonal()).eval();
  keep_zero_rows(block, f.u);
  keep_zero_rows(block.transpose(), f.v);
  return f;
}

// ---- all blocks -----------------------------------------------------------------------------------------------------

class Packer {
 public:
  Packer(const ComplianceSource& source, const CompliancePackOptions& options)
      : source_(source), options_(options), tree_(source, leaf_nodes(source.surface_nodes)) {}

  PackedCompliance pack() {
    std::vector<bool> is_touchable(static_cast<std::size_t>(source_.surface_nodes), false);
    for (const auto node : source_.touchable) is_touchable[node] = true;
    std::vector<std::int32_t> others;
    for (std::int32_t n = 0; n < source_.surface_nodes; ++n)
      if (!is_touchable[n]) others.push_back(n);
    const std::int32_t root = tree_.add(source_.touchable), rest = tree_.add(others);
    order_columns();
    norms();
    Progress progress("blocks", static_cast<std::uint64_t>(source_.touchable.size()) * source_.touchable.size());
    progress_ = &progress;
    diagonal(root);
    if (rest >= 0) off_diagonal(rest, root);
    out_.nodes = tree_.order;
    out_.cluster_ends = tree_.leaf_ends;
    return std::move(out_);
  }

 private:
  static std::int32_t leaf_nodes(std::int32_t surface_nodes) {
    std::int32_t leaf = kLeafNodes;  // halving leaves clusters of more than half that
    while (static_cast<std::uint64_t>(surface_nodes) * 2 / static_cast<std::uint64_t>(leaf) + 2 > kMaxClusters)
      leaf *= 2;
    return leaf;
  }

  const Cluster& at(std::int32_t cluster) const { return tree_.clusters[cluster]; }

  // The columns by position in the tree.
  void order_columns() {
    std::vector<std::int32_t> slot_of(static_cast<std::size_t>(source_.surface_nodes), -1);
    for (std::size_t k = 0; k < source_.touchable.size(); ++k)
      slot_of[source_.touchable[k]] = static_cast<std::int32_t>(k);
    for (std::size_t p = 0; p < source_.touchable.size(); ++p) {
      slot_.push_back(static_cast<std::size_t>(slot_of[tree_.order[p]]));
      stiffness_.emplace_back(
          Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&source_.stiffness[9 * slot_[p]]));
    }
  }

  // The 2-norm of each column of T^u.
  void norms() {
    Eigen::MatrixXd c(3 * source_.surface_nodes, 3);
    norm_.resize(stiffness_.size());
    for (std::size_t p = 0; p < stiffness_.size(); ++p) {
      source_.compliance(slot_[p], tree_.order, c.data());
      const Eigen::MatrixXd t = c * stiffness_[p];
      for (int j = 0; j < 3; ++j) norm_[p][j] = t.col(j).norm();
    }
  }

  Eigen::MatrixXd numbers(const Cluster& rows, const Cluster& columns) const {
    Eigen::MatrixXd block(3 * rows.size(), 3 * columns.size());
    const std::span nodes(&tree_.order[static_cast<std::size_t>(rows.begin)], static_cast<std::size_t>(rows.size()));
    for (std::int32_t p = columns.begin; p < columns.end; ++p)
      source_.compliance(slot_[p], nodes, block.col(3 * (p - columns.begin)).data());
    return block;
  }

  // Each block may make a share of the allowed error of a column, by the number of its rows: the squares of the shares
  // add up to the square of the whole.
  Budget budget(const Cluster& own, const Cluster& other) const {
    Budget b;
    const double share =
        *options_.low_rank * std::sqrt(static_cast<double>(other.size()) / static_cast<double>(source_.surface_nodes));
    for (std::int32_t p = own.begin; p < own.end; ++p) {
      double least = std::numeric_limits<double>::infinity();
      std::array<double, 3> of_t{};
      for (int j = 0; j < 3; ++j) {
        // A fixed dof has no column; nothing is asked of it.
        of_t[j] = norm_[p][j] > 0 ? share * norm_[p][j] : std::numeric_limits<double>::infinity();
        least = std::min(least, of_t[j]);
      }
      b.of_t.push_back(of_t);
      b.of_c.push_back(least / stiffness_[p].norm());
      b.stiffness.push_back(stiffness_[p]);
    }
    return b;
  }

  void diagonal(std::int32_t cluster) {
    const Cluster c = at(cluster);
    if (c.is_leaf()) return dense(c, c);
    diagonal(c.left);
    diagonal(c.right);
    off_diagonal(c.left, c.right);
  }

  void off_diagonal(std::int32_t row_cluster, std::int32_t column_cluster) {
    const Cluster rows = at(row_cluster), columns = at(column_cluster);
    if (options_.low_rank && are_apart(rows, columns) && try_low_rank(rows, columns)) return;
    if (rows.is_leaf() && columns.is_leaf()) return dense(rows, columns);
    for (const std::int32_t r : rows.is_leaf() ? std::vector{row_cluster} : std::vector{rows.left, rows.right})
      for (const std::int32_t c :
           columns.is_leaf() ? std::vector{column_cluster} : std::vector{columns.left, columns.right})
        off_diagonal(r, c);
  }

  bool try_low_rank(const Cluster& rows, const Cluster& columns) {
    const Eigen::MatrixXd block = numbers(rows, columns);
    if (block.isZero(0)) return true;  // fixed nodes: what no block holds is zero
    const bool both = rows.begin < static_cast<std::int32_t>(stiffness_.size());
    const Budget of_columns = budget(columns, rows);
    std::optional<Budget> of_rows;
    if (both) of_rows = budget(rows, columns);
    const auto factors = low_rank(block, of_columns, of_rows ? &*of_rows : nullptr);
    if (!factors) {
      out_.apart_but_dense += rows.is_leaf() && columns.is_leaf();
      return false;
    }
    const auto rank = static_cast<std::int32_t>(factors->u.cols());
    append(rows, columns, rank, {&factors->u, &factors->v});
    ++out_.low_rank_blocks;
    out_.largest_rank = std::max(out_.largest_rank, rank);
    return true;
  }

  void dense(const Cluster& rows, const Cluster& columns) {
    Eigen::MatrixXd block = numbers(rows, columns);
    if (block.isZero(0)) return;
    if (rows.begin == columns.begin)
      block = (0.5 * (block + block.transpose())).eval();  // it holds both C_nk and C_kn; they must be equal
    append(rows, columns, 0, {&block});
    ++out_.dense_blocks;
  }

  // Appends the matrices column by column: a dense block, or the factors U and V. Each matrix has its own scale; the
  // scale of the block is their product.
  void append(const Cluster& rows, const Cluster& columns, std::int32_t rank,
              std::initializer_list<const Eigen::MatrixXd*> matrices) {
    out_.blocks.insert(out_.blocks.end(), {rows.leaf_begin, rows.leaf_end, columns.leaf_begin, columns.leaf_end, rank});
    float scale = 1;
    for (const Eigen::MatrixXd* m : matrices) {
      const auto count = static_cast<std::size_t>(m->size());
      if (options_.type == ElementType::f16) {
        scale *= append_halves(m->data(), count, &out_.values);
        continue;
      }
      const std::size_t first = out_.values.size();
      out_.values.resize(first + 4 * count);
      for (std::size_t i = 0; i < count; ++i) {
        const auto number = static_cast<float>(m->data()[i]);
        std::memcpy(&out_.values[first + 4 * i], &number, 4);
      }
    }
    out_.scale.push_back(scale);
    const bool one_sided = rows.begin == columns.begin || rows.begin >= static_cast<std::int32_t>(stiffness_.size());
    progress_->advance(static_cast<std::uint64_t>(rows.size()) * columns.size() *
                       (rows.begin >= static_cast<std::int32_t>(stiffness_.size()) ? 0
                        : one_sided                                                ? 1
                                                                                   : 2));
  }

  const ComplianceSource& source_;
  const CompliancePackOptions& options_;
  Tree tree_;
  std::vector<std::size_t> slot_;            // in source.touchable, by position
  std::vector<Eigen::Matrix3d> stiffness_;   // T^f by position
  std::vector<std::array<double, 3>> norm_;  // |T| by position and dof
  PackedCompliance out_;
  Progress* progress_ = nullptr;
};

}  // namespace

float half_scale(double largest) {
  if (!(largest > 0)) return 1;
  int exponent = 0;
  std::frexp(largest, &exponent);
  return std::ldexp(1.0f, exponent - 15);
}

PackedCompliance blocks_in_halves(std::span<const formats::ComplianceBlock> blocks, const float* values) {
  PackedCompliance out;
  for (const formats::ComplianceBlock& block : blocks) {
    const auto numbers = static_cast<std::size_t>(block.numbers()),
               of_u = block.rank > 0 ? static_cast<std::size_t>(block.v_run(0) - block.first) : numbers;
    const float* const first = values + block.first;
    float scale = block.scale * append_halves(first, of_u, &out.values);
    if (block.rank > 0) scale *= append_halves(first + of_u, numbers - of_u, &out.values);
    out.scale.push_back(scale);
    ++(block.rank > 0 ? out.low_rank_blocks : out.dense_blocks);
    out.largest_rank = std::max(out.largest_rank, block.rank);
  }
  return out;
}

PackedCompliance pack_compliance(const ComplianceSource& source, const CompliancePackOptions& options) {
  return Packer(source, options).pack();
}

}  // namespace palpate
