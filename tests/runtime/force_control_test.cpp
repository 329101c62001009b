// Tools that press with a given force: the place that the step tells is that at which a tool of that place feels the force.
#include <gmock/gmock.h>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/large/large_scene.h"
#include "tests/runtime/world/played_world.h"
#include "tests/support/box_corridor.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

constexpr double kRadius = 0.004, kFriction = 0.4;  // m, 1

const TouchedBody& box() {
  static const TouchedBody shared = large_body(false);
  return shared;
}

SceneDef pressed_def(palpate_contact_model contact, palpate_contact_law law,
                     palpate_deformation_model deformation = PALPATE_DEFORMATION_LINEAR) {
  SceneDef def = deformation == PALPATE_DEFORMATION_LINEAR ? unlimited_def(contact) : large_def(contact);
  def.large.deformation = deformation, def.law = law, def.collision = PALPATE_COLLISION_DEFORMED;
  def.shape = PALPATE_SHAPE_VOLUME, def.max_tools = 3, def.max_points = 6;
  def.force_control.force_control = 1;
  return def;
}

// A tool of some points that presses with a force, or stands where it is said.
struct Pusher {
  explicit Pusher(std::vector<Vector3d> at) : points(std::move(at)) {}
  palpate_tool pushes(const Vector3d& force) {
    Eigen::Map<Vector3d>(given.force) = force;
    palpate_tool tool = stands();
    tool.parts = &given.part;
    return tool;
  }
  palpate_tool stands() const {
    return point_tool(points[0].data(), static_cast<std::int32_t>(points.size()), kRadius, kFriction);
  }
  Pusher moved(const Vector3d& by) const {
    Pusher other = *this;
    for (Vector3d& p : other.points) p += by;
    return other;
  }
  std::vector<Vector3d> points;
  palpate_given_force given = palpate_default_given_force();
};

const palpate_given_force_state& state_of(const TouchedScene& scene, int id = 0) {
  return *palpate_scene_given_force_state(scene.get(), id);
}
Vector3d way_of(const TouchedScene& scene, int id = 0) {
  return Vector3d(state_of(scene, id).displacement);
}

// N, along the force that is carried: of a contact without friction, across the surface.
double missed_across(const TouchedScene& scene, int id = 0) {
  return std::fabs(Vector3d(state_of(scene, id).missed).dot(Vector3d(state_of(scene, id).force).normalized()));
}

// A thread beside the touch solves each step to its end before the next one.
void deform(TouchedScene& scene, palpate_deformation_model deformation) {
  if (deformation < PALPATE_DEFORMATION_LARGE_BESIDE) return;
  for (int i = 0; i < 20 && palpate_scene_deform(scene.get()) > 0;) ++i;
}

// Over three vertices of the top, and over the middle of one of its triangles.
std::vector<Vector3d> above_top(int count) {
  const std::vector<Vector3d> all = {{0.042, 0.021, 0.0402}, {0.045, 0.032, 0.0402}, {0.051, 0.024, 0.0402}};
  return {all.begin(), all.begin() + count};
}

TEST(ForceControl, OfOneNodeTheDisplacementIsTheComplianceTimesTheForce) {
  SceneDef def = pressed_def(PALPATE_CONTACT_NODE, PALPATE_LAW_STICKING);
  const TouchedBody& body = tiny_box();
  const std::int32_t node = body.body.triangles[place_at(body, {0, 0, 1}, {0.041, 0.018, 0.04}).triangle][0];
  const Vector3d at = body.node(node);
  Pusher pusher({at + Vector3d(0, 0, 1e-4)});
  TouchedScene scene(body, def);
  const Vector3d force(0.01, -0.02, -0.1);
  for (int s = 0; s < 80; ++s) scene.touch({pusher.pushes(force)});
  EXPECT_EQ(scene.flags, 0u);
  EXPECT_EQ(state_of(scene).condition, PALPATE_GIVEN_FORCE_CARRIED);
  EXPECT_LT((Vector3d(state_of(scene).force) - force).norm(), 1e-6 * force.norm());
  EXPECT_LT((scene.force() + force).norm(), 1e-6 * force.norm()) << "what the tool feels";
  Eigen::VectorXd load = Eigen::VectorXd::Zero(body.dofs());
  load.segment<3>(3 * node) = force;
  const Eigen::VectorXd full = solve_imposed(body.stiffness(), std::vector<bool>(body.fixed.begin(), body.fixed.end()),
                                             Eigen::VectorXd(Eigen::VectorXd::Zero(body.dofs())), load);
  const std::vector<float> u = scene.shape();
  for (std::size_t i = 0; i < u.size(); ++i)
    ASSERT_NEAR(u[i], full[static_cast<Eigen::Index>(i)], 1e-5 * full.cwiseAbs().maxCoeff()) << i;
}

