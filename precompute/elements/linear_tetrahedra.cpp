#include "precompute/elements/linear_tetrahedra.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

using Gradients = Eigen::Matrix<double, 3, 4>;

std::array<std::array<double, 3>, 4> corners(const ElasticBody& body, const std::array<std::int32_t, 4>& t) {
  return {body.nodes[t[0]], body.nodes[t[1]], body.nodes[t[2]], body.nodes[t[3]]};
}

// Fills in the gradients of the four shape functions (the barycentric coordinates) and returns the volume.
double shape_gradients(const std::array<std::array<double, 3>, 4>& p, Gradients* gradients) {
  Eigen::Matrix3d edges;
  for (int a = 0; a < 3; ++a)
    for (int d = 0; d < 3; ++d) edges(a, d) = p[a + 1][d] - p[0][d];
  gradients->rightCols<3>() = edges.inverse();
  gradients->col(0) = -gradients->rightCols<3>().rowwise().sum();
  return edges.determinant() / 6;
}

Lists tetrahedra_of(const ElasticBody& body) {
  Lists lists;
  for (const auto& t : body.tetrahedra) lists.append(t);
  return lists;
}

// Adds the blocks of every tetrahedron, with these shares of the moduli.
void add_tetrahedra(const ElasticBody& body, double bulk_share, double shear_share, BlockMatrix& matrix) {
  for (std::size_t t = 0; t < body.tetrahedra.size(); ++t) {
    const auto& nodes = body.tetrahedra[t];
    Moduli moduli = moduli_of(body.materials[body.region[t]]);
    moduli.bulk *= bulk_share, moduli.shear *= shear_share;
    const auto k = element_stiffness(corners(body, nodes), moduli);
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        auto& block = matrix.block[index_of_block(matrix, nodes[a], nodes[b])];
        for (int i = 0; i < 9; ++i) block[i] += k[a][b][i];
      }
  }
}

// shear times the blocks (a, b) of an element whose shape functions have the gradients a and b, without bulk modulus.
void add_shear(double shear, const std::array<double, 3>& a, const std::array<double, 3>& b,
               std::array<double, 9>& block) {
  const double both = shear * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      block[3 * i + j] += shear * (a[j] * b[i]) - 2 * shear / 3 * (a[i] * b[j]) + (i == j ? both : 0);
}

}  // namespace

Dilatations nodal_dilatations(const ElasticBody& body, double averaged_shear) {
  const auto count = static_cast<std::int32_t>(body.nodes.size());
  const Lists around = lists_around(tetrahedra_of(body), count);
  Dilatations result;
  std::vector<std::array<double, 3>> sum(body.nodes.size(), {0, 0, 0});
  std::vector<std::int32_t> regions, star;
  Gradients g;
  for (std::int32_t n = 0; n < count; ++n) {
    regions.clear();
    for (const auto t : around[n]) regions.push_back(body.region[t]);
    std::sort(regions.begin(), regions.end());
    regions.erase(std::unique(regions.begin(), regions.end()), regions.end());
    for (const auto region : regions) {
      star.clear();
      double volume = 0;
      for (const auto t : around[n]) {
        if (body.region[t] != region) continue;
        const double quarter = shape_gradients(corners(body, body.tetrahedra[t]), &g) / 4;
        volume += quarter;
        for (int a = 0; a < 4; ++a) {
          const auto node = body.tetrahedra[t][a];
          star.push_back(node);
          for (int d = 0; d < 3; ++d) sum[node][d] += quarter * g(d, a);
        }
      }
      std::sort(star.begin(), star.end());
      star.erase(std::unique(star.begin(), star.end()), star.end());
      const Moduli moduli = moduli_of(body.materials[region]);
      const double root = std::sqrt(moduli.bulk / volume);
      for (const auto node : star) {
        result.factor.push_back({root * sum[node][0], root * sum[node][1], root * sum[node][2]});
        sum[node] = {0, 0, 0};
      }
      result.nodes.append(star);
      result.centre.push_back(n);
      if (averaged_shear > 0) result.shear.push_back(averaged_shear * moduli.shear / moduli.bulk);
    }
  }
  return result;
}

// Row by row of K.
void add_dilatations(const Dilatations& terms, BlockMatrix& matrix) {
  const Lists around = lists_around(terms.nodes, matrix.rows);
  std::vector<std::int64_t> block_in_column(matrix.rows);
  for (std::int32_t row = 0; row < matrix.rows; ++row) {
    for (auto at = matrix.first[row]; at < matrix.first[row + 1]; ++at) block_in_column[matrix.column[at]] = at;
    for (const auto term : around[row]) {
      const auto nodes = terms.nodes[term];
      const auto* factor = &terms.factor[terms.nodes.first[term]];
      const auto& own = factor[std::lower_bound(nodes.begin(), nodes.end(), row) - nodes.begin()];
      for (std::size_t b = 0; b < nodes.size(); ++b) {
        auto& block = matrix.block[block_in_column[nodes[b]]];
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) block[3 * i + j] += own[i] * factor[b][j];
        if (!terms.shear.empty()) add_shear(terms.shear[term], own, factor[b], block);
      }
    }
  }
}

void add_deviatoric_stiffness(const ElasticBody& body, BlockMatrix& matrix, double share) {
  add_tetrahedra(body, 0, share, matrix);
}

Moduli moduli_of(const Material& material) {
  return {material.young / (3 * (1 - 2 * material.poisson)), material.young / (2 * (1 + material.poisson))};
}

ElementStiffness element_stiffness(const std::array<std::array<double, 3>, 4>& points, const Moduli& moduli) {
  Gradients g;
  const double volume = shape_gradients(points, &g);
  const double mu = volume * moduli.shear, lambda = volume * moduli.bulk - 2 * mu / 3;
  ElementStiffness k;
  for (int a = 0; a < 4; ++a)
    for (int b = a; b < 4; ++b) {
      const double shear = mu * g.col(a).dot(g.col(b));
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const double value = a == b && j < i
                                   ? k[a][a][3 * j + i]
                                   : lambda * (g(i, a) * g(j, b)) + mu * (g(j, a) * g(i, b)) + (i == j ? shear : 0);
          k[a][b][3 * i + j] = value;
          k[b][a][3 * j + i] = value;
        }
    }
  return k;
}

BlockMatrix linear_stiffness(const ElasticBody& body) {
  BlockMatrix matrix = coupled_blocks(tetrahedra_of(body), static_cast<std::int32_t>(body.nodes.size()));
  add_tetrahedra(body, 1, 1, matrix);
  return matrix;
}

BlockMatrix nodal_dilatation_stiffness(const ElasticBody& body, double averaged_shear) {
  const Dilatations terms = nodal_dilatations(body, averaged_shear);
  BlockMatrix matrix = coupled_blocks(terms.nodes, static_cast<std::int32_t>(body.nodes.size()));
  add_deviatoric_stiffness(body, matrix, 1 - averaged_shear);
  add_dilatations(terms, matrix);
  return matrix;
}

std::vector<double> linear_mass(const ElasticBody& body) {
  std::vector<double> mass(body.nodes.size(), 0.0);
  Gradients unused;
  for (std::size_t t = 0; t < body.tetrahedra.size(); ++t) {
    const double volume = shape_gradients(corners(body, body.tetrahedra[t]), &unused);
    for (const auto n : body.tetrahedra[t]) mass[n] += body.materials[body.region[t]].density * volume / 4;
  }
  return mass;
}

}  // namespace palpate
