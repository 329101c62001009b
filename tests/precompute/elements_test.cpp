// Laws that every element obeys: affine fields are exact, rigid motions cost no energy, K is symmetric, T^u and T^f
// equal a dense solve.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "formats/errors.h"
#include "precompute/elements/element_warnings.h"
#include "precompute/elements/quadratic_tetrahedra.h"
#include "precompute/tensors/probe_columns.h"
#include "studies/bodies/imposed.h"
#include "studies/validation/cases.h"
#include "studies/validation/rigid_motion.h"
#include "studies/validation/shapes.h"
#include "tests/precompute/support.h"

namespace palpate::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

class EveryElement : public ::testing::TestWithParam<Element> {};
INSTANTIATE_TEST_SUITE_P(Elements, EveryElement, ::testing::ValuesIn(kElements), name_of_instance);

TEST_P(EveryElement, ReproducesAffineFieldsOnADistortedBox) {
  // Rounding of a direct solve: 1e-16 times the condition of K, which is 1e5 at nu = 0.4999.
  for (const double poisson : {0.0, 0.3, 0.49, 0.4999})
    EXPECT_LT(validation::patch_test().measure({GetParam(), poisson, {}}, 4).quantities.at(0).error, 1e-10) << poisson;
}

TEST_P(EveryElement, StoresNoEnergyInARigidMotionAndIsSymmetricToTheLastBit) {
  TetrahedralMesh mesh = box_mesh({4, 3, 5}, {0.3, 0.2, 0.4}, 0.2);
  part_in_two(mesh, 0.15);
  const ElasticBody body = body_of(mesh, {{5400, 0.499, 0}, {1e5, 0.3, 0}});
  const Discretisation discretisation = discretise(body, GetParam());
  const BlockMatrix& k = discretisation.stiffness;
  // The entries of a row, about 400 products, cancel. Each is rounded by at most half a unit in its last place; found:
  // 1e-16.
  EXPECT_LE(validation::rigid_motion_residual(discretisation), 2e-15);
  const MatrixXd matrix = dense(k);
  EXPECT_EQ(matrix, matrix.transpose());
}

// P: displacement of vertex v, dof d, is the sum of P(., 3 v + d) over the free dofs; zero where the vertex is held.
MatrixXd touch_matrix(const Discretisation& discretisation, const std::vector<Eigen::Index>& free) {
  std::vector<Eigen::Index> place(3 * discretisation.coordinates.size(), -1);
  for (std::size_t f = 0; f < free.size(); ++f) place[static_cast<std::size_t>(free[f])] = static_cast<Eigen::Index>(f);
  MatrixXd p = MatrixXd::Zero(static_cast<Eigen::Index>(free.size()), 3 * discretisation.vertices);
  for (std::int32_t v = 0; v < discretisation.vertices; ++v) {
    const auto& touch = discretisation.touch;
    double sum = 0;
    const std::int64_t first = touch.weight.empty() ? 0 : touch.nodes.first[v],
                       last = touch.weight.empty() ? 1 : touch.nodes.first[v + 1];
    for (auto at = first; at < last; ++at) {
      const std::int32_t node = touch.weight.empty() ? v : touch.nodes.item[at];
      const double weight = touch.weight.empty() ? 1 : touch.weight[at];
      sum += weight;
      for (int d = 0; d < 3; ++d) {
        const auto row = place[static_cast<std::size_t>(3 * node + d)];
        if (row >= 0 && !discretisation.fixed[v][d]) p(row, 3 * v + d) += weight;
      }
    }
    EXPECT_NEAR(sum, 1, 1e-14);
  }
  return p;
}