// A tool that is put where the other one has gone feels the same force, and deforms the organ alike.
// Returns how far the force has brought it, m.
double expect_as_a_tool_at_that_place(const SceneDef& def, int points, const Vector3d& force, double tolerance) {
  Pusher pusher(above_top(points));
  TouchedScene pushed(box(), def), placed(box(), def);
  const palpate_deformation_model deformation = def.large.deformation;
  // Both come into contact alike.
  for (int s = 0; s < 5; ++s) {
    const Pusher first = pusher.moved(s < 1 ? Vector3d(0, 0, 0) : Vector3d(0, 0, -0.3e-3));
    pushed.touch({first.stands()}), placed.touch({first.stands()});
    deform(pushed, deformation), deform(placed, deformation);
  }
  pusher = pusher.moved({0, 0, -0.3e-3});
  for (int s = 0; s < 240; ++s) {
    const Vector3d now = std::min(1.0, 0.3 + s / 200.0) * force;
    pushed.touch({pusher.pushes(now)});
    const Pusher there = pusher.moved(way_of(pushed));
    placed.touch({there.stands()});
    deform(pushed, deformation), deform(placed, deformation);
    if (s < 120 || s % 20 != 0) continue;
    EXPECT_LT((Vector3d(state_of(pushed).force) + placed.force()).norm(), tolerance * force.norm()) << s;
    const std::vector<float> a = pushed.shape(), b = placed.shape();
    double off = 0, size = 0;
    for (std::size_t i = 0; i < a.size(); ++i) off += std::pow(a[i] - b[i], 2), size += std::pow(b[i], 2);
    EXPECT_LT(std::sqrt(off / size), tolerance) << s;
  }
  const palpate_given_force_state& last = state_of(pushed);
  const double least = deformation == PALPATE_DEFORMATION_LINEAR ? 2e-6 : 2e-3;  // of what is missed
  const bool frictionless = def.law == PALPATE_LAW_SLIDING || def.law == PALPATE_LAW_UNILATERAL;
  const Vector3d missed(last.missed), carried(last.force);
  EXPECT_LT(frictionless ? std::fabs(missed.dot(carried.normalized())) : missed.norm(), least * force.norm());
  EXPECT_EQ(pushed.flags, 0u);
  return way_of(pushed).norm();
}

TEST(ForceControl, OfALinearOrganTheStepTellsThePlaceAtWhichATooFeelsTheForce) {
  for (const auto contact : kEveryContact)
    for (const auto law : kEveryLaw)
      for (const int points : {1, 3}) {
        SCOPED_TRACE(testing::Message() << "contact " << contact << ", law " << law << ", points " << points);
        if (contact == PALPATE_CONTACT_TRIANGLE && points > 1) continue;  // their vertices conflict
        // Where anchors slide, the step moves them before it corrects the tool's place, and the other tool's after: what
        // they have gone through differs.
        const double tolerance = law == PALPATE_LAW_STICKING ? 1e-4 : 0.015;
        expect_as_a_tool_at_that_place(pressed_def(contact, law), points, {0.01, -0.015, -0.12}, tolerance);
      }
}

TEST(ForceControl, OfALargeBodyTooAt20MillimetresAndATenthOfAMetrePerSecond) {
  for (const auto deformation :
       {PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LARGE_BESIDE, PALPATE_DEFORMATION_LARGE_RENEWED})
    for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_COULOMB}) {
      SCOPED_TRACE(testing::Message() << "deformation " << deformation << ", law " << law);
      // In 140 steps of 1 ms.
      EXPECT_GT(expect_as_a_tool_at_that_place(pressed_def(PALPATE_CONTACT_PATCH, law, deformation), 1,
                                               {0.02, -0.02, -0.55}, 0.01),
                0.02);
    }
}

