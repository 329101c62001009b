// Tools against a surface that other tools have deformed: no contact in the air, no tool that passes through tissue.
#include <random>

#include "tests/runtime/touched_box.h"
#include "tests/support/deformed_truth.h"
#include "tests/support/grid_body.h"

namespace palpate::tests {
namespace {

palpate_scene_def deformed_def() {
  palpate_scene_def def = unlimited_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_POINT;
  return def;
}

// A tool with one point and a tool that grips, step by step, beside the true surface that the step meets.
class Watched {
 public:
  explicit Watched(const TouchedBody& body, const palpate_scene_def& def = deformed_def())
      : body_(body),
        scene_(body.scene(def)),
        contacts_(scene_.get()),
        before_(body.body),
        now_(body.body),
        next_(body.body) {}

  // Moves the point to p while the grips hold. Afterwards height() is the true signed distance (m) of p to the surface that the
  // step met, and moved() how far point and surface moved in the step.
  void step(const Eigen::Vector3d& p, const std::vector<palpate_grip>& grips) {
    before_ = now_, now_ = next_;
    moved_ = (known_ ? (p - last_).norm() : 0) + now_.largest_move(before_);
    const palpate_tool tools[2] = {tool_of(grips), point_tool(p.data())};
    flags_ = palpate_scene_touch(scene_.get(), tools, 2, 1e-3, contacts_.get(), contacts_.bytes());
    height_ = now_.signed_distance(p);
    next_.move(displacements(scene_.get(), contacts_.get(), body_.body.surface_nodes));
    last_ = p, known_ = true;
  }
  bool touches() { return palpate_contacts_tool(contacts_, 1)->contact_count > 0; }
  Eigen::Vector3d force() { return Eigen::Vector3d(palpate_contacts_tool(contacts_, 1)->force_raw); }
  double height() const { return height_; }
  double moved() const { return moved_; }
  palpate_step_flags flags() const { return flags_; }
  const DeformedTruth& next() const { return next_; }