TEST_P(EveryElement, ItsTensorsEqualALiteralDenseSolveThroughTheTouchFunctionals) {
  TetrahedralMesh mesh = box_mesh({3, 2, 2}, {0.06, 0.05, 0.04}, 0.15);
  part_in_two(mesh, 0.03);
  ElasticBody body = body_of(mesh, {{3000, 0.49, 0}, {20000, 0.3, 0}});
  hold(body, [](const auto& p) {
    if (p[0] == 0) return 7;
    if (p[0] == 0.06 && p[1] == 0.05 && p[2] == 0.04) return 2;
    return p[2] == 0 ? 4 : 0;
  });
  const Discretisation discretisation = discretise(body, GetParam());
  std::vector<Eigen::Index> free;
  for (std::size_t n = 0; n < discretisation.fixed.size(); ++n)
    for (int d = 0; d < 3; ++d)
      if (!discretisation.fixed[n][d]) free.push_back(static_cast<Eigen::Index>(3 * n) + d);
  const MatrixXd p = touch_matrix(discretisation, free);
  const MatrixXd compliance = p.transpose() * MatrixXd(dense(discretisation.stiffness)(free, free)).llt().solve(p);
  const auto tensors = solve_node_tensors(body, GetParam(), body.touchable, 1e-11);
  ASSERT_EQ(tensors.size(), body.touchable.size());
  int partly = 0;
  for (const auto& tensor : tensors) {
    std::vector<Eigen::Index> own;
    for (int d = 0; d < 3; ++d)
      if (!body.fixed[tensor.node][d]) own.push_back(3 * tensor.node + d);
    partly += own.size() < 3;
    const MatrixXd force = MatrixXd(compliance(own, own)).inverse();
    const MatrixXd field = compliance(Eigen::all, own) * force;
    for (std::size_t a = 0; a < own.size(); ++a) {
      const auto j = static_cast<std::size_t>(own[a] % 3);
      for (std::size_t b = 0; b < own.size(); ++b)
        ASSERT_NEAR(tensor.stiffness[3 * static_cast<std::size_t>(own[b] % 3) + j],
                    force(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(a)), 1e-9 * force.norm());
      // Two solves of a matrix of condition 1e5 in double, and room.
      for (Eigen::Index i = 0; i < field.rows(); ++i)
        ASSERT_NEAR(tensor.displacement[j * static_cast<std::size_t>(field.rows()) + static_cast<std::size_t>(i)],
                    field(i, static_cast<Eigen::Index>(a)), 1e-9)
            << tensor.node;
    }
  }
  EXPECT_GE(partly, 5);
}

TEST_P(EveryElement, StaysAccurateAtAContrastOfAMillion) {
  // A bar with nu = 0 whose halves differ by a factor of a million in stiffness: the soft half takes all of the stretch but a
  // millionth.
  TetrahedralMesh mesh = box_mesh({4, 2, 2}, {1, 1, 1});
  part_in_two(mesh, 0.5);
  ElasticBody body = body_of(mesh, {{1e3, 0, 0}, {1e9, 0, 0}});
  hold(body, [](const Point& p) { return p[0] == 0 || p[0] == 1 ? 7 : 0; });
  const Discretisation discretisation = discretise(body, GetParam());
  const auto u = solve_with_imposed(
      discretisation,
      [](const Point& p) {
        return Point{p[0] == 1 ? 1.0 : 0.0, 0, 0};
      },
      std::vector<double>(3 * discretisation.coordinates.size(), 0.0), 1e-9);
  const double soft = 2e6 / (1e6 + 1), stiff = 2 / (1e6 + 1);
  for (std::size_t n = 0; n < discretisation.coordinates.size(); ++n) {
    const double x = discretisation.coordinates[n][0];
    // The condition, 1e8, times 1e-16, and room.
    ASSERT_NEAR(u[3 * n], x <= 0.5 ? soft * x : 1 - stiff * (1 - x), 1e-7) << x;
  }
}

TEST(CurvedEdges, LieOnASphereAndOnACircleAndLeaveABoxStraight) {
  const double radius = 2;
  const ElasticBody body = body_of(validation::shell_octant(1, radius, 6), {{1000, 0.3, 0}});
  const QuadraticMesh mesh = quadratic_mesh(body);
  EXPECT_EQ(mesh.straightened_edges, 0u);
  double worst = 0, straight = 0;
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d a(mesh.nodes[t[i]].data()), b(mesh.nodes[t[(i + 1) % 3]].data());
      if (a.norm() < radius - 1e-9 || b.norm() < radius - 1e-9) continue;
      // Across a corner of the octant neither end has the sphere's normal: that edge stays straight.
      if (a.cwiseAbs().minCoeff() == 0 && b.cwiseAbs().minCoeff() == 0 && a.cwiseMin(b).minCoeff() == 0 &&
          a.cwiseAbs().cwiseMax(b.cwiseAbs()).minCoeff() > 0)
        continue;
      worst = std::max(worst, std::abs(Eigen::Vector3d(mesh.nodes[t[3 + i]].data()).norm() - radius));
      straight = std::max(straight, radius - (a + b).norm() / 2);
    }
  EXPECT_GT(straight, 0.01);
  EXPECT_LT(worst, straight / 10) << straight;  // of fourth order in place of second
  const QuadraticMesh box = quadratic_mesh(body_of(box_mesh({3, 2, 2}, {0.3, 0.2, 0.25}, 0.2), {{1000, 0.3, 0}}));
  EXPECT_EQ(box.curved_edges, 0u);
}