TEST(ForceControl, WithoutFrictionTheOrganCarriesNoForceAlongItsSurface) {
  for (const auto law : {PALPATE_LAW_SLIDING, PALPATE_LAW_UNILATERAL}) {
    TouchedScene scene(box(), pressed_def(PALPATE_CONTACT_POINT, law));
    Pusher pusher(above_top(1));
    const Vector3d force(0.03, 0, -0.1);
    for (int s = 0; s < 100; ++s) scene.touch({pusher.pushes(force)});
    const Vector3d before = way_of(scene);
    for (int s = 0; s < 100; ++s) scene.touch({pusher.pushes(force)});
    EXPECT_EQ(state_of(scene).condition, PALPATE_GIVEN_FORCE_PART);
    const Vector3d carried(state_of(scene).force), missed(state_of(scene).missed);
    EXPECT_LT(missed_across(scene), 1e-6);
    EXPECT_LT((carried + missed - force).norm(), 1e-12);
    EXPECT_GT(missed.norm(), 0.02);
    EXPECT_LT((way_of(scene) - before).norm(), 1e-9) << "it does not creep along the surface";
    EXPECT_EQ(scene.flags, 0u);
  }
}

TEST(ForceControl, FrictionCarriesNoMoreThanItsConeAndAllOfItAgainInside) {
  TouchedScene scene(box(), pressed_def(PALPATE_CONTACT_POINT, PALPATE_LAW_COULOMB));
  Pusher pusher(above_top(1));
  const auto settle = [&](const Vector3d& force) {
    for (int s = 0; s < 150; ++s) scene.touch({pusher.pushes(force)});
    return Vector3d(state_of(scene).force);
  };
  Vector3d carried = settle({0.02, 0, -0.1});
  EXPECT_EQ(state_of(scene).condition, PALPATE_GIVEN_FORCE_CARRIED);
  EXPECT_LT((carried - Vector3d(0.02, 0, -0.1)).norm(), 1e-6);
  carried = settle({0.08, 0, -0.1});
  EXPECT_EQ(state_of(scene).condition, PALPATE_GIVEN_FORCE_PART);
  const Vector3d along = Vector3d(state_of(scene).missed).normalized();
  const double across = (carried - carried.dot(along) * along).norm();
  EXPECT_NEAR(carried.dot(along), kFriction * across, 1e-3 * across);
  EXPECT_GT(across, 0.09);
  const Vector3d before = way_of(scene);
  settle({0.08, 0, -0.1});
  EXPECT_LT((way_of(scene) - before).norm(), 1e-5) << "it stands";
  carried = settle({-0.03, 0.01, -0.1});
  EXPECT_EQ(state_of(scene).condition, PALPATE_GIVEN_FORCE_CARRIED);
  EXPECT_LT((carried - Vector3d(-0.03, 0.01, -0.1)).norm(), 1e-5);
}

TEST(ForceControl, AToolThatTouchesNothingGoesAlongItsForceNoFasterThanItMay) {
  TouchedScene scene(box(), pressed_def(PALPATE_CONTACT_POINT, PALPATE_LAW_UNILATERAL));
  Pusher pusher({Vector3d(0.042, 0.021, 0.08)});
  pusher.given.speed = 0.1;
  const Vector3d force(3, 4, 0);
  for (int s = 0; s <= 100; ++s) {
    scene.touch({pusher.pushes(force)});
    EXPECT_LT((way_of(scene) - 1e-4 * s * Vector3d(0.6, 0.8, 0)).norm(), 1e-9);
    EXPECT_EQ(state_of(scene).condition, PALPATE_GIVEN_FORCE_FREE);
  }
  scene.touch({pusher.stands()});
  EXPECT_EQ(way_of(scene).norm(), 0) << "a step without a force forgets the way";
  scene.touch({pusher.pushes(Vector3d::Zero())});
  scene.touch({pusher.pushes(Vector3d::Zero())});
  EXPECT_EQ(way_of(scene).norm(), 0) << "no force, no way";
}

TEST(ForceControl, AForceThatJumpsIsReachedNoFasterThanTheToolMayGo) {
  TouchedScene scene(box(), pressed_def(PALPATE_CONTACT_POINT, PALPATE_LAW_UNILATERAL));
  Pusher pusher(above_top(1));
  pusher.given.speed = 0.05;
  Vector3d before = Vector3d::Zero();
  bool moves = false;
  for (int s = 0; s < 700; ++s) {
    scene.touch({pusher.pushes({0, 0, s < 100 ? -0.02 : s < 300 ? -0.3 : -0.02})});
    EXPECT_LE((way_of(scene) - before).norm(), 0.05e-3 * (1 + 1e-9)) << s;
    before = way_of(scene);
    if (state_of(scene).condition == PALPATE_GIVEN_FORCE_MOVES) {
      moves = true;
      EXPECT_TRUE(scene.flags & PALPATE_STEP_MOTION_LIMITED) << s;
    }
  }
  EXPECT_TRUE(moves);
  EXPECT_LT(missed_across(scene), 1e-6);
  EXPECT_NEAR(state_of(scene).force[2], -0.02, 1e-4);
}

