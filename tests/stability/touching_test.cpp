// Organs that press one another: whether they come to rest.
#include <algorithm>

#include "tests/runtime/world/touching_world.h"
#include "tests/stability/stability_case.h"

namespace palpate::tests {
namespace {

// Of the force between the domes: the way that it goes in 60 steps at rest, over its size.
double unrest(PressedDomes domes) {
  for (int s = 0; s < 200; ++s) domes.step();
  Eigen::Vector3d last = domes.pressed(0);
  const double size = last.norm();
  double way = 0;
  for (int s = 0; s < 60; ++s) {
    domes.step();
    way += (domes.pressed(0) - last).norm(), last = domes.pressed(0);
  }
  return size > 0 ? way / size : INFINITY;
}

TEST(StabilityTouching, PressedOrgansComeToRestAtEveryDepth) {
  StabilityCase rests(
      "Contact forces move the vertices of pairs along the surface, and the places of the pairs decide the direction "
      "of the forces. "
      "Where tissue is soft and bent, places may go to and fro for ever, at one depth and not at another");
  for (const double friction : {0.0, 0.02, 0.05, 0.1, 0.3, 1.0}) {
    double worst = 0;
    for (int depth = 10; depth <= 150; depth += quick_or_long(20, 2))
      worst = std::max(worst, unrest(PressedDomes(friction, depth)));
    rests.hold("way of the force in 60 steps, over the force, friction " + std::to_string(friction).substr(0, 4), worst,
               1e-9, "rounding of 60 solves; two domes of 3 kPa, 20 mm high, pressed by 0.5 to 14.5 mm");
  }
}

TEST(StabilityTouching, AStiffTipInASoftOneComesToRest) {
  const TouchedBody soft(dome_of(0.01, 4, 0.006, 3000)), stiff(dome_of(0.01, 4, 0.006, 30000));
  StabilityCase rests(
      "Two tips are bent by a radius that is less than their depth: a place that goes all the way sends its vertex to "
      "the other side of the tip, and back");
  double worst = 0;
  for (int depth = 90; depth <= 150; depth += quick_or_long(5, 1))
    worst = std::max(worst, unrest(PressedDomes(soft, stiff, {0.001, 0.0007}, 0, depth)));
  rests.hold("way of the force in 60 steps, over the force", worst, 1e-9,
             "rounding of 60 solves; tips of 3 and 30 kPa with a radius of 6 mm, pressed by 8.5 to 14.5 mm");
}

}  // namespace
}  // namespace palpate::tests