 private:
  const TouchedBody& body_;
  ScenePointer scene_;
  Contacts contacts_;
  DeformedTruth before_, now_, next_;
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
  bool known_ = false;
  double moved_ = 0, height_ = 0;
  palpate_step_flags flags_ = 0;
};

// The true surface is read from single-precision displacements.
constexpr double kStored = 1e-6;

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

// The rim of the slot's wall at x = 30 mm, drawn back by 10 mm. A point then comes down everywhere in the opened slot.
struct Approaches {
  int steps_in_the_air = 0, false_contacts = 0, missed = 0, touched = 0;
};

Approaches come_down_into_the_gap(const TouchedBody& block, const std::vector<std::int32_t>& rim) {
  Approaches all;
  for (double x = .0215; x < .033; x += .0011)
    for (const double y : {.004, .0151, .0262}) {
      Watched watched(block);
      Eigen::Vector3d p(x, y, .070);
      for (int ms = 0; ms <= 50; ++ms) watched.step(p, draw(rim, {-2e-4 * ms, 0, 0}));
      for (int ms = 0; ms < 110 && !watched.touches(); ++ms) {
        p[2] -= 5e-4;
        watched.step(p, draw(rim, {-.01, 0, 0}));
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
  for (const auto& nodes : {std::vector<std::int32_t>{rim[1]}, rim}) {
    const Approaches all = come_down_into_the_gap(block, nodes);
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
  for (const auto contact : {PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH}) {
    palpate_scene_def def = palpate_default_scene_def();
    def.contact = contact, def.collision = PALPATE_COLLISION_DEFORMED;
    Watched watched(box, def);
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
  }
}

TEST(DeformedCollision, APointThatSlowlyPassesAThinPartIsHeldAndThenReleased) {
  // Within the speed that is followed, but through a plate of 4 mm in one step: the plate does not hold it.
  const TouchedBox plate({.cells = {6, 6, 1}, .size = {.06, .06, .004}});
  palpate_scene_def def = palpate_default_scene_def();
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

// One random scene: some nodes are gripped and wander, a point wanders about, near the surface most of the time. Returns the steps in
// which the contact contradicts the truth by more than the motion of one step.
struct Contradictions {
  long steps = 0, near = 0, touched = 0, begun = 0;
  long early = 0, missed = 0, in_the_air = 0;
};

void wander(const TouchedBody& body, double grip_reach, int steps, std::mt19937& random, Contradictions* all) {
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto direction = [&] { return Eigen::Vector3d(between(-1, 1), between(-1, 1), between(-1, 1)); };
  Watched watched(body), without(body);
  Eigen::Vector3d low = body.node(0), high = low;
  for (std::int32_t n = 0; n < body.body.surface_nodes; ++n)
    low = low.cwiseMin(body.node(n)), high = high.cwiseMax(body.node(n));
  std::vector<std::int32_t> held;
  std::vector<Eigen::Vector3d> aim, at;
  for (int g = 0; g < 3; ++g) {
    held.push_back(body.touchable[random() % body.touchable.size()]);
    aim.push_back(grip_reach * direction()), at.push_back(Eigen::Vector3d::Zero());
  }
  std::sort(held.begin(), held.end());
  Eigen::Vector3d p = high + Eigen::Vector3d::Constant(.01), goal = p;
  double speed = 0;
  bool was_touching = false;
  const Eigen::Vector3d nowhere = high + Eigen::Vector3d::Constant(.5);
  for (int s = 0; s < steps; ++s) {
    if ((goal - p).norm() < 1e-9 || s % 97 == 0) {
      // To a place beside a random node as it was meshed: some mm outside or inside.
      goal = body.node(static_cast<std::int32_t>(random() % body.body.surface_nodes)) + between(0, .012) * direction();
      speed = std::pow(10.0, between(-5, -2.3));  // m in a step
    }
    const Eigen::Vector3d way = goal - p;
    p += way * std::min(1.0, speed / std::max(1e-12, way.norm()));
    std::vector<palpate_grip> grips;
    for (int g = 0; g < 3; ++g) {
      if (s % 150 == 50 * g) aim[g] = grip_reach * direction();
      const Eigen::Vector3d to = aim[g] - at[g];
      at[g] += to * std::min(1.0, 2e-4 / std::max(1e-12, to.norm()));
      if (g == 0 || held[g] != held[g - 1]) grips.push_back(grip_at_node(held[g], at[g]));
    }
    watched.step(p, grips);
    // The surface as the grips alone deform it: what the point would meet if its contact ended.
    const double height_without = without.next().signed_distance(p);
    without.step(nowhere, grips);
    const double tolerance = watched.moved() + kStored;
    // Over held nodes there is no contact, or one that acts on other nodes: the step says so.
    const bool trusted = !(watched.flags() & PALPATE_STEP_NOT_TOUCHABLE);
    ++all->steps, all->touched += watched.touches();
    all->near += std::abs(watched.height()) < .002;
    all->begun += watched.touches() && !was_touching;
    if (!was_touching) {
      all->early += watched.touches() && watched.height() > tolerance;
      all->missed += !watched.touches() && watched.height() < -tolerance && trusted;
    } else {
      all->in_the_air +=
          watched.touches() && watched.height() > tolerance && height_without > tolerance + without.moved() && trusted;
    }
    was_touching = watched.touches();
  }
}

TEST(DeformedCollision, AgreesWithEveryTriangleInRandomScenes) {
  std::mt19937 random(20);
  Contradictions thick, thin;
  const TouchedBody block(slotted_block()), slab(clamped_slab());
  const TouchedBox box;
  for (int scene = 0; scene < 8; ++scene) {
    wander(block, .006, 500, random, &thick);
    wander(box, .004, 500, random, &thick);
    wander(slab, .003, 500, random, &thin);
  }
  for (const Contradictions& all : {thick, thin}) {
    EXPECT_GT(all.near, all.steps / 20);
    EXPECT_GT(all.begun, 5);
    EXPECT_EQ(all.early, 0);
    EXPECT_EQ(all.missed, 0);
  }
  // A point that has gone through the slab keeps its contact; the other bodies are too thick for that.
  EXPECT_EQ(thick.in_the_air, 0);
}

}  // namespace
}  // namespace palpate::tests