TEST(ForceControl, SeveralToolsPressBesideOneThatStands) {
  for (const auto law : kEveryLaw) {
    TouchedScene scene(box(), pressed_def(PALPATE_CONTACT_POINT, law));
    Pusher first({Vector3d(0.042, 0.021, 0.0402)}), second({Vector3d(0.050, 0.026, 0.0402)});
    const Pusher stands({Vector3d(0.046, 0.036, 0.0405)});
    for (int s = 0; s < 200; ++s) {
      const double share = std::min(1.0, s / 100.0);
      scene.touch({first.pushes({0, 0, -0.1 * share}), second.pushes({0, 0, -0.06 * share}),
                   stands.moved({0, 0, -0.006 * share}).stands()});
    }
    EXPECT_EQ(scene.flags, 0u) << law;
    const bool frictionless = law == PALPATE_LAW_SLIDING || law == PALPATE_LAW_UNILATERAL;
    for (int t = 0; t < 2; ++t) {
      EXPECT_LT(missed_across(scene, t), 1e-6) << law;
      EXPECT_LT(frictionless ? 0 : Vector3d(state_of(scene, t).missed).norm(), 1e-6) << law;
      EXPECT_NEAR(state_of(scene, t).force[2], t == 0 ? -0.1 : -0.06, 0.005) << law;
    }
    EXPECT_GT(scene.force(2)[2], 0) << law;
  }
}

TEST(ForceControl, GripsPullWithTheForceAlongTheAxesThatTheyHold) {
  TouchedScene scene(box(), pressed_def(PALPATE_CONTACT_NODE, PALPATE_LAW_STICKING));
  palpate_grip grip = grip_at_node(box().touchable[20], Vector3d::Zero(), 5);
  palpate_given_force given = palpate_default_given_force();
  Eigen::Map<Vector3d>(given.force) = Vector3d(0.02, 0.05, 0.04);
  palpate_tool tool = grip_tool(&grip);
  tool.parts = &given.part;
  for (int s = 0; s < 50; ++s) scene.touch({tool});
  EXPECT_EQ(state_of(scene).condition, PALPATE_GIVEN_FORCE_PART);
  EXPECT_LT((Vector3d(state_of(scene).force) - Vector3d(0.02, 0, 0.04)).norm(), 1e-6);
  EXPECT_LT((Vector3d(state_of(scene).missed) - Vector3d(0, 0.05, 0)).norm(), 1e-6);
}

TEST(ForceControl, TurnsWithThePoseAndRestoresToTheBit) {
  const SceneDef def = pressed_def(PALPATE_CONTACT_PATCH, PALPATE_LAW_COULOMB);
  TouchedScene scene(box(), def), other(box(), def), at_rest(box(), def);
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(0.8, Vector3d(1, 2, -1).normalized()));
  const Vector3d where(0.1, -0.3, 0.2), force(0.01, -0.01, -0.1);
  const palpate_pose pose = pose_at(where, turned);
  palpate_scene_set_pose(scene.get(), &pose, nullptr), palpate_scene_set_pose(other.get(), &pose, nullptr);
  Pusher rests(above_top(1)), pusher({where + turned * above_top(1)[0]});
  for (int s = 0; s < 100; ++s) scene.touch({pusher.pushes(turned * force)}), at_rest.touch({rests.pushes(force)});
  EXPECT_LT((turned.conjugate() * way_of(scene) - way_of(at_rest)).norm(), 1e-9);
  EXPECT_LT((turned.conjugate() * Vector3d(state_of(scene).force) - force).norm(), 1e-6);
  restore_from(scene.get(), other.get());
  for (int s = 0; s < 20; ++s) {
    scene.touch({pusher.pushes(1.5 * (turned * force))}), other.touch({pusher.pushes(1.5 * (turned * force))});
    EXPECT_TRUE(scene.has_bytes_of(other)) << s;
    EXPECT_EQ(way_of(scene), way_of(other)) << s;
  }
}

