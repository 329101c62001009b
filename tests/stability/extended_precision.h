// The tensor of a touchable node, computed with dense matrices and 64 bits of mantissa for every element: the reference where
// double precision has few digits left.
#pragma once

#include "formats/averaged_shear.h"
#include "precompute/elements/quadratic_tetrahedra.h"
#include "tests/stability/solid.h"

namespace palpate::tests {

using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using Long3 = Eigen::Matrix<long double, 3, 3>;
using LongRow = Eigen::Matrix<long double, 1, 3>;

class ExtendedStiffness {
 public:
  ExtendedStiffness(const ElasticBody& body, Element element) : body_(body) {
    if (element == Element::p2_p0)
      quadratic();
    else
      linear(element != Element::p1, element == Element::p1_ang ? formats::kAveragedShear : 0);
  }
  const Long& matrix() const { return k_; }

 private:
  struct Straight {
    Eigen::Matrix<long double, 4, 3> gradient;  // of the barycentric coordinates
    long double volume, shear, bulk;
  };
  Straight straight(std::size_t e) const {
    const auto& t = body_.tetrahedra[e];
    Long3 edges;
    for (int i = 0; i < 3; ++i)
      for (int d = 0; d < 3; ++d)
        edges(i, d) = static_cast<long double>(body_.nodes[index(t, i + 1)][d]) - body_.nodes[index(t, 0)][d];
    const Material& m = body_.materials[body_.region[e]];
    Straight s;
    s.volume = edges.determinant() / 6;
    EXPECT_GT(s.volume, 0);
    s.gradient.bottomRows<3>() = edges.inverse().transpose();
    s.gradient.row(0) = -s.gradient.bottomRows<3>().colwise().sum();
    s.shear = m.young / (2 * (1 + static_cast<long double>(m.poisson)));
    s.bulk = m.young / (3 * (1 - 2 * static_cast<long double>(m.poisson)));
    return s;
  }
  static std::size_t index(const std::array<std::int32_t, 4>& t, int i) { return static_cast<std::size_t>(t[i]); }
  void add(std::int32_t a, std::int32_t b, const Long3& block) { k_.block<3, 3>(3 * a, 3 * b) += block; }
  // 2 mu of the deviatoric strain of two gradients.
  static Long3 deviatoric(long double weight, const LongRow& a, const LongRow& b) {
    return weight * (b.transpose() * a + a.dot(b) * Long3::Identity() - 2.0L / 3 * a.transpose() * b);
  }

  // share: of the shear, that follows the gradient averaged at the nodes.
  void linear(bool averaged, long double share) {
    k_ = Long::Zero(3 * static_cast<Eigen::Index>(body_.nodes.size()),
                    3 * static_cast<Eigen::Index>(body_.nodes.size()));
    // Per node: V and D of the tetrahedra around it; one material where averaged.
    Long dilatation = averaged ? Long::Zero(static_cast<Eigen::Index>(body_.nodes.size()), k_.rows()) : Long();
    std::vector<long double> volume(body_.nodes.size(), 0);
    long double bulk = 0, shear = 0;
    for (std::size_t e = 0; e < body_.tetrahedra.size(); ++e) {
      const auto& t = body_.tetrahedra[e];
      const Straight s = straight(e);
      bulk = s.bulk, shear = s.shear;
      for (std::size_t a = 0; a < 4; ++a) {
        volume[t[a]] += s.volume / 4;
        for (std::size_t b = 0; b < 4; ++b) {
          const LongRow ga = s.gradient.row(static_cast<int>(a)), gb = s.gradient.row(static_cast<int>(b));
          Long3 block = deviatoric((1 - share) * s.volume * s.shear, ga, gb);
          if (!averaged) block += s.volume * s.bulk * ga.transpose() * gb;
          add(t[a], t[b], block);
          if (averaged) dilatation.block<1, 3>(t[a], 3 * t[b]) += s.volume / 4 * gb;
        }
      }
    }
    if (!averaged) return;
    for (Eigen::Index n = 0; n < dilatation.rows() && share > 0; ++n)
      for (Eigen::Index a = 0; a < dilatation.rows(); ++a)
        for (Eigen::Index b = 0; b < dilatation.rows(); ++b) {
          const LongRow ga = dilatation.block<1, 3>(n, 3 * a), gb = dilatation.block<1, 3>(n, 3 * b);
          if (!ga.isZero(0) && !gb.isZero(0))
            add(static_cast<std::int32_t>(a), static_cast<std::int32_t>(b),
                deviatoric(share * shear / volume[static_cast<std::size_t>(n)], ga, gb));
        }
    for (Eigen::Index n = 0; n < dilatation.rows(); ++n) dilatation.row(n) *= std::sqrt(bulk / volume[n]);
    k_ += dilatation.transpose() * dilatation;
  }

