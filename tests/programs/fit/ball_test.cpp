// A ball against closed forms: Hertz on a half-space at small depths, Sneddon's rigid ball at large ones, and a soft rest in series.
#include "programs/fit/ball.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate::fit {
namespace {

constexpr double kModulus = 6000, kRadius = 0.005;  // Pa, m

BallPlace half_space() {
  return {kModulus, 2 * kModulus * kRadius};
}

TEST(FitBall, IsHertzsAtSmallDepths) {
  for (const double share : {1e-7, 1e-5, 1e-3}) {
    const double depth = share * kRadius;
    const double hertz = 4.0 / 3 * kModulus * std::sqrt(kRadius * depth);  // over the depth
    // A ball is flatter than Hertz's paraboloid by a term of (a / R)^2 = d / R.
    EXPECT_NEAR(ball_stiffness(half_space(), kRadius, depth) / hertz, 1, share + 1e-6);
  }
}

TEST(FitBall, IsSneddonsAtLargeDepths) {
  // The contact radius a = R / 2: depth R / 4 ln 3, force E* R^2 (5 / 8 ln 3 - 1 / 2).
  const double depth = kRadius / 4 * std::log(3.0);
  const double force = kModulus * kRadius * kRadius * (0.625 * std::log(3.0) - 0.5);
  EXPECT_NEAR(ball_stiffness(half_space(), kRadius, depth) * depth / force, 1, 1e-12);
}

TEST(FitBall, ARestInSeriesAddsItsDepthAtTheSameForce) {
  const double local = 1e-3, force = ball_stiffness(half_space(), kRadius, local) * local;
  for (const double rest : {0.02, -0.004}) {  // m/N; below 0: a thin layer on a rigid ground
    const BallPlace place{kModulus, 1 / (1 / half_space().disc_stiffness + rest)};
    const double depth = local + rest * force;
    EXPECT_NEAR(ball_stiffness(place, kRadius, depth) * depth / force, 1, 1e-9);
  }
}

TEST(FitBall, IsProportionalToTheModulusAtEveryDepth) {
  for (const double depth : {1e-5, 1e-3, 4e-3})
    EXPECT_NEAR(
        ball_stiffness({3 * kModulus, 3 * 40.0}, kRadius, depth) / ball_stiffness({kModulus, 40.0}, kRadius, depth), 3,
        1e-9);
}

TEST(FitBall, EndsAtTheEquator) {
  EXPECT_FALSE(std::isnan(ball_stiffness(half_space(), kRadius, 3 * kRadius)));
  EXPECT_TRUE(std::isnan(ball_stiffness(half_space(), kRadius, 20 * kRadius)));
}

}  // namespace
}  // namespace palpate::fit
