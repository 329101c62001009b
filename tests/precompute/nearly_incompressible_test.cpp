// The elements near nu = 1/2: a thick sphere under pressure, a bonded punch on deep and thin layers, a cantilever. The
// bounds are the figures of ELEMENTS.md with some room.
#include "studies/validation/cases.h"
#include "studies/validation/solved_body.h"
#include "tests/precompute/support.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using validation::Point;

constexpr double kYoung = 1000;

// Relative error of the displacement of the thick sphere 1 <= r <= 2 under unit pressure inside, in the 2-norm.
double sphere_error(Element element, double poisson, int n) {
  return validation::thick_sphere().measure({element, poisson, {}}, n).quantities.at(0).error;
}

TEST(NearlyIncompressible, ThickSphereUnderPressure) {
  // 2,601 vertices, and 405 for p2-p0. p1 locks; the other elements have the same errors at nu = .4999 as at .3.
  EXPECT_LT(sphere_error(Element::p1, 0.3, 16), 0.017);
  EXPECT_GT(sphere_error(Element::p1, 0.4999, 16), 0.2);
  for (const double poisson : {0.3, 0.49, 0.4999}) {
    EXPECT_LT(sphere_error(Element::p1_anp, poisson, 16), 0.0135) << poisson;
    EXPECT_LT(sphere_error(Element::p2_p0, poisson, 8), 0.003) << poisson;
  }
}

// Force of a rigid square bonded to the top of a layer that is bonded to the ground, over half-width 1; the layer is
// 2 x 2 x depth (a quarter of it by symmetry, its far sides free).
double punch_force(Element element, double poisson, double depth, std::array<int, 3> cells) {
  ElasticBody body = body_of(box_mesh(cells, {2, 2, depth}), {{kYoung, poisson, 0}});
  const auto under = [depth](const Point& p) { return p[2] == depth && p[0] <= 1 + 1e-9 && p[1] <= 1 + 1e-9; };
  hold(body, [&](const Point& p) { return p[2] == 0 || under(p) ? 7 : (p[0] == 0 ? 1 : 0) | (p[1] == 0 ? 2 : 0); });
  const auto discrete = validation::discretise_body(std::move(body), element);
  const auto answer = validation::solve(discrete, [&](const Vector3d& x) {
    return Vector3d(0, 0, under({x[0], x[1], x[2]}) ? -0.01 : 0);
  });
  return -validation::total_force(discrete, answer, under)[2];
}

TEST(NearlyIncompressible, BondedPunchOnADeepBlock) {
  // Four elements under half the width of the punch. The pressure is infinite at its edge, so that every element is too
  // stiff there.
  for (const double poisson : {0.3, 0.49, 0.4999}) {
    const double reference = punch_force(Element::p2_p0, poisson, 2, {10, 10, 10});
    EXPECT_NEAR(punch_force(Element::p2_p0, poisson, 2, {8, 8, 8}) / reference, 1.0, 0.01) << poisson;
    EXPECT_GT(punch_force(Element::p1_anp, poisson, 2, {8, 8, 8}) / reference, 1.0) << poisson;
    EXPECT_LT(punch_force(Element::p1_anp, poisson, 2, {8, 8, 8}) / reference, 1.18) << poisson;
  }
  const double reference = punch_force(Element::p2_p0, 0.4999, 2, {8, 8, 8});
  EXPECT_GT(punch_force(Element::p1, 0.4999, 2, {8, 8, 8}) / reference, 1.7);
}

TEST(NearlyIncompressible, BondedPunchOnAThinLayerAsksForFourElementsAcross) {
  // A layer an eighth as deep as the punch is wide. p1-anp locks with one or two elements across the layer and is still
  // 60 % too stiff with four: this is why palpate-precompute warns. p2-p0 with two elements is within 6 %.
  const double reference = punch_force(Element::p2_p0, 0.4999, 0.25, {16, 16, 3});
  const auto averaged = [&](int across) {
    return punch_force(Element::p1_anp, 0.4999, 0.25, {8, 8, across}) / reference;
  };
  EXPECT_GT(averaged(1), 20);
  EXPECT_GT(averaged(2), 3);
  EXPECT_LT(averaged(4), 1.7);
  EXPECT_NEAR(punch_force(Element::p2_p0, 0.4999, 0.25, {8, 8, 2}) / reference, 1.0, 0.08);
  const double compressible = punch_force(Element::p2_p0, 0.3, 0.25, {16, 16, 3});
  EXPECT_LT(punch_force(Element::p1_anp, 0.3, 0.25, {8, 8, 4}) / compressible, 1.15);
}

// Tip deflection of a 10 x 1 x 1 cantilever over Timoshenko's.
double tip(Element element, double poisson, int n) {
  const auto found = validation::cantilever().measure({element, poisson, {}}, n).quantities.at(0);
  return found.value / found.exact;
}

TEST(NearlyIncompressible, Cantilever) {
  // p1-anp is too stiff in bending, less so with more elements across. p2-p0 is too soft with one element across and
  // within 6 % with two.
  for (const double poisson : {0.3, 0.49, 0.4999}) {
    const double three = tip(Element::p1_anp, poisson, 3), five = tip(Element::p1_anp, poisson, 5);
    EXPECT_GT(three, 0.70) << poisson;
    EXPECT_LT(three, five) << poisson;
    EXPECT_GT(five, 0.84) << poisson;
    EXPECT_LT(five, 1.0) << poisson;
    EXPECT_NEAR(tip(Element::p2_p0, poisson, 2), 1.0, 0.06) << poisson;
  }
  EXPECT_LT(tip(Element::p1, 0.4999, 4), 0.05);
}

}  // namespace
}  // namespace palpate::tests