std::vector<std::string> warnings_of_a_layer(int across, double poisson, Element element) {
  ElasticBody body = body_of(box_mesh({8, 8, across}, {0.08, 0.08, 0.02}), {{1000, poisson, 0}});
  hold(body, [](const Point& p) { return p[2] == 0 ? 7 : 0; });
  return element_warnings(body, element);
}

TEST(ElementWarnings, NameLockingAndLayersOfTooFewElements) {
  EXPECT_EQ(warnings_of_a_layer(3, 0.49, Element::p1_anp).size(), 1u);
  EXPECT_TRUE(warnings_of_a_layer(4, 0.49, Element::p1_anp).empty());
  EXPECT_TRUE(warnings_of_a_layer(3, 0.3, Element::p1_anp).empty());
  EXPECT_TRUE(warnings_of_a_layer(3, 0.49, Element::p2_p0).empty());
  EXPECT_EQ(warnings_of_a_layer(4, 0.49, Element::p1).size(), 1u);
  EXPECT_TRUE(warnings_of_a_layer(4, 0.4, Element::p1).empty());
}

TEST(NodalDilatation, IsTheSumOverNodesAndRegionsThatDefinesIt) {
  // K = K_dev + sum over (n, m) of kappa_m V_nm theta_nm^T theta_nm, theta_nm the mean divergence over the tetrahedra
  // of region m at node n, each weighted with its volume: the definition, written out densely.
  TetrahedralMesh mesh = box_mesh({3, 2, 2}, {0.3, 0.2, 0.25}, 0.2);
  part_in_two(mesh, 0.15);
  const ElasticBody body = body_of(mesh, {{5400, 0.499, 0}, {1e5, 0.3, 0}});
  const auto size = static_cast<Eigen::Index>(3 * body.nodes.size());
  MatrixXd expected = MatrixXd::Zero(size, size);
  std::vector<VectorXd> divergence;
  std::vector<double> volume;
  for (std::size_t t = 0; t < body.tetrahedra.size(); ++t) {
    Eigen::Matrix4d lift;  // u = a + G x on the tetrahedron: rows (1, x, y, z) of its corners, inverted
    for (int a = 0; a < 4; ++a)
      lift.row(a) << 1, body.nodes[body.tetrahedra[t][a]][0], body.nodes[body.tetrahedra[t][a]][1],
          body.nodes[body.tetrahedra[t][a]][2];
    const Eigen::Matrix4d coefficients = lift.inverse();
    volume.push_back(std::abs(lift.determinant()) / 6);
    divergence.push_back(VectorXd::Zero(size));
    MatrixXd strain = MatrixXd::Zero(9, size);  // all nine entries of the symmetric gradient
    for (int a = 0; a < 4; ++a)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const Eigen::Index dof = 3 * body.tetrahedra[t][a];
          strain(3 * i + j, dof + i) += coefficients(j + 1, a) / 2;
          strain(3 * i + j, dof + j) += coefficients(i + 1, a) / 2;
        }
    divergence.back() = strain.row(0) + strain.row(4) + strain.row(8);
    for (const int i : {0, 4, 8}) strain.row(i) -= divergence.back().transpose() / 3;
    const Material& m = body.materials[body.region[t]];
    expected += volume.back() * m.young / (1 + m.poisson) * strain.transpose() * strain;
  }
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    for (int region = 0; region < 2; ++region) {
      VectorXd sum = VectorXd::Zero(size);
      double around = 0;
      for (std::size_t t = 0; t < body.tetrahedra.size(); ++t)
        if (body.region[t] == region)
          for (const auto corner : body.tetrahedra[t])
            if (corner == static_cast<std::int32_t>(n)) sum += volume[t] / 4 * divergence[t], around += volume[t] / 4;
      const Material& m = body.materials[region];
      if (around > 0) expected += m.young / (3 * (1 - 2 * m.poisson)) / around * sum * sum.transpose();
    }
  const MatrixXd found = dense(assemble_stiffness(body, Element::p1_anp));
  EXPECT_LE((found - expected).lpNorm<Eigen::Infinity>(), 1e-13 * expected.lpNorm<Eigen::Infinity>());  // rounding
}

}  // namespace
}  // namespace palpate::tests
