// What the mesh does not resolve between two discs: no cluster of discs gives way to a force of its own that costs no work, and like
// discs at one place share all but a small part of it.
#include "runtime/contact/disc_compliance.h"

#include <Eigen/Eigenvalues>
#include <random>

#include "runtime/contact/contact_patch.h"
#include "tests/runtime/touched_box.h"

namespace palpate::tests {
namespace {

using Random = std::mt19937;
double between(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
Vec3 any_direction(Random& random) {
  for (;;) {
    const Vec3 v = {between(random, -1, 1), between(random, -1, 1), between(random, -1, 1)};
    if (const double l = length(v); l > 0.1 && l < 1) return (1 / l) * v;
  }
}
Eigen::Matrix3d matrix(const Mat3& m) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&m.m[0][0]);
}

// A disc with any root of a positive definite tangential compliance, near `place`, in x, y and z.
ContactDisc any_disc(Random& random, double spread, Vec3 outward) {
  ContactDisc disc;
  disc.radius = std::pow(10, between(random, -3, -1.6));
  const double spacing = between(random, 0.002, 0.01), wide = std::max(disc.radius, 0.75 * spacing);
  disc.wide[0] = wide + 0.34 * spacing, disc.wide[1] = wide + 0.46 * spacing;
  disc.place = spread * any_direction(random);
  disc.outward = unit_or_zero(outward + 0.7 * any_direction(random));
  disc.normal_root = std::sqrt(between(random, 1e-4, 1e-3)) * disc.outward;
  const Vec3 u = across(disc.outward, {}), v = cross(disc.outward, u);
  for (const auto& [direction, size] : {std::pair{u, between(random, 0.01, 0.03)}, {v, between(random, 0.01, 0.03)}})
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) disc.tangent_root.m[i][j] += size * direction[i] * direction[j];
  return disc;
}

void expect_positive_semidefinite(const std::vector<ContactDisc>& discs, int cluster) {
  const auto size = static_cast<Eigen::Index>(3 * discs.size());
  Eigen::MatrixXd l(size, size);
  for (std::size_t i = 0; i < discs.size(); ++i)
    for (std::size_t j = 0; j < discs.size(); ++j)
      l.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j)) =
          matrix(compliance_between(discs[i], discs[j]));
  EXPECT_EQ((l - l.transpose()).norm(), 0);
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(l).eigenvalues().minCoeff();
  EXPECT_GT(least, -1e-13 * l.norm()) << cluster;  // rounding
}

TEST(ComplianceBetweenDiscs, IsPositiveSemidefiniteForAnyRadiiSpacingsPlacesAndNormals) {
  Random random(5);
  for (int cluster = 0; cluster < 100; ++cluster) {
    const double spread = std::pow(10, between(random, -4, -1.3));
    const Vec3 outward = (cluster % 3 == 0 ? 0.0 : 1.0) * any_direction(random);
    std::vector<ContactDisc> discs(2 + random() % 19);
    for (ContactDisc& disc : discs) disc = any_disc(random, spread, outward);
    expect_positive_semidefinite(discs, cluster);
  }
}

// Of the gradients under jaws, together with means.
TEST(ComplianceBetweenDiscs, IsPositiveSemidefiniteWithTheGradientsUnderJaws) {
  Random random(8);
  for (int cluster = 0; cluster < 100; ++cluster) {
    const double spread = std::pow(10, between(random, -4, -1.3));
    const Vec3 outward = any_direction(random);
    std::vector<ContactDisc> discs;
    for (std::size_t jaws = 1 + random() % 6; jaws > 0; --jaws) {
      const ContactDisc mean = any_disc(random, spread, outward);
      const Vec3 e = across(mean.outward, any_direction(random));
      discs.insert(discs.end(), 3, mean);
      (discs.end() - 2)->gradient = e, (discs.end() - 1)->gradient = cross(mean.outward, e);
    }
    expect_positive_semidefinite(discs, cluster);
    // Jaws share nothing between their own parts.
    EXPECT_EQ(matrix(compliance_between(discs[0], discs[1])).norm(), 0);
    EXPECT_LT(matrix(compliance_between(discs[1], discs[2])).norm(),
              1e-15 * matrix(compliance_between(discs[1], discs[1])).norm());
  }
}

TEST(ComplianceBetweenDiscs, FallsWithTheDistanceAndIsNothingBetweenOppositeFaces) {
  Random random(6);
  ContactDisc a = any_disc(random, 0, {0, 0, 1}), b = a;
  a.radius = b.radius = 0.002;
  double before = INFINITY;
  for (double d = 0; d < 0.05; d += 0.001) {
    b.place = a.place + d * across(a.outward, {});
    const double now = matrix(compliance_between(a, b)).norm();
    EXPECT_LT(now, before) << d;
    before = now;
  }
  const double at_one_place = matrix(compliance_between(a, a)).norm();
  EXPECT_LT(before, 0.005 * at_one_place);
  b = a, b.outward = -1 * a.outward;
  EXPECT_LT(matrix(compliance_between(a, b)).norm(), 1e-12 * at_one_place);
}

TEST(ComplianceBetweenDiscs, TurnsWithTheFramesOfTheirConstraintsAndWithTheSideOfALink) {
  Random random(7);
  const ContactDisc a = any_disc(random, 0.002, {0, 0, 1}), b = any_disc(random, 0.002, {0, 0, 1});
  const Vec3 n = any_direction(random), t = across(n, {});
  Mat3 frame;
  store3(n, frame.m[0]), store3(t, frame.m[1]), store3(cross(n, t), frame.m[2]);
  const Eigen::Matrix3d along = matrix(compliance_between(in_frame(a, frame), b)),
                        expected = matrix(frame) * matrix(compliance_between(a, b));
  EXPECT_LT((along - expected).norm(), 1e-14 * expected.norm() + 1e-18);
  EXPECT_EQ((matrix(compliance_between(a, opposite(b))) + matrix(compliance_between(a, b))).norm(), 0);
}

}  // namespace
}  // namespace palpate::tests
