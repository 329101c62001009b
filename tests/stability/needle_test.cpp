// A needle that is bent, drawn aside and driven ahead by more than any hand does, beside grips that hold the tissue.
#include <numbers>

#include "tests/runtime/touched_box.h"
#include "tests/stability/held_places.h"
#include "tests/stability/stability_case.h"
#include "tests/support/box_corridor.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

constexpr double kFriction = 20, kCutting = 0.1, kSpacing = 2e-3, kRadius = 0.5e-3;

DenseBody pierced_body() {
  return dense_box({.cells = {6, 6, 5}, .poisson = 0.49});
}
const TouchedBody& box() {
  static const TouchedBody shared(pierced_body(),
                                  [](BundleParts& parts) { add_whole_corridor(parts, pierced_body()); });
  return shared;
}

FacePlace entry_place() {
  return face_place(box(), {1, 0, 0}, {0.06, 0.026, 0.021});
}
Vector3d entry() {
  static const Vector3d place = box().place(entry_place().triangle, Vector3d::Constant(1.0 / 3));
  return place;
}

// Several places of the needle lie in each tetrahedron, so that its rows nearly depend on one another.
struct Piercing : TouchedScene {
  Piercing() : TouchedScene(box(), def()) {
    const FacePlace place = entry_place();
    needle.triangle = place.triangle, needle.radius = kRadius, needle.spacing = kSpacing;
    std::copy(place.barycentric, place.barycentric + 3, needle.barycentric);
    needle.friction = kFriction, needle.cutting_force = kCutting, needle.puncture_force = 2 * kCutting;
    for (double depth = -1e-3; depth < 0.05; depth += 5e-4) step({-1, 0, 0}, entry() - depth * Vector3d::UnitX());
  }
  static SceneDef def() {
    SceneDef made = unlimited_def(PALPATE_COLLISION_OFF, PALPATE_CONTACT_POINT, PALPATE_SHAPE_VOLUME);
    made.torque_limit = made.torque_slew = INFINITY, made.needles.needles = 1;
    return made;
  }
  void step(Vector3d direction, Vector3d tip) {
    Eigen::Map<Vector3d>(needle.tip) = tip, Eigen::Map<Vector3d>(needle.direction) = direction.normalized();
    palpate_tool tool = palpate_default_tool();
    tool.id = 1, tool.parts = &needle.part, tool.has_torque = 1;
    touch({tool});
  }
  double farthest() {
    double most = 0;
    for (const float u : shape())
      most = std::isfinite(u) ? std::max(most, std::fabs(static_cast<double>(u))) : INFINITY;
    return most;
  }

  palpate_needle needle = palpate_default_needle();
};

TEST(StabilityNeedle, BentBy45DegreesInOneStep) {
  StabilityCase stability(
      "A needle that turns by 45 degrees in a step asks places of one tetrahedron for displacements that no "
      "deformation has.");
  double most_force = 0, most_ratio = 0, most_tip = 0, most_shaft = 0, unsound = 0;
  for (const double degrees : {1.0, 15.0, 30.0, 45.0}) {
    Piercing piercing;
    const Vector3d tip(piercing.needle.tip);
    const double before = piercing.farthest();  // by friction and cutting
    const double angle = degrees * std::numbers::pi / 180, depth = entry()[0] - tip[0];
    // About where it entered: the tip goes aside by up to 35 mm.
    const Vector3d direction(-std::cos(angle), std::sin(angle), 0);
    for (int hold = 0; hold < 5; ++hold) {
      piercing.step(direction, entry() + depth * direction);
      const palpate_needle_state& state = *palpate_scene_needle_state(piercing.scene.get(), 1);
      most_force = std::max(most_force, piercing.force().allFinite() ? piercing.force().norm() : INFINITY);
      most_ratio = std::max(most_ratio, (piercing.farthest() - before) / (depth * std::sin(angle)));
      most_tip = std::max(most_tip, state.tip_force / kCutting);
      most_shaft = std::max(most_shaft, std::fabs(state.shaft_force) / (kFriction * depth));
      unsound += (piercing.flags & PALPATE_STEP_UNSOLVED) != 0;
    }
  }
  stability.hold("force, N", most_force, 5400 * 0.05 * 0.035,
                 "E times the length of the shaft times the way of the tip: what a plate of tissue as wide would take");
  stability.hold("what turning adds to the largest displacement, over the way of the tip", most_ratio, 2,
                 "tissue goes with the needle; twice its way leaves room for the free faces");
  stability.hold("force at the tip over the cutting force", most_tip, 1 + 1e-6, "its law");
  stability.hold("force along the shaft over its friction", most_shaft, 1 + 1e-6, "its law");
  stability.hold("steps without a solution", unsound, 0, "the system has the compliance of the shaft on its diagonal");
}

TEST(StabilityNeedle, JumpsAndComesOut) {
  StabilityCase stability(
      "A device that loses its way sends a needle by a metre: the tissue must not follow, and must come to rest "
      "after.");
  double unsound = 0, left = 0;
  for (const Vector3d& way : {Vector3d(-1, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(-0.02, 0.03, -0.02)}) {
    Piercing piercing;
    const Vector3d tip(piercing.needle.tip);
    for (int s = 0; s < 4; ++s) {
      piercing.step({-1, 0, 0}, s % 2 == 0 ? Vector3d(tip + way) : tip);
      unsound += !piercing.force().allFinite() || !piercing.torque().allFinite() || !std::isfinite(piercing.farthest());
    }
    for (double x = tip[0]; x < entry()[0] + 0.08; x += 1e-3) piercing.step({-1, 0, 0}, {x, entry()[1], entry()[2]});
    left = std::max({left, piercing.force().norm(), piercing.farthest()});
  }
  stability.hold("steps with a number that is not finite", unsound, 0, "the contract");
  stability.hold("force, N, and displacement, m, after it came out", left, 0, "nothing holds the tissue");
}

}  // namespace
}  // namespace palpate::tests
