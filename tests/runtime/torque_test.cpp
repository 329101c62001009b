// The torque on a tool about its reference point, by statics.
#include <Eigen/Geometry>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/played_box.h"
#include "tests/support/relaxation.h"

namespace palpate::tests {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

SceneDef torque_def() {
  SceneDef def = unlimited_def();
  def.torque_limit = def.torque_slew = INFINITY;
  return def;
}

// Three points that press the far face at different depths, and two grips.
struct Instrument {
  Vector3d points[3], reference{0.1, -0.02, 0.07};
  std::vector<palpate_grip> grips;

  explicit Instrument(double depth = 0.001) {
    for (int i = 0; i < 3; ++i) {
      const std::int32_t triangle = tiny_box().far_triangle(3 * i);
      points[i] = tiny_box().place(triangle, {.3, .3, .4}) - depth * (1 + 0.4 * i) * tiny_box().outward(triangle);
    }
    grips.push_back(grip_at_node(tiny_box().touchable[4], {0.0004, -0.0007, 0.001}));
    grips.push_back(grip_at_place(tiny_box().far_triangle(14), {.2, .5, .3}, {0.001, 0.0005, -0.0002}));
  }
  palpate_tool tool() const {
    palpate_tool tool = point_tool(points[0].data(), 3, 0.003);
    tool.grips = grips.data(), tool.grip_count = static_cast<std::int32_t>(grips.size());
    tool.has_torque = 1;
    Eigen::Map<Vector3d>(tool.reference) = reference;
    return tool;
  }
};

struct Result {
  Vector3d force, torque, limited;
  palpate_step_flags flags = 0;
};

Result touch(TouchedScene& scene, const palpate_tool& tool) {
  const palpate_step_flags flags = scene.touch({tool});
  return {scene.force(), scene.torque(), Vector3d(scene.tool().torque), flags};
}

// A first step 3 mm away, so that the points come in from outside.
Result press(TouchedScene& scene, const Instrument& instrument) {
  Instrument above = instrument;
  for (Vector3d& p : above.points) p += 0.005 * tiny_box().outward(tiny_box().far_triangle());
  touch(scene, above.tool());
  const Result result = touch(scene, instrument.tool());
  EXPECT_EQ(scene.tool().contact_count, 5);
  return result;
}

// The same from the contact nodes: a contact's force acts where the tool point is.
Vector3d by_hand(Contacts& contacts, const Instrument& instrument) {
  const Vector3d held[2] = {
      tiny_box().node(tiny_box().touchable[4]) + Vector3d(instrument.grips[0].displacement),
      tiny_box().place(tiny_box().far_triangle(14), {.2, .5, .3}) + Vector3d(instrument.grips[1].displacement)};
  Vector3d sum = Vector3d::Zero();
  for (std::int32_t n = 0; n < contacts->node_count; ++n) {
    const palpate_contact_node& node = contacts.nodes()[n];
    const Vector3d at = node.point < 3 ? instrument.points[node.point] : held[node.point - 3];
    sum -= (at - instrument.reference).cross(Vector3d(node.force));
  }
  return sum;
}

TEST(Torque, IsTheSumOfLeversTimesForces) {
  const Instrument instrument;
  for (const auto contact : kEveryContact)
    for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_COULOMB}) {
      TouchedScene scene(tiny_box(), with(torque_def(), contact, law));
      const Result found = press(scene, instrument);
      const Vector3d expected = by_hand(scene.contacts, instrument);
      EXPECT_GT(expected.norm(), 1e-3);
      EXPECT_LT((found.torque - expected).norm(), 1e-13 * expected.norm() * scene.contacts->node_count) << contact;
      EXPECT_EQ(found.torque, found.limited);
    }
}

// The organ's side of the same contact: the forces act on the nodes below the disc. A patch's weights reproduce a plane, so on a
// flat face both moments agree to rounding, whatever the disc and the mesh.
TEST(Torque, OfADiscEqualsTheMomentOfTheForcesOnTheNodesBelowIt) {
  TouchedScene scene(tiny_box(), torque_def());
  const Vector3d reference(0.02, 0.05, -0.03), d(-0.001, 0.0004, 0.0007);
  for (const double radius : {0.0, 0.002, 0.006, 0.012}) {
    const palpate_grip grip = grip_at_place(tiny_box().far_triangle(9), {.3, .3, .4}, d);
    palpate_tool tool = grip_tool(&grip, 1, radius);
    tool.has_torque = 1;
    Eigen::Map<Vector3d>(tool.reference) = reference;
    const Result found = touch(scene, tool);
    Vector3d moment = Vector3d::Zero(), sum = Vector3d::Zero();
    for (std::int32_t n = 0; n < scene.contacts->node_count; ++n) {
      const palpate_contact_node& node = scene.contacts.nodes()[n];
      moment -= (tiny_box().node(node.node) + d - reference).cross(Vector3d(node.force));
      sum -= Vector3d(node.force);
    }
    EXPECT_LT((found.force - sum).norm(), 1e-13 * sum.norm() * scene.contacts->node_count);
    EXPECT_GT(moment.norm(), 1e-4);
    EXPECT_LT((found.torque - moment).norm(), 1e-11 * moment.norm()) << radius;
  }
}