  // For straight edges only: bodies with flat faces.
  void quadratic() {
    const QuadraticMesh mesh = quadratic_mesh(body_);
    EXPECT_EQ(mesh.curved_edges, 0u);
    k_ = Long::Zero(3 * static_cast<Eigen::Index>(mesh.nodes.size()), 3 * static_cast<Eigen::Index>(mesh.nodes.size()));
    constexpr int kEnds[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
    const long double near = (5 + 3 * std::sqrt(5.0L)) / 20, far = (5 - std::sqrt(5.0L)) / 20;  // degree 2
    for (std::size_t e = 0; e < mesh.cells.size(); ++e) {
      const Straight s = straight(e);
      Eigen::Matrix<long double, 10, 3> mean = Eigen::Matrix<long double, 10, 3>::Zero();
      for (int q = 0; q < 4; ++q) {
        Eigen::Matrix<long double, 10, 3> slope;
        const auto l = [&](int v) { return v == q ? near : far; };
        for (int v = 0; v < 4; ++v) slope.row(v) = (4 * l(v) - 1) * s.gradient.row(v);
        for (int m = 0; m < 6; ++m)
          slope.row(4 + m) =
              4 * (l(kEnds[m][0]) * s.gradient.row(kEnds[m][1]) + l(kEnds[m][1]) * s.gradient.row(kEnds[m][0]));
        mean += 0.25L * slope;
        for (int a = 0; a < 10; ++a)
          for (int b = 0; b < 10; ++b)
            add(mesh.cells[e][a], mesh.cells[e][b], deviatoric(s.volume / 4 * s.shear, slope.row(a), slope.row(b)));
      }
      for (int a = 0; a < 10; ++a)
        for (int b = 0; b < 10; ++b)
          add(mesh.cells[e][a], mesh.cells[e][b], s.volume * s.bulk * mean.row(a).transpose() * mean.row(b));
    }
  }

  const ElasticBody& body_;
  Long k_;
};

// T^u of a node whose three dofs are free, or of the free ones: [3][N][3] as NodeTensor, N vertices. How a vertex is touched
// is taken from the discretisation.
inline std::vector<double> in_extended_precision(const ElasticBody& body, Element element, std::int32_t node) {
  const Discretisation discretisation = discretise(body, element);
  const Long stiffness = ExtendedStiffness(body, element).matrix();
  std::vector<Eigen::Index> free;
  for (std::size_t n = 0; n < discretisation.fixed.size(); ++n)
    for (std::size_t d = 0; d < 3; ++d)
      if (!discretisation.fixed[n][d]) free.push_back(static_cast<Eigen::Index>(3 * n + d));
  // Row n reads the displacement of vertex n; the transpose loads it.
  const auto vertices = static_cast<Eigen::Index>(body.nodes.size());
  Long read = Long::Zero(3 * vertices, stiffness.rows());
  const auto& touch = discretisation.touch;
  for (Eigen::Index v = 0; v < vertices; ++v)
    for (int d = 0; d < 3; ++d) {
      if (body.fixed[v][d]) continue;
      if (touch.weight.empty())
        read(3 * v + d, 3 * v + d) = 1;
      else
        for (auto at = touch.nodes.first[v]; at < touch.nodes.first[v + 1]; ++at)
          read(3 * v + d, 3 * touch.nodes.item[at] + d) = touch.weight[at];
    }
  const Long read_free = read(Eigen::all, free);
  const Long load = read_free.middleRows<3>(3 * node).transpose();
  const Long columns = read_free * Long(Long(stiffness(free, free)).llt().solve(load));
  Long3 own = columns.middleRows<3>(3 * node);
  for (int d = 0; d < 3; ++d)
    if (body.fixed[node][d]) own(d, d) = 1;
  Long3 inverse = own.inverse();
  for (int d = 0; d < 3; ++d)
    if (body.fixed[node][d]) inverse(d, d) = 0;
  const Long field = columns * inverse;
  std::vector<double> flat;
  for (int j = 0; j < 3; ++j)
    for (Eigen::Index i = 0; i < field.rows(); ++i) flat.push_back(static_cast<double>(field(i, j)));
  return flat;
}

}  // namespace palpate::tests
