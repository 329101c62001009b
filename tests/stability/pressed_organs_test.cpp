// Organs pressed on one another beyond what they may meet: a thin lobe between two others, poses far from the origin, ten organs at once;
// and grasps that hold an organ still while it breathes.
#include <numbers>

#include "tests/runtime/moved_box.h"
#include "tests/runtime/world/touching_world.h"
#include "tests/stability/conflict.h"
#include "tests/stability/held_places.h"
#include "tests/stability/stability_case.h"

namespace palpate::tests {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// What the steps of a world told, of all organs.
struct Told {
  double largest_pair = 0;    // N
  double out_of_balance = 0;  // N: the sum of what organs do to one another
  double largest_shape = 0;   // m
  palpate_step_flags flags = 0;

  void add(Touching& organs, palpate_step_flags raised, const std::vector<const TouchedBody*>& bodies) {
    flags |= raised;
    Vector3d sum = Vector3d::Zero();
    for (std::size_t k = 0; k < bodies.size(); ++k) sum += organs.pressed(static_cast<std::int32_t>(k));
    keep(sum.norm(), &out_of_balance);
    for (std::int32_t i = 0; i < organs.contacts->get()->pair_count; ++i) {
      const palpate_world_pair& pair = organs.pair(i);
      keep(Vector3d(pair.force).norm(), &largest_pair);
      keep(std::isfinite(pair.gap) && std::isfinite(pair.pressure) ? 0 : NAN, &largest_pair);
    }
  }
  void add_shapes(Touching& organs, const std::vector<const TouchedBody*>& bodies) {
    for (std::size_t k = 0; k < bodies.size(); ++k)
      for (const float u : organs.shape(static_cast<std::int32_t>(k), *bodies[k])) keep(std::fabs(u), &largest_shape);
  }
};

// N: a block between two plates under `way`, its tissue held from going aside. Contacts that only push ask for no more.
double confined(double area, double height, double way) {
  constexpr double young = 5400, poisson = 0.45;
  return young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson)) * area * way / height;
}

// 60 x 40 x 3 mm, held at one end.
const TouchedBody& thin_lobe() {
  static const TouchedBody body([] {
    GridBody grid;
    grid.lines = {grid_lines(-0.03, 0.03, 9), grid_lines(-0.02, 0.02, 6), grid_lines(0, 0.003, 1)};
    grid.held = [](auto p) { return p[0] == -0.03; };
    grid.young = 3000;
    return dense_grid(grid);
  }());
  return body;
}

// The upper block comes down by 15 mm on a lobe of 3 mm and draws its free end back towards the clamp by 15 mm.
TEST(StabilityPressedOrgans, AThinLobeFoldsBetweenTwoOthers) {
  StabilityCase attack(
      "A thin lobe between two organs is pressed to a fraction of its thickness and drawn together until it folds: its "
      "triangles turn over, their normals do not face the others any more, and pairs above and below contradict each "
      "other");
  const std::vector<const TouchedBody*> bodies = {&upper_block(), &thin_lobe(), &lower_block()};
  const double most = confined(0.03 * 0.03, 0.02, 0.015);
  for (const double friction : {0.0, 0.5}) {
    const std::string with = friction > 0 ? ", friction 0.5" : ", no friction";
    Touching organs({{bodies[0], {0.01, 0, 0.0335}}, {bodies[1], {0, 0, 0.0302}}, {bodies[2], {0, 0, 0}}}, friction);
    Told told;
    const auto go = [&](const Vector3d& at) {
      organs.place(0, at);
      told.add(organs, organs.step(), bodies);
    };
    for (int s = 0; s <= 75; ++s) go({0.01, 0, 0.0335 - 2e-4 * s});
    for (int s = 0; s <= 75; ++s) go({0.01 - 2e-4 * s, 0, 0.0185});
    told.add_shapes(organs, bodies);
    const Vector3d rest = organs.pressed(0);
    attack.hold("force on the upper block, N" + with, rest.norm(), most,
                "the whole block compressed by the way without going aside");
    attack.hold("largest force of a pair, N" + with, told.largest_pair, most, "pairs push, so none has more than all");
    attack.hold("forces out of balance, of the force" + with, told.out_of_balance / rest.norm(), 1e-9,
                "each pair presses both organs alike: rounding");
    attack.hold("largest displacement, m" + with, told.largest_shape, 0.03, "the sum of both ways");
    // A vertex that the folded lobe takes past a side of another organ has no pair, and the step says so.
    attack.hold("other flags" + with,
                told.flags & ~(kOfConflict | PALPATE_STEP_CONTACTS_DROPPED | PALPATE_STEP_NOT_TOUCHABLE), 0,
                "nothing else is wrong with the input");
    // Withdrawn, all is as it was.
    for (int s = 0; s < 20; ++s) go({0.01, 0, 0.0335 + 1e-3 * s});
    attack.hold("force when it is gone, N" + with, organs.pressed(0).norm(), 0, "nothing presses the upper block");
  }
}