TEST(Torque, ChangesWithTheReferenceByTheForceTimesTheWay) {
  TouchedScene one(tiny_box(), torque_def()), other(tiny_box(), torque_def());
  Instrument instrument, moved;
  moved.reference += Vector3d(0.3, -0.2, 0.15);
  const Result a = press(one, instrument), b = press(other, moved);
  EXPECT_EQ(a.force, b.force);
  EXPECT_LT((b.torque - a.torque - (instrument.reference - moved.reference).cross(a.force)).norm(),
            1e-13 * (a.torque.norm() + a.force.norm()));
}

TEST(Torque, TurnsWithTheOrganAndTheTool) {
  TouchedScene resting(tiny_box(), torque_def()), turned(tiny_box(), torque_def());
  const Instrument instrument;
  const Quaterniond turn(Eigen::AngleAxisd(1.2, Vector3d(1, 2, -1).normalized()));
  const Vector3d position(0.4, -0.3, 0.2);
  palpate_pose pose = palpate_default_pose();
  Eigen::Map<Vector3d>(pose.position) = position;
  pose.orientation[0] = turn.w(), pose.orientation[1] = turn.x(), pose.orientation[2] = turn.y();
  pose.orientation[3] = turn.z();
  ASSERT_EQ(palpate_scene_set_pose(turned.get(), &pose, nullptr), PALPATE_OK);
  const Result a = press(resting, instrument);
  Result b;
  for (const double above : {0.005, 0.0}) {
    Instrument in_world = instrument;
    for (Vector3d& p : in_world.points)
      p = position + turn * (p + above * tiny_box().outward(tiny_box().far_triangle()));
    in_world.reference = position + turn * instrument.reference;
    b = touch(turned, in_world.tool());
  }
  // Rounding of places of half a metre, times the stiffness of a few nodes of 1e3 N/m each.
  EXPECT_LT((b.force - turn * a.force).norm(), 1e-11);
  EXPECT_LT((b.torque - turn * a.torque).norm(), 1e-12);
  EXPECT_GT(a.torque.norm(), 1e-3);
}

TEST(Torque, OfACoupleRemainsWhereTheForcesCancel) {
  TouchedScene scene(tiny_box(), with(torque_def(), PALPATE_COLLISION_OFF));
  // Opposite displacements whose size is chosen so that the forces along x cancel.
  double ratio = 1, first = 0;
  Result found;
  for (int i = 0; i < 3; ++i) {
    const std::vector<palpate_grip> grips = {
        grip_at_place(tiny_box().far_triangle(2), {.3, .3, .4}, {0.001, 0, 0}, 1),
        grip_at_place(tiny_box().far_triangle(15), {.3, .3, .4}, {-0.001 * ratio, 0, 0}, 1)};
    palpate_tool tool = tool_of(grips);
    tool.disc_radius = 0.002, tool.has_torque = 1;
    found = touch(scene, tool);
    // Both forces are linear in ratio; one secant step is exact.
    if (i == 0) first = found.force[0], ratio = 1.5;
    if (i == 1) ratio = 1 + 0.5 * first / (first - found.force[0]);
  }
  EXPECT_LT(found.force.norm(), 1e-9);
  EXPECT_GT(found.torque.norm(), 1e-4);
}

TEST(Torque, IsLimitedInLengthAndInChange) {
  SceneDef def = torque_def();
  const Instrument instrument;
  TouchedScene unlimited(tiny_box(), def);
  const double whole = press(unlimited, instrument).torque.norm();

  def.torque_limit = 0.5 * whole;
  TouchedScene cut(tiny_box(), def);
  Result result = press(cut, instrument);
  EXPECT_NEAR(result.limited.norm(), 0.5 * whole, 1e-12 * whole);
  EXPECT_LT(result.limited.cross(result.torque).norm(), 1e-12 * whole * whole) << "the direction stays";
  EXPECT_NEAR(result.torque.norm(), whole, 1e-12 * whole);
  EXPECT_TRUE(result.flags & PALPATE_STEP_FORCE_LIMITED);
  EXPECT_EQ(Vector3d(cut.tool().force), result.force) << "the force has limits of its own";

  def.torque_limit = INFINITY, def.torque_slew = 10 * whole;  // a hundredth of it in a step
  TouchedScene slow(tiny_box(), def);
  result = press(slow, instrument);
  Vector3d before = result.limited;
  for (int s = 0; s < 110; ++s) {
    result = touch(slow, instrument.tool());
    EXPECT_LT((result.limited - before).norm(), 0.010001 * whole);
    before = result.limited;
  }
  EXPECT_EQ(result.limited, result.torque);
  EXPECT_EQ(result.flags & PALPATE_STEP_FORCE_LIMITED, 0u);
  for (const double bad : {0.0, -1.0, double(NAN)}) {
    SceneDef wrong = torque_def();
    wrong.torque_limit = bad;
    EXPECT_EQ(refusal_of(tiny_box(), wrong).status, PALPATE_ERROR_ARGUMENT);
    wrong = torque_def(), wrong.torque_slew = bad;
    EXPECT_EQ(refusal_of(tiny_box(), wrong).status, PALPATE_ERROR_ARGUMENT);
  }
}

