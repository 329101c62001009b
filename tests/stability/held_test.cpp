// Sutures, springs and grasps that contradict each other or ask for what tissue cannot do.
#include <random>

#include "tests/stability/conflict.h"
#include "tests/stability/held_places.h"
#include "tests/stability/known_compliance.h"
#include "tests/stability/stability_case.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

// 80 x 60 x 8 mm, held at x = 0.
const KnownBox& lobe() {
  static const KnownBox known({.cells = {8, 6, 2}, .size = {0.08, 0.06, 0.008}, .interior = false});
  return known;
}

palpate_link_end end_at(Vector3d outward, Vector3d p) {
  const FacePlace place = face_place(lobe().box, outward, p);
  palpate_link_end end = {};
  end.kind = PALPATE_END_SURFACE_POINT, end.triangle = place.triangle;
  std::copy(place.barycentric, place.barycentric + 3, end.barycentric);
  return end;
}
palpate_grasp grasp_at(Vector3d outward, Vector3d p, double radius) {
  return face_grasp(lobe().box, outward, p, radius);
}

SceneDef held_def(std::int32_t links, std::int32_t grasps) {
  SceneDef def = unlimited_def(PALPATE_COLLISION_OFF);
  def.torque_limit = def.torque_slew = INFINITY, def.links.max_links = links, def.grasps.grasps = grasps > 0,
  def.max_tools = std::max(1, grasps);
  return def;
}

struct Holding : TouchedScene {
  Holding(std::int32_t links, std::int32_t grasps) : TouchedScene(lobe().box, held_def(links, grasps)) {}
  void set(const std::vector<palpate_link>& links) {
    palpate_error error = {};
    ASSERT_EQ(palpate_scene_set_links(scene.get(), links.data(), static_cast<std::int32_t>(links.size()), &error),
              PALPATE_OK)
        << error.text;
    count = static_cast<std::int32_t>(links.size());
  }
  void step(const std::vector<palpate_grasp>& grasps = {}) {
    std::vector<palpate_tool> tools;
    for (const palpate_grasp& grasp : grasps) {
      tools.push_back(palpate_default_tool());
      tools.back().parts = &grasp.part, tools.back().has_torque = 1;
    }
    all_flags |= touch(tools);
    for (std::int32_t t = 0; t < contacts->tool_count; ++t)
      keep(force(t).norm(), &largest), keep(torque(t).norm(), &largest_torque);
    for (std::int32_t i = 0; i < count; ++i) {
      const palpate_link_state& state = *palpate_scene_link_state(scene.get(), i);
      keep(std::fabs(state.tension), &largest), keep(std::isfinite(state.length) ? 0 : NAN, &largest);
    }
  }

  std::int32_t count = 0;
  palpate_step_flags all_flags = 0;
  double largest = 0, largest_torque = 0;
};

// N/m: a grasp or a link moves tissue by `way`; the stiffest node resists with this, and contradictions may cost 1,024 times as much
// (ContactSolver's limit).
double bound(double way) {
  double stiffest = 0;
  for (std::size_t k = 0; k < lobe().box.touchable.size(); ++k)
    stiffest = std::max(stiffest, lobe().own_stiffness(static_cast<std::int32_t>(k)).norm());
  return 1024 * stiffest * way;
}
const char* const kBound = "1,024 times the stiffest node's stiffness times the largest way asked for";

TEST(StabilityHeld, GraspsThatConflict) {
  StabilityCase attack(
      "Two tools hold the same tissue and draw it apart, in all six directions: no displacement meets both, and but "
      "for "
      "what the mesh does not resolve of the discs the system has equal rows with other targets.");
  Holding holding(0, 2);
  const Vector3d p(0.06, 0.03, 0.008);
  const palpate_grasp start = grasp_at({0, 0, 1}, p, 0.01);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> draw(-1, 1);
  holding.step({start, start});
  for (int s = 0; s < quick_or_long(300, 20000); ++s) {
    palpate_grasp pair[2] = {start, start};
    for (palpate_grasp& grasp : pair) {
      for (double& x : grasp.position) x += 0.02 * draw(random);
      Eigen::Vector4d q(1 + draw(random), draw(random), draw(random), draw(random));
      q.normalize();
      std::copy(q.data(), q.data() + 4, grasp.orientation);
    }
    holding.step({pair[0], pair[1]});
  }
  attack.hold("largest force, N", holding.largest, bound(0.06), kBound);
  attack.hold("largest torque, N m", holding.largest_torque, 0.1 * bound(0.06), "that force times the lobe's length");
  attack.hold("other flags", holding.all_flags & ~kOfConflict, 0, "nothing else is wrong with the input");
  holding.largest = holding.largest_torque = 0;
  holding.step();
  holding.step({start});
  holding.step({start});
  attack.hold("force of one grasp that closes afterwards, N", holding.largest, 1e-6, "the tissue is back at rest");
}