// The whole scene is somewhere else in the world, and turned.
TEST(StabilityPressedOrgans, PosesTenKilometresAway) {
  StabilityCase attack(
      "Poses of 1e4 m leave twelve digits of a millimetre less: a pair's target is the difference of two such numbers");
  const Vector3d far(1e4, -1e4, 1e4);
  const Quaterniond turn(Eigen::AngleAxisd(2.2, Vector3d(1, -2, 0.5).normalized()));
  for (const double friction : {0.0, 0.3}) {
    const std::string with = friction > 0 ? ", friction 0.3" : ", no friction";
    Vector3d here[2], there[2];
    palpate_step_flags flags = 0;
    for (const bool is_far : {false, true}) {
      const Quaterniond frame = is_far ? turn : Quaterniond::Identity();
      const Vector3d origin = is_far ? far : Vector3d::Zero();
      Touching blocks({{&upper_block(), {0, 0, 0.031}}, {&lower_block(), {0, 0, 0}}}, friction);
      const auto put = [&](std::int32_t organ, const Vector3d& at) {
        const palpate_pose pose = pose_at(origin + frame * at, frame);
        ASSERT_EQ(palpate_scene_set_pose(palpate_world_scene(blocks.world.get(), organ), &pose, nullptr), PALPATE_OK);
      };
      for (int s = 0; s < 60; ++s) {
        put(1, {0, 0, 0}), put(0, {2e-5 * s, 1e-5 * s, 0.0305 - 4e-5 * std::min(s, 40)});
        const palpate_step_flags raised = blocks.step();
        if (s > 0) flags |= raised;  // in the first step the far world comes from the origin
      }
      for (std::int32_t k = 0; k < 2; ++k) (is_far ? there : here)[k] = frame.inverse() * blocks.pressed(k);
    }
    // Coordinates round by 1e4 m x 1.1e-16, some ten times in a target of 1 mm.
    for (int k = 0; k < 2; ++k)
      attack.hold("force on organ " + std::to_string(k) + " against that near the origin" + with,
                  (there[k] - here[k]).norm() / here[k].norm(), 1e-7,
                  "the rounding of places, 1e-11 m of 1 mm, times ten");
    attack.hold("force, N" + with, 0.05 / here[0].norm(), 1, "the blocks press one another");
    attack.hold("flags" + with, flags, 0, "nothing is wrong with the input");
  }
}

// Ten plates in a heap, each held at the other side than the one below; each comes nearer to the one below by 0.6 mm.
TEST(StabilityPressedOrgans, TenOrgansInAHeap) {
  StabilityCase attack(
      "Ten organs that press one another are one system of 300 rows and more; what each solve leaves goes through all "
      "of them in the next step, and the heap may swing");
  constexpr int kOrgans = 10;
  constexpr double kThick = 0.015, kPush = 0.0054;
  std::vector<Stack> heap;
  for (int k = 0; k < kOrgans; ++k) heap.push_back({&side_plate(), {0, 0, (kThick + 5e-5) * k}});
  const std::vector<const TouchedBody*> bodies(kOrgans, &side_plate());
  Touching organs(heap, 0.2, 1000);
  Told told;
  const auto press = [&](double by) {
    for (int k = 0; k < kOrgans; ++k) {
      const Quaterniond turn(Eigen::AngleAxisd(k % 2 ? std::numbers::pi : 0, Vector3d::UnitZ()));
      const palpate_pose pose = pose_at({0, 0, (kThick + 5e-5) * k - by * k / (kOrgans - 1)}, turn);
      palpate_scene_set_pose(palpate_world_scene(organs.world.get(), k), &pose, nullptr);
    }
    told.add(organs, organs.step(), bodies);
  };
  for (int s = 0; s <= 15; ++s) press(kPush * s / 15);
  for (int s = 0; s < 100; ++s) press(kPush);
  Vector3d rest[kOrgans];
  for (int k = 0; k < kOrgans; ++k) rest[k] = organs.pressed(k);
  double swing = 0;
  for (int s = 0; s < 5; ++s) {
    press(kPush);
    for (int k = 0; k < kOrgans; ++k) keep((organs.pressed(k) - rest[k]).norm(), &swing);
  }
  told.add_shapes(organs, bodies);
  const double least = std::min(-rest[0].z(), rest[kOrgans - 1].z());
  attack.hold("0.01 N over what presses the outer ones", 0.01 / least, 1, "each is pressed by the next one");
  attack.hold("largest force of a pair, N", told.largest_pair, confined(0.04 * 0.04, kThick, kPush),
              "a plate compressed by the whole push");
  attack.hold("forces out of balance, of the force", told.out_of_balance / least, 1e-9,
              "each pair presses both organs alike: rounding");
  attack.hold("swing at rest, of the force", swing / least, 5e-4, "what normals that still turn leave after 100 steps");
  attack.hold("largest displacement, m", told.largest_shape, kPush, "plates give way by less than the push");
  attack.hold("other flags", told.flags & ~kOfConflict, 0, "nothing else is wrong with the input");
}