TEST(ForceControl, AForceThatCannotBeIsBadInput) {
  SceneDef def = pressed_def(PALPATE_CONTACT_PATCH, PALPATE_LAW_STICKING);
  def.grasps.grasps = 1;
  Pusher pusher(above_top(1));
  const auto is_bad = [&](const SceneDef& of, const palpate_tool& tool) {
    TouchedScene scene(box(), of);
    return (scene.touch({tool}) & PALPATE_STEP_BAD_INPUT) != 0;
  };
  EXPECT_FALSE(is_bad(def, pusher.pushes({0, 0, -1})));
  for (const double bad : {double{NAN}, double{INFINITY}, 2e6}) EXPECT_TRUE(is_bad(def, pusher.pushes({0, 0, bad})));
  for (const double bad : {double{NAN}, 0.0, -1.0}) {
    pusher.given.speed = bad;
    EXPECT_TRUE(is_bad(def, pusher.pushes({0, 0, -1}))) << bad;
  }
  pusher.given.speed = 0.25;
  palpate_grasp grasp = palpate_default_grasp();
  grasp.triangle = 0, grasp.barycentric[0] = 1, grasp.radius = 0.003;
  palpate_tool both = pusher.pushes({0, 0, -1});
  grasp.part.next = nullptr;
  palpate_add_part(&both.parts, &grasp.part);
  EXPECT_TRUE(is_bad(def, both)) << "a grasp stands where its tool is";
  pusher.given.part.next = nullptr;
  def.force_control.force_control = 0;
  EXPECT_TRUE(is_bad(def, pusher.pushes({0, 0, -1}))) << "no tool of the scene may have a force";
  const TouchedScene without(box(), def);
  EXPECT_EQ(palpate_scene_given_force_state(without.get(), 0), nullptr);
}

// One box lies on another; the tool presses the upper one, and would be inside the lower one where that were asked.
TEST(ForceControl, InAWorldItPressesTheOrganThatItNamesAgainstOthers) {
  for (const auto deformation :
       {PALPATE_DEFORMATION_LINEAR, PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LARGE_BESIDE}) {
    SCOPED_TRACE(deformation);
    SceneDef def = pressed_def(PALPATE_CONTACT_PATCH, PALPATE_LAW_COULOMB, deformation);
    const palpate_pose poses[2] = {pose_at({0, 0, 0}, Eigen::Quaterniond::Identity()),
                                   pose_at({0, 0, 0.0405}, Eigen::Quaterniond::Identity())};
    palpate_world_organ organs[2];
    for (int k = 0; k < 2; ++k) organs[k] = organ_of(box().bundle(), &def, &poses[k]);
    palpate_world_def of = palpate_default_world_def();
    of.organs = organs, of.organ_count = 2, of.max_pairs = 60, of.friction = 0.2;
    of.force_limit = of.force_slew = of.torque_limit = of.torque_slew = INFINITY;
    palpate_world* made = nullptr;
    palpate_error error = {};
    ASSERT_EQ(palpate_world_create(&of, &made, &error), PALPATE_OK) << error.text;
    const WorldPointer world(made);
    WorldContacts contacts(made);
    Pusher pusher({Vector3d(0.045, 0.024, 0.0807)});
    for (int s = 0; s < 300; ++s) {
      palpate_tool tool = pusher.pushes({0, 0, -0.25 * std::min(1.0, s / 150.0)});
      tool.organ = 1;
      palpate_world_touch(made, &tool, 1, 1e-3, contacts.get(), contacts.bytes());
      for (int k = 0; k < 2 && deformation == PALPATE_DEFORMATION_LARGE_BESIDE; ++k)
        for (int i = 0; i < 20 && palpate_scene_deform(palpate_world_scene(made, k)) > 0;) ++i;
    }
    const palpate_given_force_state& state = *palpate_scene_given_force_state(palpate_world_scene(made, 1), 0);
    EXPECT_EQ(state.condition, PALPATE_GIVEN_FORCE_CARRIED);
    EXPECT_NEAR(state.force[2], -0.25, 0.005);
    EXPECT_NEAR(contacts.tool(0).force_raw[2], 0.25, 0.005);
    double pressed = 0;
    for (int i = 0; i < contacts.get()->pair_count; ++i)
      pressed += palpate_world_contacts_pair(contacts.get(), i)->force[2];
    EXPECT_GT(std::fabs(pressed), 0.02) << "the organs press one another";
    EXPECT_EQ(palpate_scene_given_force_state(palpate_world_scene(made, 0), 0)->condition, PALPATE_GIVEN_FORCE_FREE);
  }
}

}  // namespace
}  // namespace palpate::tests
