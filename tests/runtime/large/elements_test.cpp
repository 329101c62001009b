// The energy of a whole body: its forces, its stiffness at rest, and single precision.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numeric>

#include "precompute/elements/discretisation.h"
#include "studies/bodies/bodies.h"
#include "studies/hyperelastic/large_body.h"
#include "studies/hyperelastic/large_reference.h"
#include "tests/runtime/large/soft_supports.h"

namespace palpate::tests {
namespace {

using Eigen::VectorXd;

// Two materials, a neo-Hookean and an exponential one, whose border crosses the body.
ElasticBody two_materials(double poisson) {
  TetrahedralMesh mesh = box_mesh({4, 3, 3}, {0.10, 0.08, 0.06}, 0.2);
  mesh.region_names = {"soft", "stiff"};
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) mesh.region[t] = t % 5 == 0;
  ElasticBody body = body_of(mesh, {{5400, poisson, 0}, {60000, 0.3, 0}});
  hold(body, [](const auto& p) { return p[0] == 0 ? 7 : 0; });
  return body;
}

// The same on a foundation beside the held face, with springs to the world, along an axis, and between nodes that no tetrahedron
// couples.
ElasticBody softly_supported(double poisson) {
  ElasticBody body = two_materials(poisson);
  add_foundation(body, 3e5, 1e5, [](const auto& p) { return p[1] == 0; });
  add_foundation(body, 0, 2e5, [](const auto& p) { return p[1] == 0 && p[0] > 0.04; });
  const auto last = static_cast<std::int32_t>(body.nodes.size()) - 1;
  body.springs.push_back({"mixed", {{0, Spring::kWorld, 20}, {5, last, 40, {0.6, 0, 0.8}}, {7, 2, 30}}});
  return body;
}

// Of the two materials.
const std::vector<LawForm> kForms[] = {{0, 0},
                                       {0, 2.5},
                                       {LawForm::yeoh(-300, 400), LawForm::yeoh(2000, 0)},
                                       {LawForm::ogden(4.5), LawForm::ogden(-5, 0.3, 12)}};

constexpr Element kElements[] = {Element::p1, Element::p1_anp, Element::p1_ang};
std::vector<std::pair<Element, bool>> every_element_and_support() {
  std::vector<std::pair<Element, bool>> all;
  for (const Element element : kElements)
    for (const bool soft : {false, true}) all.emplace_back(element, soft);
  return all;
}

VectorXd some_displacement(const LargeReference& reference, double size) {
  VectorXd u(reference.dofs());
  for (Eigen::Index i = 0; i < u.size(); ++i) u[i] = size * std::sin(12.9 * static_cast<double>(i) + 0.4);
  return u;
}

TEST(LargeElements, ForcesAreTheDerivativeOfTheEnergyAndTheTangentThatOfTheForces) {
  for (const Element element : kElements)
    for (const std::vector<LawForm>& forms : kForms) {
      const LargeBody body(element == Element::p1 ? two_materials(0.45) : softly_supported(0.45), element, forms);
      const LargeReference reference(body.get());
      const VectorXd u = some_displacement(reference, 0.002), way = some_displacement(reference, 1).reverse();
      VectorXd force, ahead_force, behind_force;
      double least = 0;
      ASSERT_TRUE(std::isfinite(reference.energy(u, &force, &least)));
      EXPECT_LT(least, 0.8) << "not a large strain";
      constexpr double h = 1e-8;
      const double ahead = reference.energy(u + h * way, &ahead_force),
                   behind = reference.energy(u - h * way, &behind_force);
      // Central differences: rounding of the energy 1e-16 / h, and the third derivative times h^2.
      EXPECT_NEAR((ahead - behind) / (2 * h) / force.dot(way), 1, 1e-5);
      const VectorXd change = (ahead_force - behind_force) / (2 * h), expected = reference.tangent(u) * way;
      EXPECT_LE((change - expected).norm(), 1e-6 * expected.norm());
    }
}

TEST(LargeElements, AtRestTheTangentIsTheStiffnessOfThePrecomputation) {
  for (const double poisson : {0.3, 0.45, 0.49})
    for (const auto& [element, soft] : every_element_and_support()) {
      const ElasticBody elastic = soft ? softly_supported(poisson) : two_materials(poisson);
      const LargeBody body(elastic, element, {0, 2.5});
      const LargeReference reference(body.get());
      const BlockMatrix k = discretise(elastic, element).stiffness;
      const Eigen::MatrixXd tangent = reference.tangent(VectorXd::Zero(reference.dofs()));
      Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(tangent.rows(), tangent.cols());
      for (std::int32_t row = 0; row < k.rows; ++row)
        for (auto at = k.first[row]; at < k.first[row + 1]; ++at)
          for (int i = 0; i < 9; ++i) expected(3 * row + i / 3, 3 * k.column[at] + i % 3) = k.block[at][i];
      // Rounding of a sum of some 50 terms.
      EXPECT_LE((tangent - expected).cwiseAbs().maxCoeff(), 1e-13 * expected.cwiseAbs().maxCoeff())
          << poisson << name_of(element);
    }
}

TEST(LargeElements, EightLanesOfSinglePrecisionGiveTheSameForces) {
  for (const Element element : kElements)
    for (const double size : {1e-6, 1e-4, 0.002}) {
      const LargeBody body(two_materials(0.45), element, {0, 2.5});
      const LargeReference reference(body.get());
      SceneMemory memory{palpate_allocator{}};
      ElementLanes<EightFloats> lanes;
      std::vector<std::int32_t> place(static_cast<std::size_t>(body.get().node_count));
      std::iota(place.begin(), place.end(), 0);
      ASSERT_TRUE(lanes.create(memory, body.get(), place.data(), body.get().node_count));
      const Eigen::VectorXf u = some_displacement(reference, size).cast<float>();
      Eigen::VectorXf force(u.size());
      VectorXd expected;
      double least = 0;
      const double energy = reference.energy(u.cast<double>(), &expected, &least);
      const auto found = lanes.evaluate(u.data(), force.data());
      // Differences of displacements within a tetrahedron, products and a sum of some 24 tetrahedra, each rounded by 6e-8.
      EXPECT_NEAR(found.energy / energy, 1, 2e-6) << size;
      EXPECT_NEAR(found.least_volume, least, 1e-6);
      EXPECT_LE((force.cast<double>() - expected).norm(), 2e-6 * expected.norm()) << size;
      memory.release_all();
    }
}

TEST(LargeElements, TheReferenceFindsUniaxialCompressionInClosedForm) {
  // A block that slides on three faces and is pressed to 70 % of its height: F = diag(a, a, 0.7), and a makes the lateral stress of
  // the compressible neo-Hookean law zero: mu (a^2 - 1) + lambda ln(0.7 a^2) = 0.
  ElasticBody elastic = body_of(box_mesh({3, 3, 3}, {0.03, 0.03, 0.03}, 0.2), {{5400, 0.45, 0}});
  hold(elastic, [](const auto& p) { return (p[0] == 0 ? 1 : 0) | (p[1] == 0 ? 2 : 0) | (p[2] == 0 ? 4 : 0); });
  const LargeBody body(elastic, false);
  const LargeReference reference(body.get());
  std::vector<std::int32_t> top;
  for (std::int32_t n = 0; n < body.get().node_count; ++n)
    if (elastic.nodes[n][2] == 0.03) top.push_back(n);
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(top.size()), reference.dofs());
  for (std::size_t i = 0; i < top.size(); ++i) rows(static_cast<Eigen::Index>(i), 3 * top[i] + 2) = 1;
  VectorXd u = VectorXd::Zero(reference.dofs());
  VectorXd force;
  for (const double depth : {0.003, 0.006, 0.009})
    force = reference.solve(rows, VectorXd::Constant(rows.rows(), -depth), &u);
  const TissueLaw law = body.get().laws[0];
  const double lambda = law.bulk - 2 * law.shear / 3;
  double wide = 1, narrow = 2;  // a^2
  for (int i = 0; i < 60; ++i) {
    const double a2 = (wide + narrow) / 2;
    (law.shear * (a2 - 1) + lambda * std::log(0.7 * a2) < 0 ? wide : narrow) = a2;
  }
  const double pressed = law.shear * (0.7 - 1 / 0.7) + lambda * std::log(0.7 * wide) / 0.7;
  EXPECT_NEAR(force.sum() / (pressed * 0.03 * 0.03), 1, 1e-8);  // Newton's tolerance
}

}  // namespace
}  // namespace palpate::tests
