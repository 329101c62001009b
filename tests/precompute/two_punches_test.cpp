// Several rigid flat discs on a block of gel: at one place they press like one, and near one another like what they cover together.
#include "tests/precompute/punched_block.h"

namespace palpate::tests {
namespace {

using Discs = Punched::Discs;

constexpr double kPoisson = 0.45;
const Eigen::Vector3d kIn(0, 0, -1e-3), kAlong(1e-3, 0, 0), kAcross(0, 1e-3, 0);

class TwoPunches : public testing::Test {
 protected:
  static Punched& block() {
    static Punched shared(flat_block(), Element::p1_anp, kPoisson, 5.5 * kEdge);
    return shared;
  }
  // On a line along x that has no pattern in common with the mesh.
  static std::array<double, 2> at(double x) { return {0.31 * kEdge + x, 0.17 * kEdge}; }
  // Of a reference for a half-space, what it is on the block: this is held at a distance R, where a half-space would move by
  // 2 a / (pi R) for a disc of radius a that is pushed by 1; about 2.5 times that share is missing (punch_test).
  static double on_block(double forces, double a) {
    const double held = 2.5 * 2 * a / (std::numbers::pi * kReach * kEdge);
    return (1 - held) / (1 / forces - held);
  }
};

// All of them are rigid and move alike, so that one more disc at the same place takes nothing from the tissue. The small distances are
// those between the points of a tool that stands for one disc: 1 % leaves room for what two discs cover more than one.
TEST_F(TwoPunches, AtOnePlacePressAndDragLikeOneWhetherTheyAreOfOneToolOrOfSeveral) {
  for (const double edges : {0.25, 0.6, 1.0, 2.0})
    for (const Eigen::Vector3d& way : {kIn, kAlong, kAcross}) {
      const double a = edges * kEdge, one = block().move({{a, {at(0)}}}, way);
      for (const double apart : {0.0, 0.01 * a}) {
        EXPECT_NEAR(block().move({{a, {at(0), at(apart)}}}, way), one, 0.01 * one) << edges;
        EXPECT_NEAR(block().move({{a, {at(0), at(apart), at(0), at(-apart)}}}, way), one, 0.01 * one) << edges;
        EXPECT_NEAR(block().move({{a, {at(0)}}, {a, {at(apart)}}}, way), one, 0.01 * one) << edges;
      }
      // A disc within a larger one is not felt, either.
      EXPECT_NEAR(block().move({{a, {at(0)}}, {a / 2, {at(0)}}}, way), one, 0.02 * one) << edges;
    }
}

// Two rigid discs on a half-space, the cells between them solved in closed form with 20 in a radius: what both need over what one
// needs, along the normal, along the line of the discs and across it. Where rigid discs overlap they are one body, which two rows
// cannot be: that leaves up to 7 % on the block.
TEST_F(TwoPunches, NearOneAnotherNeedTheForceOfTheHalfSpace) {
  struct Reference {
    double apart, normal, along, across;
  };
  double worst = 0;
  for (const Reference& r : {Reference{0.5, 1.151, 1.132, 1.169},
                             {1, 1.285, 1.248, 1.325},
                             {2, 1.507, 1.438, 1.585},
                             {4, 1.723, 1.654, 1.798}})
    for (const double edges : {0.25, 0.5, 1.0, 2.0}) {
      if (edges * (r.apart / 2 + 1) > 4.5) continue;  // beyond what is touchable
      const double a = edges * kEdge, half = r.apart * a / 2;
      for (const auto& [way, forces] : {std::pair{kIn, r.normal}, {kAlong, r.along}, {kAcross, r.across}}) {
        const double one = block().move({{a, {at(0)}}}, way), expected = on_block(forces, a);
        const double of_one_tool = block().move({{a, {at(-half), at(half)}}}, way) / one,
                     of_two = block().move({{a, {at(-half)}}, {a, {at(half)}}}, way) / one;
        EXPECT_NEAR(of_one_tool, expected, 0.08 * expected) << edges << " edges, " << r.apart << " radii apart";
        EXPECT_NEAR(of_two, of_one_tool, 1e-6 * expected);
        worst = std::max(worst, std::abs(of_one_tool / expected - 1));
      }
    }
  RecordProperty("worst", std::to_string(worst));
}

TEST_F(TwoPunches, OfDifferentRadiiNeedTheForceOfTheHalfSpace) {
  double worst = 0;
  for (const double edges : {0.5, 1.0, 2.0})
    for (const auto& [apart, forces] :
         {std::pair{0.0, 1.0}, {0.25, 1.0}, {0.5, 1.0}, {1.0, 1.079}, {1.5, 1.170}, {2.0, 1.237}, {3.0, 1.313}}) {
      if (edges * (apart / 2 + 1) > 4.5) continue;
      const double a = edges * kEdge, half = apart * a / 2, expected = on_block(forces, a),
                   one = block().move({{a, {at(-half)}}}, kIn),
                   both = block().move({{a, {at(-half)}}, {a / 2, {at(half)}}}, kIn);
      EXPECT_NEAR(both / one, expected, 0.08 * expected) << edges << " edges, " << apart << " radii apart";
      worst = std::max(worst, std::abs(both / one / expected - 1));
    }
  RecordProperty("worst", std::to_string(worst));
}

// Jaws and the discs of tools are rigid discs alike. A turn of two jaws at one place takes no more torque than that of one, either.
TEST_F(TwoPunches, AtOnePlaceJawsMoveAndTurnLikeOneDiscAndNearOneAnotherLikeTwo) {
  const auto jaws = [](double a, double x) { return Discs{a, {at(x)}, false, true}; };
  double worst = 0;
  for (const double edges : {0.25, 0.6, 1.0, 2.0})
    for (const Eigen::Vector3d& way : {kIn, kAlong, kAcross}) {
      const double a = edges * kEdge, one = block().move({{a, {at(0)}}}, way);
      // As above, 1 % for what two discs cover more than one.
      EXPECT_NEAR(block().move({jaws(a, 0)}, way), one, 0.01 * one) << edges;
      for (const double apart : {0.0, 0.01 * a}) {
        EXPECT_NEAR(block().move({jaws(a, 0), {a, {at(apart)}}}, way), one, 0.01 * one) << edges;
        EXPECT_NEAR(block().move({jaws(a, 0), jaws(a, apart)}, way), one, 0.01 * one) << edges;
      }
      const Eigen::Vector3d still(0, 0, 0), turn = 10 * way, place(at(0)[0], at(0)[1], 0);
      const double torque = block().grasp(place, a, still, turn).torque.norm();
      EXPECT_NEAR(block().grasp(place, a, still, turn, 2).torque.norm(), torque, 0.01 * torque) << edges;
    }
  // The half-space of NearOneAnotherNeedTheForceOfTheHalfSpace, along the normal and with its bound.
  for (const auto& [apart, forces] : {std::pair{0.5, 1.151}, {1.0, 1.285}, {2.0, 1.507}, {4.0, 1.723}})
    for (const double edges : {0.25, 0.5, 1.0, 2.0}) {
      if (edges * (apart / 2 + 1) > 4.5) continue;
      const double a = edges * kEdge, half = apart * a / 2, one = block().move({{a, {at(-half)}}}, kIn),
                   expected = on_block(forces, a);
      for (const double found : {block().move({jaws(a, -half), {a, {at(half)}}}, kIn) / one,
                                 block().move({jaws(a, -half), jaws(a, half)}, kIn) / one}) {
        EXPECT_NEAR(found, expected, 0.08 * expected) << edges << " edges, " << apart << " radii apart";
        worst = std::max(worst, std::abs(found / expected - 1));
      }
    }
  RecordProperty("worst", std::to_string(worst));
}

// Also where the surface bulges or is hollow, which changes what a dragged disc has beyond the mesh.
TEST(TwoPunchesOnACurvedTop, AtOnePlaceDragLikeOne) {
  for (const double curvature : {40.0, -40.0}) {
    constexpr double kWidth = 0.025;
    TetrahedralMesh mesh = graded_block({0, .01, .02, .03, .04, .055, .075, .1});
    for (auto& p : mesh.nodes) {
      const double bell = std::exp(-(p[0] * p[0] + p[1] * p[1]) / (2 * kWidth * kWidth));
      p[2] += curvature * kWidth * kWidth * bell * (1 + p[2] / 0.1);
    }
    Punched block(mesh, Element::p1, 0.3, 0.021);
    for (const double a : {0.0025, 0.006}) {
      const double one = block.drag(a);
      EXPECT_NEAR(block.drag(a, 2), one, 0.01 * one) << curvature;
      EXPECT_NEAR(block.drag(a, 4), one, 0.01 * one) << curvature;
    }
  }
}

// Discs that pinch a lobe of two elements from both sides: what the coarse mesh does not resolve belongs to each of them alone. What is
// left is the mesh's own error between the faces.
TEST(TwoPunchesOnAThinLobe, FromOppositeFacesPinchAsOnAResolvedMesh) {
  constexpr double kThick = 0.01;
  Punched coarse(graded_slab({0, .005, .010, .015, .022, .035, .06}, kThick, 2), Element::p1_anp, kPoisson, 0.011,
                 Punched::Bottom::bare),
      fine(graded_slab({0, .00125, .0025, .00375, .005, .00625, .008, .011, .016, .024, .038, .06}, kThick, 8),
           Element::p1_anp, kPoisson, 0.0065, Punched::Bottom::bare);
  double worst = 0;
  const std::array<double, 2> place = {0.0003, 0.0002};
  for (const double a : {0.0015, 0.0025, 0.004})
    for (const Eigen::Vector3d& way : {kIn, kAlong}) {
      const std::vector<Discs> both = {{a, {place}}, {a, {place}, true}};
      const double expected = fine.move(both, way), found = coarse.move(both, way);
      EXPECT_NEAR(found, expected, 0.06 * expected) << a;
      worst = std::max(worst, std::abs(found / expected - 1));
    }
  RecordProperty("worst", std::to_string(worst));
}

}  // namespace
}  // namespace palpate::tests
