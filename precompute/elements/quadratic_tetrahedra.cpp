#include "precompute/elements/quadratic_tetrahedra.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "precompute/elements/curved_edges.h"
#include "precompute/elements/linear_tetrahedra.h"

namespace palpate {
namespace {

using Ends = std::array<std::int32_t, 2>;
using Barycentric = std::array<double, 4>;

constexpr int kEdges[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
constexpr double kLeastVolume = 0.2;  // of the straight tetrahedron's volume element
constexpr double kLeastScale = 0.1;   // of an offset; below it the edge is left straight

Ends ends_of(std::int32_t a, std::int32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

// ---- shape functions and quadrature ----

struct Point {
  Barycentric at;
  double weight;  // of the volume
};

// Keast's four points of degree 2 (exact on straight cells) and Walkington's fourteen of degree 5, weights positive.
const std::vector<Point>& points_of(bool curved) {
  static const auto make = [](bool fine) {
    std::vector<Point> points;
    const auto corner = [&](double near, double far, double weight) {
      for (std::size_t a = 0; a < 4; ++a) {
        points.push_back({{far, far, far, far}, weight});
        points.back().at[a] = near;
      }
    };
    if (!fine) {
      corner(0.58541019662496845, 0.13819660112501051, 0.25);
      return points;
    }
    constexpr double a = 0.31088591926330060980, b = 0.092735250310891226402, c = 0.045503704125649649492;
    corner(1 - 3 * a, a, 0.11268792571801585080);
    corner(1 - 3 * b, b, 0.073493043116361949544);
    for (const auto& edge : kEdges) {
      points.push_back({{0.5 - c, 0.5 - c, 0.5 - c, 0.5 - c}, 0.042546020777081466438});
      points.back().at[static_cast<std::size_t>(edge[0])] = points.back().at[static_cast<std::size_t>(edge[1])] = c;
    }
    return points;
  };
  static const std::vector<Point> few = make(false), many = make(true);
  return curved ? many : few;
}

std::array<double, 10> shapes(const Barycentric& l) {
  std::array<double, 10> n{};
  for (std::size_t a = 0; a < 4; ++a) n[a] = l[a] * (2 * l[a] - 1);
  for (std::size_t e = 0; e < 6; ++e) n[4 + e] = 4 * l[kEdges[e][0]] * l[kEdges[e][1]];
  return n;
}

// Derivatives with respect to the barycentric coordinates 1, 2 and 3; coordinate 0 is 1 minus their sum.
using Derivatives = Eigen::Matrix<double, 3, 10>;
Derivatives shape_derivatives(const Barycentric& l) {
  Eigen::Matrix<double, 4, 10> each = Eigen::Matrix<double, 4, 10>::Zero();
  for (int a = 0; a < 4; ++a) each(a, a) = 4 * l[static_cast<std::size_t>(a)] - 1;
  for (int e = 0; e < 6; ++e) {
    each(kEdges[e][0], 4 + e) = 4 * l[kEdges[e][1]];
    each(kEdges[e][1], 4 + e) = 4 * l[kEdges[e][0]];
  }
  return each.bottomRows<3>().rowwise() - each.row(0);
}

// Of the ten nodes, relative to the first corner: sums over absolute coordinates would lose digits far from the origin.
using Positions = Eigen::Matrix<double, 10, 3>;
Positions positions_of(const QuadraticMesh& mesh, std::size_t cell) {
  const auto at = [&](int a) { return Eigen::RowVector3d(mesh.nodes[mesh.cells[cell][a]].data()); };
  Positions positions;
  for (int a = 0; a < 10; ++a) positions.row(a) = at(a) - at(0);
  return positions;
}

// A quadrature point: the gradients of the shape functions in space, and the volume that the point stands for.
struct Sample {
  Derivatives gradient;
  std::array<double, 10> shape;
  double volume;
};
std::vector<Sample> samples_of(const QuadraticMesh& mesh, std::size_t cell) {
  const Positions positions = positions_of(mesh, cell);
  std::vector<Sample> samples;
  for (const auto& point : points_of(mesh.curved[cell])) {
    const Derivatives derivatives = shape_derivatives(point.at);
    const Eigen::Matrix3d jacobian = derivatives * positions;  // d x_j / d l_i
    samples.push_back({jacobian.inverse() * derivatives, shapes(point.at), point.weight * jacobian.determinant() / 6});
  }
  return samples;
}

// ---- the mesh ----

// The smallest volume element at the quadrature points and nodes of the cell, relative to that of the straight
// tetrahedron.
double least_volume(const QuadraticMesh& mesh, std::size_t cell) {
  static const std::vector<Barycentric> everywhere = [] {
    std::vector<Barycentric> all;
    for (const auto& point : points_of(true)) all.push_back(point.at);
    for (std::size_t a = 0; a < 4; ++a) all.push_back({0, 0, 0, 0}), all.back()[a] = 1;
    for (const auto& edge : kEdges) all.push_back({0, 0, 0, 0}), all.back()[edge[0]] = all.back()[edge[1]] = 0.5;
    return all;
  }();
  const Positions positions = positions_of(mesh, cell);
  Eigen::Matrix3d straight;
  for (int a = 0; a < 3; ++a) straight.row(a) = positions.row(a + 1) - positions.row(0);
  double least = 1;
  for (const auto& at : everywhere)
    least = std::min(least, (shape_derivatives(at) * positions).determinant() / straight.determinant());
  return least;
}

class MeshMaker {
 public:
  explicit MeshMaker(const ElasticBody& body) : body_(body) {}

  QuadraticMesh make() {
    number_edges();
    hold_middles();
    curve();
    return std::move(mesh_);
  }

 private:
  std::int32_t middle(std::int32_t a, std::int32_t b) const {
    const auto at = std::lower_bound(edges_.begin(), edges_.end(), ends_of(a, b)) - edges_.begin();
    return static_cast<std::int32_t>(body_.nodes.size() + static_cast<std::size_t>(at));
  }
  std::size_t edge_of(std::int32_t middle) const { return static_cast<std::size_t>(middle) - body_.nodes.size(); }

  void number_edges() {
    for (const auto& t : body_.tetrahedra)
      for (const auto& edge : kEdges) edges_.push_back(ends_of(t[edge[0]], t[edge[1]]));
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
    for (const auto& t : body_.tetrahedra) {
      auto& cell = mesh_.cells.emplace_back();
      std::copy(t.begin(), t.end(), cell.begin());
      for (std::size_t e = 0; e < 6; ++e) cell[4 + e] = middle(t[kEdges[e][0]], t[kEdges[e][1]]);
    }
    for (const auto& t : body_.triangles)
      mesh_.triangles.push_back({t[0], t[1], t[2], middle(t[0], t[1]), middle(t[1], t[2]), middle(t[2], t[0])});
    mesh_.nodes = body_.nodes;
    for (const auto& [a, b] : edges_) {
      auto& m = mesh_.nodes.emplace_back();
      for (std::size_t d = 0; d < 3; ++d) m[d] = (body_.nodes[a][d] + body_.nodes[b][d]) / 2;
    }
  }

  void hold_middles() {
    std::vector<char> on_surface(edges_.size(), 0);
    for (const auto& t : mesh_.triangles)
      for (std::size_t i = 3; i < 6; ++i) on_surface[edge_of(t[i])] = 1;
    mesh_.fixed = body_.fixed;
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      const auto [a, b] = edges_[e];
      const bool through = !on_surface[e] && a < body_.surface_count && b < body_.surface_count;
      auto& held = mesh_.fixed.emplace_back();
      for (std::size_t d = 0; d < 3; ++d) held[d] = !through && body_.fixed[a][d] && body_.fixed[b][d];
    }
  }

  void curve() {
    offset_.assign(edges_.size(), {0, 0, 0});
    scale_.assign(edges_.size(), 1);
    for (const auto& edge : surface_edge_offsets(body_.nodes, body_.triangles)) {
      // An offset below the rounding of the coordinates is no curve.
      const auto e = edge_of(middle(edge.ends[0], edge.ends[1]));
      double length = 0, size = 0;
      for (std::size_t d = 0; d < 3; ++d) {
        length += std::pow(body_.nodes[edge.ends[1]][d] - body_.nodes[edge.ends[0]][d], 2);
        size += std::pow(edge.offset[d], 2);
      }
      if (size > 1e-24 * length) offset_[e] = edge.offset;
    }
    set_middles();
    while (shrink_unsound()) set_middles();
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      if (is_curved(e)) ++mesh_.curved_edges;
      if (scale_[e] < 1) ++mesh_.straightened_edges;
    }
  }

  bool is_curved(std::size_t e) const { return scale_[e] > 0 && offset_[e] != std::array<double, 3>{0, 0, 0}; }

  void set_middles() {
    for (std::size_t e = 0; e < edges_.size(); ++e)
      for (std::size_t d = 0; d < 3; ++d)
        mesh_.nodes[body_.nodes.size() + e][d] =
            (body_.nodes[edges_[e][0]][d] + body_.nodes[edges_[e][1]][d]) / 2 + scale_[e] * offset_[e][d];
    mesh_.curved.assign(mesh_.cells.size(), 0);
    for (std::size_t c = 0; c < mesh_.cells.size(); ++c)
      for (std::size_t i = 4; i < 10; ++i) mesh_.curved[c] |= is_curved(edge_of(mesh_.cells[c][i]));
  }

  // Halves the offsets of the edges of tetrahedra that are not sound. False where all are sound.
  bool shrink_unsound() {
    std::vector<char> shrink(edges_.size(), 0);
    bool any = false;
    for (std::size_t c = 0; c < mesh_.cells.size(); ++c) {
      if (!mesh_.curved[c] || least_volume(mesh_, c) >= kLeastVolume) continue;
      for (std::size_t i = 4; i < 10; ++i) {
        const auto e = edge_of(mesh_.cells[c][i]);
        if (is_curved(e)) shrink[e] = 1, any = true;
      }
    }
    for (std::size_t e = 0; e < edges_.size(); ++e)
      if (shrink[e]) scale_[e] = scale_[e] / 2 < kLeastScale ? 0 : scale_[e] / 2;
    return any;
  }

  const ElasticBody& body_;
  QuadraticMesh mesh_;
  std::vector<Ends> edges_;
  std::vector<std::array<double, 3>> offset_;
  std::vector<double> scale_;
};

// ---- stiffness ----

using CellStiffness = std::array<std::array<std::array<double, 9>, 10>, 10>;

void add_symmetric(CellStiffness& k, int a, int b, const Eigen::Matrix3d& value) {
  for (int i = 0; i < 3; ++i)
    for (int j = a == b ? i : 0; j < 3; ++j) k[a][b][3 * i + j] += value(i, j);
}

// Computes the upper triangle and copies it to the lower one, so that the result is symmetric to the last bit.
void cell_stiffness(const std::vector<Sample>& samples, const Moduli& moduli, CellStiffness& k) {
  for (auto& row : k)
    for (auto& block : row) block.fill(0);
  Derivatives divergence = Derivatives::Zero();
  double volume = 0;
  for (const auto& sample : samples) {
    divergence += sample.volume * sample.gradient;
    volume += sample.volume;
    const double mu = sample.volume * moduli.shear;
    for (int a = 0; a < 10; ++a)
      for (int b = a; b < 10; ++b) {
        const auto ga = sample.gradient.col(a), gb = sample.gradient.col(b);
        Eigen::Matrix3d value = mu * (gb * ga.transpose()) - 2 * mu / 3 * (ga * gb.transpose());
        value.diagonal().array() += mu * ga.dot(gb);
        add_symmetric(k, a, b, value);
      }
  }
  for (int a = 0; a < 10; ++a)
    for (int b = a; b < 10; ++b)
      add_symmetric(k, a, b, moduli.bulk / volume * (divergence.col(a) * divergence.col(b).transpose()));
  for (int a = 0; a < 10; ++a)
    for (int b = a; b < 10; ++b)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          if (a < b || i < j) k[b][a][3 * j + i] = k[a][b][3 * i + j];
}

}  // namespace

QuadraticMesh quadratic_mesh(const ElasticBody& body) {
  return MeshMaker(body).make();
}

BlockMatrix quadratic_stiffness(const QuadraticMesh& mesh, const ElasticBody& body) {
  Lists cells;
  for (const auto& cell : mesh.cells) cells.append(cell);
  BlockMatrix matrix = coupled_blocks(cells, static_cast<std::int32_t>(mesh.nodes.size()));
  CellStiffness k;
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    const auto& cell = mesh.cells[c];
    cell_stiffness(samples_of(mesh, c), moduli_of(body.materials[body.region[c]]), k);
    for (std::size_t a = 0; a < 10; ++a)
      for (std::size_t b = 0; b < 10; ++b) {
        auto& block = matrix.block[index_of_block(matrix, cell[a], cell[b])];
        for (std::size_t i = 0; i < 9; ++i) block[i] += k[a][b][i];
      }
  }
  return matrix;
}

std::vector<double> quadratic_mass(const QuadraticMesh& mesh, const ElasticBody& body) {
  std::vector<double> mass(mesh.nodes.size(), 0.0);
  for (std::size_t c = 0; c < mesh.cells.size(); ++c)
    for (const auto& sample : samples_of(mesh, c))
      for (std::size_t a = 0; a < 10; ++a)
        mass[mesh.cells[c][a]] += body.materials[body.region[c]].density * sample.volume * sample.shape[a];
  return mass;
}

}  // namespace palpate
