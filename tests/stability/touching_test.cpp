// Organs that press one another: whether they come to rest.
#include <algorithm>

#include "tests/runtime/world/touching_world.h"
#include "tests/stability/stability_case.h"

namespace palpate::tests {
namespace {

// Of the force between the domes: the way that it goes in 60 steps at rest, over its size.
double unrest(double friction, int depth) {
  PressedDomes domes(friction, depth);
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
    for (int depth = 10; depth <= 150; depth += quick_or_long(20, 2)) worst = std::max(worst, unrest(friction, depth));
    rests.hold("way of the force in 60 steps, over the force, friction " + std::to_string(friction).substr(0, 4), worst,
               1e-9, "rounding of 60 solves; two domes of 3 kPa, 20 mm high, pressed by 0.5 to 14.5 mm");
  }
}

}  // namespace
}  // namespace palpate::tests
