// Tools against a surface that other tools have deformed: no contact in the air, no tool that passes through tissue.
#include "tests/runtime/random_scenes.h"

namespace palpate::tests {
namespace {

std::vector<palpate_grip> draw(const std::vector<std::int32_t>& nodes, const Eigen::Vector3d& by) {
  std::vector<palpate_grip> grips;
  for (const std::int32_t n : nodes) grips.push_back(grip_at_node(n, by));
  return grips;
}

std::vector<std::int32_t> touchable_where(const TouchedBody& body,
                                          const std::function<bool(const Eigen::Vector3d&)>& is_wanted) {
  std::vector<std::int32_t> nodes;
  for (const std::int32_t n : body.touchable)
    if (is_wanted(body.node(n))) nodes.push_back(n);
  return nodes;
}

// The rim of the slot's wall at x = 30 mm, drawn back by `by` (m). A point then comes down everywhere in the opened slot.
struct Approaches {
  int steps_in_the_air = 0, false_contacts = 0, missed = 0, touched = 0;
};

Approaches come_down_into_the_gap(const TouchedBody& block, const std::vector<std::int32_t>& rim, double by) {
  Approaches all;
  for (double x = .0215; x < .033; x += .0011)
    for (const double y : {.004, .0151, .0262}) {
      Watched watched(block);
      Eigen::Vector3d p(x, y, .070);
      for (int ms = 0; ms <= 50; ++ms) watched.step(p, draw(rim, {-by * ms / 50, 0, 0}));
      for (int ms = 0; ms < 110 && !watched.touches(); ++ms) {
        p[2] -= 5e-4;
        watched.step(p, draw(rim, {-by, 0, 0}));
        const double tolerance = watched.moved() + kStored;
        all.steps_in_the_air += watched.height() > tolerance;
        all.false_contacts += watched.touches() && watched.height() > tolerance;
        all.missed += !watched.touches() && watched.height() < -tolerance;
      }
      all.touched += watched.touches();
    }
  return all;
}

TEST(DeformedCollision, AnOpenedGapIsAir) {
  const TouchedBody block(slotted_block());
  const auto rim = touchable_where(
      block, [](const Eigen::Vector3d& p) { return std::abs(p[0] - .030) < 1e-9 && std::abs(p[2] - .050) < 1e-9; });
  ASSERT_EQ(rim.size(), 4u);
  for (const double by : {.010, .030})
    for (const auto& nodes : {std::vector<std::int32_t>{rim[1]}, rim}) {
      const Approaches all = come_down_into_the_gap(block, nodes, by);
      EXPECT_GT(all.steps_in_the_air, 1500);
      EXPECT_EQ(all.false_contacts, 0);
      EXPECT_EQ(all.missed, 0);
      EXPECT_EQ(all.touched, 33);  // on the bottom of the slot or on a wall
    }
}

TEST(DeformedCollision, ALeverIsMet) {
  const TouchedBody slab(clamped_slab());
  // Beside the clamp, in the middle of the width, pressed down by 3 mm: the free end goes down by over twice as much.
  const auto near_clamp = touchable_where(slab, [](const Eigen::Vector3d& p) {
    return std::abs(p[0] - .0225) < 1e-9 && std::abs(p[1] - .015) < 1e-9 && std::abs(p[2] - .012) < 1e-9;
  });
  ASSERT_EQ(near_clamp.size(), 1u);
  int met = 0, passed = 0, missed = 0, early = 0;
  for (const double x : {.06, .08, .10, .115})
    for (const double y : {.004, .013, .026})
      for (const double below : {.001, .002, .003, .004, .005}) {
        Watched watched(slab);
        const Eigen::Vector3d p(x, y, -below);
        double lowest = INFINITY;
        for (int ms = 0; ms <= 300 && !watched.touches(); ++ms) {
          watched.step(p, draw(near_clamp, {0, 0, -1e-5 * ms}));
          lowest = std::min(lowest, watched.height());
          const double tolerance = watched.moved() + kStored;
          early += watched.touches() && watched.height() > tolerance;
          missed += !watched.touches() && watched.height() < -tolerance;
        }
        passed += lowest < 0;
        met += watched.touches();
      }
  EXPECT_GE(passed, 20);
  EXPECT_GE(met, passed);
  EXPECT_EQ(missed, 0);
  EXPECT_EQ(early, 0);
}

TEST(DeformedCollision, AJumpIsLostTrackingAndNoContact) {
  const TouchedBox box;
  for (const auto contact : {PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH})
    for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_COULOMB}) {
      Watched watched(box, with(SceneDef(), contact, law, PALPATE_COLLISION_DEFORMED));
      const auto lost = [&] { return (watched.flags() & PALPATE_STEP_TRACKING_LOST) != 0; };
      // From above to below in one step of 1 ms: 80 m/s.
      watched.step({.031, .022, .060}, {});
      watched.step({.031, .022, -.020}, {});
      EXPECT_TRUE(lost());
      EXPECT_FALSE(watched.touches());
      EXPECT_EQ(watched.force().norm(), 0);
      watched.step({.031, .022, -.020}, {});
      EXPECT_FALSE(lost());
      EXPECT_FALSE(watched.touches());
      // It comes in from below at a speed that can be followed, and then jumps a metre aside.
      for (int ms = 0; ms <= 25; ++ms) watched.step({.031, .022, -.020 + .001 * ms}, {});
      EXPECT_TRUE(watched.touches());
      EXPECT_FALSE(lost());
      watched.step({1.031, .022, .005}, {});
      EXPECT_TRUE(lost());
      EXPECT_FALSE(watched.touches());
      EXPECT_EQ(watched.force().norm(), 0);
      // Far from the organ it jumps aside, and then into the organ: 170 and 25 m/s.
      watched.step({.200, .022, .060}, {});
      watched.step({.200, .022, .060}, {});
      EXPECT_FALSE(lost());
      watched.step({.031, .022, .060}, {});
      EXPECT_TRUE(lost());
      watched.step({.031, .022, .060}, {});
      EXPECT_FALSE(lost());
      watched.step({.031, .022, .035}, {});
      EXPECT_TRUE(lost());
      EXPECT_FALSE(watched.touches());
    }
}

