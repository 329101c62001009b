// The interpolation between bundles.
#include "programs/fit/stiffness_model.h"

#include <gmock/gmock.h>

namespace palpate::fit {
namespace {

// Of a disc on a half-space, over E: 2 a / (1 - nu^2); its compliance is quadratic in nu.
double half_space(double radius, double nu) {
  return 2 * radius / (1 - nu * nu);
}

StiffnessModel half_spaces(const std::vector<double>& values) {
  std::vector<std::vector<double>> stiffness;
  for (const double nu : values) stiffness.push_back({half_space(0.005, nu), half_space(0.01, nu)});
  return {values, stiffness};
}

TEST(StiffnessModel, IsExactForTheDiscOnAHalfSpaceBetweenThreeBundlesOrMore) {
  for (const std::vector<double>& values : {std::vector{0.2, 0.35, 0.49}, {0.0, 0.2, 0.3, 0.45, 0.49}}) {
    const StiffnessModel model = half_spaces(values);
    for (double nu = values.front(); nu <= values.back(); nu += 0.013) {
      // A parabola through points of a parabola: rounding alone, with factors of at most 100 from the differences.
      EXPECT_NEAR(model.stiffness(1, nu), half_space(0.01, nu), 1e-13) << nu;
      // The difference quotient over 2e-4 of the range: its error is f''' step^2 / 6 within, f'' step / 2 at the ends.
      const double slope = half_space(0.01, nu) * 2 * nu / (1 - nu * nu);
      EXPECT_NEAR(model.slope(1, nu), slope, 1e-5) << nu;
    }
    EXPECT_LT(model.error_without_one(), values.size() > 3 ? 1e-13 : 0.1);
  }
}

TEST(StiffnessModel, IsAStraightLineInTheComplianceBetweenTwoBundles) {
  const StiffnessModel model({1, 3}, {{2.0}, {4.0}});
  EXPECT_DOUBLE_EQ(model.stiffness(0, 2), 1 / (0.5 * (1 / 2.0 + 1 / 4.0)));
  EXPECT_EQ(model.error_without_one(), 0);
}

TEST(StiffnessModel, MeetsItsBundlesAndHasNoJumpThere) {
  const StiffnessModel model({0, 1, 2, 4}, {{1.0}, {3.0}, {2.0}, {5.0}});
  const double values[] = {1, 3, 2, 5};
  for (int b = 0; b < 4; ++b) {
    const double at = model.parameter()[b];
    EXPECT_NEAR(model.stiffness(0, at), values[b], 1e-12);
    if (b == 0 || b == 3) continue;
    // The slopes of both sides, over 1e-6: they differ by the second derivative, at most 10, times that.
    const double before = (model.stiffness(0, at) - model.stiffness(0, at - 1e-6)) / 1e-6;
    const double after = (model.stiffness(0, at + 1e-6) - model.stiffness(0, at)) / 1e-6;
    EXPECT_NEAR(before, after, 1e-4);
  }
}

TEST(StiffnessModel, TellsHowDifferentlyTheBundlesChangeTheSpots) {
  EXPECT_NEAR(half_spaces({0.2, 0.4}).spread_between_spots(), 0, 1e-12);  // both spots by the same factor
  EXPECT_NEAR(StiffnessModel({0, 1}, {{1, 1}, {2, 3}}).spread_between_spots(), 0.5, 1e-12);
}

}  // namespace
}  // namespace palpate::fit
