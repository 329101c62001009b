#include "programs/player/tool_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace palpate {
namespace {

using Vector = SceneConfig::Vector;

SceneConfig::Capsule capsule(int samples, Vector axis = {0, 0, 1}) {
  return {0.004, 0.03, axis, samples};
}

double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

TEST(Capsule, SamplesLieOnItsSkinFromTipToTip) {
  const double s = 1 / std::sqrt(3.0);
  for (const Vector& axis : {Vector{0, 0, 1}, Vector{1, 0, 0}, Vector{s, -s, s}}) {
    const auto points = sample_capsule(capsule(50, axis));
    ASSERT_EQ(points.size(), 50u);
    for (const auto& p : points) {
      const double along = std::clamp(dot(p, axis), 0.0, 0.03);
      const double distance = std::hypot(p[0] - along * axis[0], p[1] - along * axis[1], p[2] - along * axis[2]);
      EXPECT_NEAR(distance, 0.004, 1e-15);  // a few roundings of numbers of 0.03
    }
    EXPECT_NEAR(dot(points.front(), axis), -0.004, 1e-15);
    EXPECT_NEAR(dot(points.back(), axis), 0.034, 1e-15);
  }
}

TEST(Capsule, SamplesShareTheSkinEvenly) {
  // Of the skin's area, 2 pi r L belongs to the cylinder and 4 pi r^2 to the caps.
  const int samples = 1000;
  int on_cylinder = 0, on_upper_half = 0;
  for (const auto& p : sample_capsule(capsule(samples))) {
    on_cylinder += p[2] > 0 && p[2] < 0.03;
    on_upper_half += p[1] > 0;
  }
  EXPECT_NEAR(on_cylinder, samples * 0.03 / (0.03 + 2 * 0.004), 2);  // one sample at each end of the interval
  EXPECT_NEAR(on_upper_half, samples / 2, 10);                       // a golden-angle spiral is even to its logarithm
}

TEST(Capsule, OfNoLengthIsASphere) {
  for (const auto& p : sample_capsule({0.01, 0, {0, 1, 0}, 20}))
    EXPECT_NEAR(std::hypot(p[0], p[1], p[2]), 0.01, 1e-16 * 100);
}

TEST(ToolPoints, AreThoseListedThenTheCapsules) {
  SceneConfig::Tool tool;
  tool.points = {{1, 2, 3}};
  EXPECT_EQ(tool_points(tool).size(), 1u);
  tool.capsule = capsule(5);
  const auto points = tool_points(tool);
  ASSERT_EQ(points.size(), 6u);
  EXPECT_EQ(points[0], (Vector{1, 2, 3}));
  EXPECT_EQ(points[1], sample_capsule(capsule(5))[0]);
}

TEST(Path, IsStraightBetweenKeyFramesAndRestsOutsideThem) {
  const std::vector<SceneConfig::KeyFrame> path = {{1, {0, 0, 0}}, {2, {4, 0, 2}}, {4, {4, 8, 2}}};
  EXPECT_EQ(position_at(path, 0), (Vector{0, 0, 0}));
  EXPECT_EQ(position_at(path, 1), (Vector{0, 0, 0}));
  EXPECT_EQ(position_at(path, 1.25), (Vector{1, 0, 0.5}));
  EXPECT_EQ(position_at(path, 2), (Vector{4, 0, 2}));
  EXPECT_EQ(position_at(path, 3), (Vector{4, 4, 2}));
  EXPECT_EQ(position_at(path, 9), (Vector{4, 8, 2}));
}

}  // namespace
}  // namespace palpate