TEST(DeformedCollision, APointThatSlowlyPassesAThinPartIsHeldAndThenReleased) {
  // Within the speed that is followed, but through a plate of 4 mm in one step: the plate does not hold it.
  const TouchedBox plate({.cells = {6, 6, 1}, .size = {.06, .06, .004}});
  SceneDef def;
  def.contact = PALPATE_CONTACT_POINT, def.collision = PALPATE_COLLISION_DEFORMED, def.release_distance = .015;
  Watched jump(plate, def);
  jump.step({.041, .03, .007}, {});
  jump.step({.041, .03, -.002}, {});
  EXPECT_TRUE(jump.flags() & PALPATE_STEP_TRACKING_LOST);
  EXPECT_FALSE(jump.touches());
  // A point that presses the plate down keeps its contact beyond the plate's thickness, and loses it at the release distance.
  Watched press(plate, def);
  int touching = 0;
  bool lost = false;
  for (int ms = 0; ms <= 250; ++ms) {
    const double depth = 1e-4 * ms;
    press.step({.041, .03, .0045 - depth}, {});
    touching += press.touches();
    lost = lost || (press.flags() & PALPATE_STEP_TRACKING_LOST);
    if (depth > .0006 && depth < .0153) {
      ASSERT_TRUE(press.touches()) << depth;
    }
    if (depth > .0157) {
      ASSERT_FALSE(press.touches()) << depth;
    }
  }
  EXPECT_TRUE(lost);
}

// A tool that holds its place touches by 1 mm and draws the body back the way it came.
TEST(DeformedCollision, AContactThatHoldsEndsAtTheReleaseDistanceAndDoesNotBeginAgain) {
  const TouchedBox box;
  for (const double given : {0.0, .002, .010})
    for (const auto contact : {PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH}) {
      SceneDef def;
      def.collision = PALPATE_COLLISION_DEFORMED, def.contact = contact, def.release_distance = given;
      const double release =
          given > 0 ? given : std::sqrt(.06 * .06 + .05 * .05 + .04 * .04) / 5;  // of the body's diagonal
      TouchedScene scene(box, def);
      double farthest = 0;
      int began = 0, lost = 0;
      bool touches = false;
      for (int s = 0; s < 300; ++s) {
        const double height = 1e-4 * (s < 60 ? 50 - s : s - 70);
        const double point[3] = {.031, .022, .04 + height};
        lost += (scene.touch({point_tool(point, 1, .004, .3, true)}) & PALPATE_STEP_TRACKING_LOST) != 0;
        began += !touches && scene.tool().contact_count > 0;
        touches = scene.tool().contact_count > 0;
        if (touches) farthest = std::max(farthest, height);
      }
      EXPECT_EQ(began, 1) << given << " " << contact;
      EXPECT_EQ(lost, 1) << given << " " << contact;
      EXPECT_EQ(scene.force().norm(), 0);
      EXPECT_NEAR(farthest, release, 1.001e-4) << given << " " << contact;  // the motion of a step
    }
}
TEST(DeformedCollision, QuickReferenceAgreesWithTheSlowOne) {
  const TouchedBody block(slotted_block());
  Dice dice(1);
  for (const double reach : {0., .002, .02}) {
    std::vector<float> u;
    for (std::int32_t n = 0; n < 3 * block.body.surface_nodes; ++n)
      u.push_back(static_cast<float>(dice.between(-reach, reach)));
    QuickTruth quick(block.body);
    DeformedTruth slow(block.body);
    quick.move(u), slow.move(u);
    for (int i = 0; i < 1000; ++i) {
      const Eigen::Vector3d p = block.node(dice.below(block.body.surface_nodes)) + .01 * dice.direction();
      ASSERT_NEAR(quick.signed_distance(p), slow.signed_distance(p), 1e-12) << reach << " " << p.transpose();
    }
  }
}

TEST(DeformedCollision, AgreesWithEveryTriangleInRandomScenes) {
  const RandomScenes scenes;
  Contradictions thick, thin;
  for (std::uint64_t seed = 0; seed < 24; ++seed)
    scenes.play(seed, 500, scenes.is_thin(seed) ? &thin : &thick,
                [](const Contradiction& found) { ADD_FAILURE() << sentence_of(found); });
  for (const Contradictions& all : {thick, thin}) {
    EXPECT_GT(all.near, all.steps / 20);
    EXPECT_GT(all.begun, 5);
    EXPECT_GT(all.touched, all.steps / 50);
    EXPECT_GT(all.pierced, all.steps / 50) << "no needle beside the deformed surface";
  }
}

}  // namespace
}  // namespace palpate::tests