// A tool at rest: each moment's torque is the same lever times the relaxed force.
TEST(Torque, RelaxesLikeTheForce) {
  TouchedScene scene(tiny_box(), with(torque_def(), relaxation_of({{0.4, 0.01}, {0.3, 0.1}})));
  const palpate_grip grip = grip_at_place(tiny_box().far_triangle(9), {.3, .3, .4}, {-0.001, 0.0004, 0.0007});
  const Vector3d lever = tiny_box().place(tiny_box().far_triangle(9), {.3, .3, .4}) + Vector3d(grip.displacement);
  palpate_tool tool = grip_tool(&grip, 1, 0.003, 1);
  tool.has_torque = 1;
  double first = 0;
  Result result;
  for (int s = 0; s < 200; ++s) {
    result = touch(scene, tool);
    EXPECT_LT((result.torque - lever.cross(result.force)).norm(), 1e-13) << s;
    if (s == 0) first = result.torque.norm();
  }
  EXPECT_LT(result.torque.norm(), 0.5 * first);
  EXPECT_GT(result.torque.norm(), 0.3 * first);
}

// A torque that relaxes and slews, on an organ that moves on by its velocities.
TEST(Torque, AndThePoseAreInASavedState) {
  SceneDef def = torque_def();
  def.relaxation = relaxation_of({{0.5, 0.02}});
  def.torque_slew = 0.05;  // N m/s: 8 of about 20 steps to the whole torque
  TouchedScene saved(tiny_box(), def), restored(tiny_box(), def);
  palpate_pose pose = palpate_default_pose();
  pose.angular_velocity[1] = 0.3;
  ASSERT_EQ(palpate_scene_set_pose(saved.get(), &pose, nullptr), PALPATE_OK);
  const Instrument instrument;
  for (int s = 0; s < 4; ++s) touch(saved, instrument.tool());
  restore_from(saved.get(), restored.get());
  for (int s = 0; s < 4; ++s) {
    const Result one = touch(saved, instrument.tool());
    touch(restored, instrument.tool());
    EXPECT_NE(one.limited, one.torque) << "still slewing";
    ASSERT_TRUE(saved.has_bytes_of(restored)) << s;
  }
  EXPECT_NE(saved.contacts->organ_orientation[2], 0);
}

TEST(Torque, ThatIsNotAskedForIsZeroAndChangesNoBit) {
  TouchedScene with(tiny_box(), torque_def()), without(tiny_box(), torque_def());
  const Instrument instrument;
  palpate_tool silent = instrument.tool();
  silent.has_torque = 0;
  for (int s = 0; s < 3; ++s) {
    touch(with, instrument.tool());
    const Result result = touch(without, silent);
    EXPECT_EQ(result.torque, Vector3d::Zero());
    EXPECT_EQ(result.limited, Vector3d::Zero());
  }
  palpate_tool_state& state = const_cast<palpate_tool_state&>(with.tool());
  EXPECT_NE(Vector3d(state.torque), Vector3d::Zero());
  std::fill_n(state.torque, 3, 0), std::fill_n(state.torque_raw, 3, 0);
  EXPECT_TRUE(with.has_bytes_of(without));
}

TEST(Torque, ThatCannotBeTakenIsBadInput) {
  TouchedScene scene(tiny_box(), torque_def());
  const Instrument instrument;
  for (const double bad : {double(NAN), double(INFINITY), 2e6}) {
    palpate_tool tool = instrument.tool();
    tool.reference[1] = bad;
    EXPECT_EQ(touch(scene, tool).flags, PALPATE_STEP_BAD_INPUT);
  }
  SceneDef def = torque_def();
  def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_NODE;  // no positions are mapped
  TouchedScene blind(tiny_box(), def);
  const palpate_grip grip = grip_at_node(tiny_box().touchable[4], {0.001, 0, 0});
  palpate_tool tool = grip_tool(&grip);
  EXPECT_EQ(touch(blind, tool).flags, 0u);
  tool.has_torque = 1;
  EXPECT_EQ(touch(blind, tool).flags, PALPATE_STEP_BAD_INPUT);
}

}  // namespace
}  // namespace palpate::tests