TEST(StabilityHeld, SuturesThatCannotClose) {
  StabilityCase attack(
      "Threads of no length draw both ends of a thin lobe into one place and into the held face: rest lengths that "
      "no deformation reaches.");
  Holding holding(24, 0);
  std::vector<palpate_link> links;
  for (int i = 0; i < 24; ++i) {
    palpate_link link = palpate_default_link();
    const double y = 0.005 + 0.05 * (i % 8) / 7;
    link.kind = i % 3 == 2 ? PALPATE_LINK_CLIP : PALPATE_LINK_THREAD;
    link.ends[0] = end_at({0, 0, 1}, {0.02 + 0.02 * (i / 8), y, 0.008});
    link.ends[1] = i % 2 ? end_at({0, 0, -1}, {0.075, 0.06 - y, 0}) : end_at({-1, 0, 0}, {0, y, 0.004});
    link.radius = i % 4 ? 0 : 0.004;
    links.push_back(link);
  }
  holding.set(links);
  for (int s = 0; s < quick_or_long(200, 5000); ++s) holding.step();
  attack.hold("largest tension, N", holding.largest, bound(0.1), kBound);
  attack.hold("other flags", holding.all_flags & ~kOfConflict, 0, "nothing else is wrong with the input");
  const double before = holding.largest;
  for (palpate_link& link : links) link.breaking_force = 1e-3;
  holding.set(links);
  holding.step();
  attack.hold("threads that hold after all broke", static_cast<double>([&] {
                int hold = 0;
                for (int i = 0; i < 24; ++i)
                  hold += palpate_scene_link_state(holding.scene.get(), i)->condition != PALPATE_LINK_BROKEN;
                return hold;
              }()),
              23, "at least one breaks in the first step; the others bear less then");
  for (int s = 0; s < 60; ++s) holding.step();
  holding.largest = 0;
  holding.step();
  attack.hold("tension that is left, N", holding.largest, std::min(before, 1e-3), "the breaking force");
}

TEST(StabilityHeld, AStiffChain) {
  StabilityCase attack(
      "Springs of a billion times different stiffness in one chain, next to one another: a matrix of condition 1e9, "
      "and forces that a soft neighbour amplifies.");
  Holding holding(30, 0);
  std::vector<palpate_link> links;
  for (int i = 0; i < 30; ++i) {
    palpate_link link = palpate_default_link();
    link.kind = i % 2 ? PALPATE_LINK_SPRING : PALPATE_LINK_THREAD;
    link.ends[0] = end_at({0, 0, 1}, {0.015 + 0.002 * i, 0.02 + 0.02 * (i % 2), 0.008});
    link.ends[1] = end_at({0, 0, 1}, {0.017 + 0.002 * i, 0.04 - 0.02 * (i % 2), 0.008});
    link.stiffness = i % 3 == 0 ? 1e12 : i % 3 == 1 ? 1e-3 : INFINITY;
    link.rest_length = 0.01;
    links.push_back(link);
  }
  holding.set(links);
  for (int s = 0; s < quick_or_long(200, 5000); ++s) holding.step();
  attack.hold("largest tension, N", holding.largest, bound(0.05), kBound);
  attack.hold("other flags", holding.all_flags & ~kOfConflict, 0, "nothing else is wrong with the input");
  // It comes to rest: the next steps change nothing.
  double change = 0;
  std::vector<double> tension;
  for (int i = 0; i < 30; ++i) tension.push_back(palpate_scene_link_state(holding.scene.get(), i)->tension);
  for (int s = 0; s < 20; ++s) holding.step();
  for (int i = 0; i < 30; ++i)
    change = std::max(change, std::fabs(palpate_scene_link_state(holding.scene.get(), i)->tension - tension[i]));
  attack.hold("change of a tension in 20 steps at rest, relative to the largest", change / holding.largest, 1e-3,
              "a line that turned by less than 0.1 milliradian keeps its row");
}

TEST(StabilityHeld, OpposedGraspsOfOneFold) {
  StabilityCase attack(
      "Two forceps take the same thin fold from its two sides, press it beyond its thickness and turn against each "
      "other.");
  Holding holding(0, 2);
  const Vector3d above(0.06, 0.03, 0.008), below(0.06, 0.03, 0);
  palpate_grasp one = grasp_at({0, 0, 1}, above, 0.008), other = grasp_at({0, 0, -1}, below, 0.008);
  oppose(lobe().box, one, {0, 0, -1}, below), oppose(lobe().box, other, {0, 0, 1}, above);
  holding.step({one, other});
  for (int s = 1; s <= quick_or_long(200, 5000); ++s) {
    const double share = std::min(1.0, s / 200.0), angle = 1.5 * share;
    one.closing = other.closing = 0.016 * share;
    one.orientation[0] = other.orientation[0] = std::cos(angle / 2);
    one.orientation[1] = std::sin(angle / 2), other.orientation[1] = -std::sin(angle / 2);
    holding.step({one, other});
  }
  attack.hold("largest force, N", holding.largest, bound(0.04), kBound);
  attack.hold("largest torque, N m", holding.largest_torque, 0.1 * bound(0.04), "that force times the lobe's length");
  attack.hold("other flags", holding.all_flags & ~kOfConflict, 0, "nothing else is wrong with the input");
}

}  // namespace
}  // namespace palpate::tests