// Two forceps that stand hold the end of a box whose support goes to and fro, as retractors hold a liver that breathes; one of them goes up
// and down beside the other.
TEST(StabilityPressedOrgans, GraspsAgainstBreathing) {
  StabilityCase attack(
      "The supports move an organ that jaws hold still, by 10 mm in each breath and 80 mm at once, and a second grasp "
      "contradicts the first one: targets less what motions do grow, and each slip moves the targets");
  const MovedBox box(false);
  SceneDef def = moved_def();
  def.contact = PALPATE_CONTACT_PATCH, def.grasps.grasps = 1, def.max_tools = 2;
  for (const double friction : {double{INFINITY}, 0.3}) {
    const std::string with = std::isfinite(friction) ? ", jaws that slip" : ", jaws that hold";
    TouchedScene scene(box, def);
    palpate_grasp grasps[2];
    palpate_tool tools[2] = {palpate_default_tool(), palpate_default_tool()};
    for (int t = 0; t < 2; ++t) {
      const Vector3d above(0.045, 0.02 + 0.01 * t, 0.04), below(0.045, 0.02 + 0.01 * t, 0);
      grasps[t] = face_grasp(box, Vector3d::UnitZ(), above, 0.006);
      oppose(box, grasps[t], -Vector3d::UnitZ(), below);
      grasps[t].closing = 0.004, grasps[t].friction = friction;
      tools[t].id = t, tools[t].parts = &grasps[t].part;
    }
    double largest = 0, farthest = 0;
    palpate_step_flags flags = 0;
    bool slipped = false;
    const auto step = [&](double q, int count) {
      set_amounts(scene.get(), {q, 0, 0, 0});
      flags |= scene.touch(&tools[0], count);
      for (std::int32_t t = 0; t < count; ++t) {
        keep(scene.force(t).norm(), &largest);
        slipped = slipped || palpate_scene_grasp_state(scene.get(), t)->condition == PALPATE_GRASP_SLIPS;
      }
    };
    for (int s = 0; s < 200; ++s) step(0.005 * std::sin(0.1 * s), s < 5 ? 0 : 1);
    const double start = grasps[1].position[2];
    for (int s = 0; s < 200; ++s) {
      grasps[1].position[2] = start + 0.01 * std::sin(0.3 * s);
      step(s % 50 < 25 ? 0.04 : -0.04, 2);
    }
    for (const float u : scene.shape()) keep(std::fabs(u), &farthest);
    EXPECT_EQ(slipped, std::isfinite(friction));
    attack.hold("largest force, N" + with, largest, 2 * stiffest(box) * 0.1,
                "the stiffest node alone under all ways asked for, twice: the jaws of the two grasps overlap, and what "
                "they share does "
                "not give way between them");
    attack.hold("largest displacement, m" + with, farthest, 0.1, "all ways asked for");
    attack.hold("other flags" + with, flags & ~(kOfConflict | PALPATE_STEP_MOTION_LIMITED), 0,
                "nothing else is wrong with the input");
    // Let go, and at rest again: what is left is nothing.
    for (int s = 0; s < 50; ++s) step(0, 0);
    double left = 0;
    for (const float u : scene.shape()) keep(std::fabs(u), &left);
    attack.hold("displacement when it is let go, m" + with, left, 0, "no force acts and no support has moved");
  }
}

}  // namespace
}  // namespace palpate::tests
