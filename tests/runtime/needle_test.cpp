// Needles in the tissue: against dense solves, and the laws of their tip and their shaft.
#include <Eigen/Dense>
#include <algorithm>
#include <cstring>
#include <numbers>

#include "runtime/relaxation/prony_series.h"
#include "studies/coupled/coupled_rows.h"
#include "tests/runtime/asked_scene.h"
#include "tests/runtime/played_box.h"
#include "tests/runtime/world/played_world.h"
#include "tests/support/box_corridor.h"
#include "tests/support/box_motions.h"
#include "tests/support/guarded_memory.h"
#include "tests/support/packed_bundle.h"

namespace palpate::tests {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kRadius = 0.5e-3, kStep = 0.6e-3;

DenseBody pierced_body() {
  return dense_box({.cells = {6, 7, 7}, .poisson = 0.4});
}
const TouchedBody& box() {
  static const TouchedBody shared(pierced_body(),
                                  [](BundleParts& parts) { add_whole_corridor(parts, pierced_body()); });
  return shared;
}

const Vector3d kEntry(0.06, 0.024, 0.019), kInwards(-1, 0, 0);

palpate_needle needle_at(Vector3d tip, Vector3d direction = kInwards) {
  const PlaceOnFace place = place_at(box(), {1, 0, 0}, kEntry);
  palpate_needle needle = palpate_default_needle();
  needle.triangle = place.triangle, needle.radius = kRadius;
  Eigen::Map<Vector3d>(needle.barycentric) = place.weights;
  Eigen::Map<Vector3d>(needle.tip) = tip;
  Eigen::Map<Vector3d>(needle.direction) = direction.normalized();
  return needle;
}

SceneDef piercing_def() {
  SceneDef def = unlimited_def(PALPATE_COLLISION_OFF, PALPATE_CONTACT_POINT, PALPATE_SHAPE_VOLUME);
  def.torque_limit = def.torque_slew = INFINITY, def.needles.needles = 1;
  return def;
}

struct Piercing : TouchedScene {
  explicit Piercing(const SceneDef& def = piercing_def(), const TouchedBody& of = box()) : TouchedScene(of, def) {}
  palpate_step_flags step(const palpate_needle* needle, const std::vector<palpate_grip>& grips = {}) {
    palpate_tool tool = palpate_default_tool();
    tool.id = 3, tool.parts = needle ? &needle->part : nullptr, tool.has_torque = 1;
    Eigen::Map<Vector3d>(tool.reference) = kEntry;
    palpate_tool other = tool_of(grips);
    other.id = 4;
    const palpate_tool tools[] = {tool, other};
    return touch(tools, grips.empty() ? 1 : 2);
  }
  // Drives the needle along its direction from `depth` to `to`, in steps of kStep.
  palpate_step_flags drive(palpate_needle needle, double to) {
    palpate_step_flags raised = 0;
    const double way = to - depth;
    const int steps = std::max(1, static_cast<int>(std::ceil(std::fabs(way) / kStep - 1e-9)));
    for (int i = 1; i <= steps; ++i) {
      const double at = depth + way * i / steps;
      Eigen::Map<Vector3d>(needle.tip) = kEntry + at * Vector3d(needle.direction);
      raised |= step(&needle);
      last = needle;
    }
    depth = to;
    return raised;
  }
  const palpate_needle_state& state() { return *palpate_scene_needle_state(scene.get(), 3); }

  double depth = -2e-3;
  palpate_needle last = {};
};

// ---- against dense solves --------------------------------------------------------------------------------------------

// Places of a needle that is in the tissue at rest on its axis, held across an axis that has moved, beside nodes that are gripped.
struct HeldAcross {
  Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero();
  VectorXd u;
};
HeldAcross hold_across(const std::vector<double>& depths, double tip_depth, Vector3d tip, Vector3d direction,
                       const std::vector<palpate_grip>& grips = {}) {
  const DenseBody dense = pierced_body();
  const MatrixXd c = dense_compliance(dense);
  std::vector<studies::Row> rows;
  std::vector<Vector3d> along, at;
  const Vector3d side = direction.unitOrthogonal(), other = direction.cross(side);
  const auto hold = [&](double depth, double length) {
    const Vector3d x = kEntry + depth * kInwards;
    const studies::PlaceInside place = studies::place_inside(box().body.mesh.nodes, box().body.mesh.tetrahedra, x);
    for (const Vector3d& across : {side, other}) {
      studies::Row& row = rows.emplace_back();
      for (int k = 0; k < 4; ++k) row.add(0, place.node[k], place.weight[k] * across);
      row.target = across.dot(tip - x);
      row.softness = studies::softness_across_shaft(dense.young, dense.poisson, place.edge, kRadius, length);
      along.push_back(across), at.push_back(tip + (depth - tip_depth) * direction);
    }
  };
  hold(tip_depth, 2.5e-3);
  double before = 0;
  for (const double depth : depths) hold(depth, depth - before), before = depth;
  for (const palpate_grip& grip : grips)
    for (int d = 0; d < 3; ++d) {
      studies::Row& row = rows.emplace_back();
      row.add(0, grip.node, Vector3d::Unit(d)), row.target = grip.displacement[d];
    }
  const studies::CoupledAnswer full =
      studies::solve_coupled(rows, {{[&](const MatrixXd& loads) { return MatrixXd(c * loads); }, c.rows()}});
  HeldAcross result;
  for (std::size_t i = 0; i < along.size(); ++i) {
    const Vector3d f = full.force[static_cast<Eigen::Index>(i)] * along[i];
    result.force -= f, result.torque -= (at[i] - kEntry).cross(f);
  }
  result.u = full.u[0];
  return result;
}

// Where Piercing::drive() from its start to 30 mm takes hold: where the tip was in the step before the one in which it goes on, if that is
// 5 mm from the last place.
std::vector<double> depths_of_places() {
  std::vector<double> depths;
  double last = 0, tip = 0;
  for (int i = 1; i <= 54; ++i) {
    const double at = -2e-3 + 32e-3 * i / 54;
    if (at <= 0) continue;
    if (tip - last >= 5e-3) depths.push_back(last = tip);
    tip = i == 4 ? 0 : at;  // in step 4 the tip punctures the surface
  }
  return depths;
}

// A needle without friction and cutting force leaves the tissue at rest while it goes in.
TEST(Needle, WithoutFrictionAndCuttingForceItLeavesTheTissueAtRest) {
  Piercing piercing;
  EXPECT_EQ(piercing.drive(needle_at(kEntry), 0.03), 0u);
  EXPECT_EQ(piercing.state().condition, PALPATE_NEEDLE_CUTS);
  EXPECT_EQ(piercing.state().places, 5);
  EXPECT_NEAR(piercing.state().depth, 0.03, 1e-6);
  EXPECT_LT(piercing.force().norm(), 1e-6);
  for (const float u : piercing.shape()) EXPECT_LT(std::fabs(u), 1e-7f);
}

TEST(Needle, MovedSidewaysAndTiltedItHoldsTheTissueAsADenseSolveDoes) {
  for (const bool gripped : {false, true}) {
    Piercing piercing;
    piercing.drive(needle_at(kEntry), 0.03);
    palpate_needle moved = piercing.last;
    const Vector3d direction = Vector3d(-1, 0.1, -0.05).normalized(),
                   tip = kEntry + 0.03 * kInwards + Vector3d(0, 2e-3, 1e-3);
    Eigen::Map<Vector3d>(moved.tip) = tip, Eigen::Map<Vector3d>(moved.direction) = direction;
    std::vector<palpate_grip> grips;
    if (gripped)
      grips = {grip_at_node(box().touchable[40], {0, 0, 1e-3}), grip_at_node(box().touchable[77], {0, 0, 0})};
    ASSERT_EQ(piercing.step(&moved, grips), 0u);
    const HeldAcross dense = hold_across(depths_of_places(), 0.03, tip, direction, grips);
    // The stored columns are in single precision, and the tip goes on in the tissue where tilting has drawn it back.
    EXPECT_LT((Vector3d(piercing.state().force) - dense.force).norm(), 1e-4 * dense.force.norm()) << gripped;
    EXPECT_LT((Vector3d(piercing.state().torque) - dense.torque).norm(), 1e-4 * dense.torque.norm()) << gripped;
    const std::vector<float> u = piercing.shape();
    for (std::size_t i = 0; i < u.size(); ++i)
      EXPECT_NEAR(u[i], dense.u[static_cast<Eigen::Index>(i)], 1e-4 * dense.u.cwiseAbs().maxCoeff());
  }
}

// The rows of the corridor are stored in single precision beside a surface and an interior of any type.
TEST(Needle, MovesSurfaceAndInteriorInAnyTypeAsInSinglePrecision) {
  const auto field_of = [](const TouchedBody& body) {
    Piercing piercing(piercing_def(), body);
    piercing.drive(needle_at(kEntry), 0.03);
    palpate_needle moved = piercing.last;
    Eigen::Map<Vector3d>(moved.tip) += Vector3d(0, 2e-3, 1e-3);
    piercing.step(&moved);
    return piercing.shape();
  };
  const std::vector<float> expected = field_of(box());
  const float largest = *std::max_element(expected.begin(), expected.end());
  ASSERT_GT(largest, 5e-4f);
  for (const auto store : std::initializer_list<void (*)(BundleParts&)>{
           [](BundleParts& parts) {
             store_interior_as_f16(parts), store_in_blocks(parts, {formats::ElementType::f32, {}});
           },
           store_as_f16}) {
    const TouchedBody halves(pierced_body(), [&](BundleParts& parts) {
      add_whole_corridor(parts, pierced_body());
      store(parts);
    });
    const std::vector<float> found = field_of(halves);
    // Half a unit in the last of the 11 bits of f16, of the columns of some surface nodes about the entry.
    for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-3 * largest) << i;
  }
}

// ---- the laws --------------------------------------------------------------------------------------------------------

TEST(Needle, CutsWithItsCuttingForceAfterItHasPuncturedTheSurface) {
  Piercing piercing;
  palpate_needle needle = needle_at(kEntry);
  needle.puncture_force = 0.05, needle.cutting_force = 0.02;
  double most = 0;
  for (double depth = 0; depth < 0.03; depth += kStep) {
    EXPECT_EQ(piercing.drive(needle, depth), 0u);
    most = std::max(most, piercing.state().tip_force);
    EXPECT_NEAR(piercing.force().dot(kInwards), -piercing.state().tip_force, 1e-9);
  }
  EXPECT_NEAR(most, 0.05, 1e-6);
  EXPECT_EQ(piercing.state().condition, PALPATE_NEEDLE_CUTS);
  EXPECT_NEAR(piercing.state().tip_force, 0.02, 1e-6);
  EXPECT_LT(piercing.state().depth, 0.03);
  EXPECT_GT(piercing.state().depth, 0.02);
  // Held there it does not cut, and keeps its force.
  const double depth = piercing.state().depth;
  piercing.step(&piercing.last), piercing.step(&piercing.last);
  EXPECT_EQ(piercing.state().condition, PALPATE_NEEDLE_INSIDE);
  EXPECT_NEAR(piercing.state().depth, depth, 1e-5);
  EXPECT_NEAR(piercing.state().tip_force, 0.02, 1e-3);
}

// From the first touch on, before it holds a place.
TEST(Needle, PressesAndPiercesWithAForceThatRelaxes) {
  SceneDef def = with(piercing_def(), palpate_default_relaxation_def());
  def.relaxation.terms = 1, def.relaxation.share[0] = 0.5, def.relaxation.time[0] = 0.02;
  PronySeries series;
  ASSERT_TRUE(series.set(def.relaxation));
  PronySeries::Memory memory;
  Piercing relaxing(def), elastic;
  palpate_needle needle = needle_at(kEntry);
  needle.puncture_force = 0.05, needle.cutting_force = 0.02;
  int pressed = 0, pierced = 0;
  while (relaxing.depth < 6e-3) {
    const double to = relaxing.depth + kStep / 4;
    relaxing.drive(needle, to), elastic.drive(needle, to);
    ASSERT_EQ(relaxing.state().condition, elastic.state().condition);
    ASSERT_EQ(relaxing.state().places, 0) << "the first spacing is 5 mm";
    const Vector3d at_once = elastic.force();
    const Vec3 relaxed = series.step(memory, {at_once[0], at_once[1], at_once[2]}, 1e-3);
    pressed += relaxing.state().condition == PALPATE_NEEDLE_PRESSES;
    pierced += relaxing.state().condition == PALPATE_NEEDLE_CUTS;
    EXPECT_LT((relaxing.force() - Vector3d(relaxed.x, relaxed.y, relaxed.z)).norm(), 1e-12) << to;
  }
  EXPECT_GT(pressed, 5);
  EXPECT_GT(pierced, 5);
}

TEST(Needle, FrictionHoldsItsShaftUpToItsLimitBothWays) {
  Piercing piercing;
  palpate_needle needle = needle_at(kEntry);
  needle.friction = 1;  // N/m
  EXPECT_EQ(piercing.drive(needle, 0.03), 0u);
  const palpate_needle_state inwards = piercing.state();
  ASSERT_EQ(inwards.places, 5);
  EXPECT_EQ(inwards.slipping, 5);
  // 1 N/m times the depth of the last place; friction draws the tissue along, so that it lies a little less deep than at rest.
  EXPECT_NEAR(inwards.shaft_force, 0.027, 2e-3);
  EXPECT_NEAR(piercing.force().dot(kInwards), -inwards.shaft_force, 1e-9);
  piercing.drive(needle, 0.0297);
  EXPECT_LT(piercing.state().shaft_force, inwards.shaft_force);
  EXPECT_EQ(piercing.state().condition, PALPATE_NEEDLE_INSIDE);
  piercing.drive(needle, 0.012);
  EXPECT_LT(piercing.state().shaft_force, 0);
  EXPECT_EQ(piercing.state().slipping, piercing.state().places);
  EXPECT_LT(piercing.state().places, 5);
}

TEST(Needle, DrawnOutItLeavesTheTissueAtRestAndEntersAgainWithAnotherId) {
  Piercing piercing;
  palpate_needle needle = needle_at(kEntry);
  needle.friction = 1, needle.cutting_force = 0.01, needle.puncture_force = 0.02;
  piercing.drive(needle, 0.02);
  ASSERT_GT(piercing.state().places, 1);
  piercing.drive(needle, -0.005);
  EXPECT_EQ(piercing.state().condition, PALPATE_NEEDLE_OUTSIDE);
  EXPECT_EQ(piercing.state().places, 0);
  EXPECT_EQ(piercing.force().norm(), 0);
  EXPECT_EQ(piercing.contacts->node_count, 0);
  piercing.drive(needle, 0.02);
  EXPECT_EQ(piercing.state().condition, PALPATE_NEEDLE_OUTSIDE) << "the same piercing does not enter twice";
  needle.id = 1;
  piercing.depth = -1e-3;
  piercing.drive(needle, 0.02);
  EXPECT_EQ(piercing.state().condition, PALPATE_NEEDLE_CUTS);
}

// ---- beside what else moves the organ --------------------------------------------------------------------------------

// All supports of the body move along x, so that it moves with them as it is.
TEST(Needle, InAnOrganWhoseSupportsMoveItFeelsWhatItFeelsWhenItMovesTheOtherWay) {
  const TouchedBody moving(pierced_body(), [](BundleParts& parts) {
    add_whole_corridor(parts, pierced_body()), add_motions(parts, pierced_body());
  });
  SceneDef def = piercing_def();
  def.motions.motions = 1;
  Piercing still(def, moving), moved(def, moving);
  palpate_needle needle = needle_at(kEntry);
  needle.friction = 1, needle.cutting_force = 0.02, needle.puncture_force = 0.05;
  const auto step = [&](double depth, double piston) {
    double amounts[kMotions] = {piston};
    palpate_error error = {};
    ASSERT_EQ(palpate_scene_set_motions(moved.scene.get(), amounts, kMotions, &error), PALPATE_OK) << error.text;
    palpate_needle relative = needle, in_world = needle;
    Eigen::Map<Vector3d>(relative.tip) = kEntry + depth * kInwards;
    Eigen::Map<Vector3d>(in_world.tip) = kEntry + depth * kInwards + Vector3d(piston, 0, 0);
    ASSERT_EQ(still.step(&relative), 0u);
    ASSERT_EQ(moved.step(&in_world), 0u);
    // The fields of the motions are stored in single precision: 1e-9 m of a way of 12 mm, over the compliance of the shaft.
    EXPECT_NEAR((still.force() - moved.force()).norm(), 0, 1e-6) << depth << ' ' << piston;
    EXPECT_NEAR(still.state().depth, moved.state().depth, 1e-7);
    EXPECT_EQ(still.state().condition, moved.state().condition);
  };
  // The needle goes in while the supports swing, stands in the world while they go on, and comes out.
  for (int i = 0; i <= 60; ++i) step(-2.1e-3 + 4e-4 * i, 0.012 * std::sin(0.1 * i));
  const double in_world = 21.9e-3 - 0.012 * std::sin(6.0);
  for (int i = 61; i <= 90; ++i) step(in_world + 0.012 * std::sin(0.1 * i), 0.012 * std::sin(0.1 * i));
  EXPECT_EQ(moved.state().places, still.state().places);
  EXPECT_GT(moved.state().places, 1);
  for (int i = 0; i <= 60; ++i) step(20e-3 - 6e-4 * i, 0.012 * std::sin(9 + 0.1 * i));
  EXPECT_EQ(moved.state().condition, PALPATE_NEEDLE_OUTSIDE);
}

TEST(Needle, InAWorldHasTheBitsThatItHasInTheSceneAlone) {
  const SceneDef def = piercing_def();
  Piercing alone(def);
  const palpate_pose pose = palpate_default_pose();
  SceneDef without = def;
  without.needles.needles = 0, without.collision = PALPATE_COLLISION_REST;
  const palpate_pose aside = pose_at({0.5, 0, 0});
  palpate_error error = {};
  const WorldPointer world =
      world_of({organ_of(box().bundle(), &def, &pose), organ_of(box().bundle(), &without, &aside)}, &error);
  ASSERT_TRUE(world) << error.text;
  WorldContacts contacts(world.get());
  palpate_needle needle = needle_at(kEntry);
  needle.friction = 1, needle.cutting_force = 0.02, needle.puncture_force = 0.05;
  double most = 0;
  for (int i = 0; i <= 120; ++i) {
    const double depth = i <= 60 ? -2e-3 + 4e-4 * i : 22e-3 - 4e-4 * (i - 60);
    Eigen::Map<Vector3d>(needle.tip) = kEntry + depth * kInwards;
    alone.step(&needle);
    palpate_tool tool = palpate_default_tool();
    tool.id = 3, tool.parts = &needle.part, tool.has_torque = 1;
    Eigen::Map<Vector3d>(tool.reference) = kEntry;
    palpate_world_touch(world.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes());
    const palpate_needle_state* state = palpate_scene_needle_state(palpate_world_scene(world.get(), 0), 3);
    ASSERT_TRUE(state);
    EXPECT_EQ(std::memcmp(state, &alone.state(), sizeof *state), 0) << i;
    EXPECT_EQ(Vector3d(contacts.tool(0).force_raw), alone.force()) << i;
    // What the needle does to the organ, by its nodes inside of it, about the world's origin; the tool feels the opposite about its reference.
    const Vector3d on_organ(contacts.state(0).force), torque(contacts.state(0).torque);
    most = std::max(most, alone.force().norm());
    EXPECT_LT((on_organ + alone.force()).norm(), 1e-9 * alone.force().norm() + 1e-12) << i;
    // Places of a needle are its axis' as it stands, and those of nodes are at rest: the force acts within the depth of one from the other.
    EXPECT_LT((torque + alone.torque() + kEntry.cross(alone.force())).norm(), 0.005 * alone.force().norm() + 1e-12)
        << i;
  }
  EXPECT_GT(most, 0.04);
  EXPECT_EQ(palpate_scene_needle_state(palpate_world_scene(world.get(), 1), 3), nullptr);
}

// The field of the contacts is remembered at nodes of the surface; a needle holds nodes inside as well.
TEST(Needle, BesideAToolPointOnTheDeformedSurfaceStaysWithinTheMemoryOfTheScene) {
  GuardedMemory memory;
  SceneDef def = with(piercing_def(), PALPATE_COLLISION_DEFORMED, PALPATE_LAW_UNILATERAL);
  def.allocator = memory.allocator();
  {
    Piercing piercing(def);
    palpate_needle needle = needle_at(kEntry);
    needle.friction = 1, needle.cutting_force = 0.02;
    for (int s = 0; s < 150; ++s) {
      const double depth = -2e-3 + 2e-4 * s, pressed = std::min(3e-3, 1e-4 * s - 4e-3);
      Eigen::Map<Vector3d>(needle.tip) = kEntry + depth * kInwards;
      const Vector3d p(0.06 - pressed, 0.014 + 4e-5 * s, 0.019);
      palpate_tool tools[2] = {palpate_default_tool(), point_tool(p.data())};
      tools[0].id = 3, tools[0].parts = &needle.part, tools[1].id = 4;
      ASSERT_EQ(piercing.touch(tools), 0u);
    }
    EXPECT_EQ(piercing.tool(1).contact_count, 1);
    EXPECT_GT(piercing.state().places, 2);
    EXPECT_EQ(memory.written_outside(), 0);
  }
  EXPECT_EQ(memory.written_outside(), 0);
}

TEST(Needle, WhereTheTipMayNotGoItStaysAndTheStepIsFlagged) {
  Piercing piercing;
  palpate_needle needle = needle_at(kEntry);
  needle.cutting_force = 0.02;
  // The face x = 0 is held: its nodes have no columns, so the corridor ends in front of it.
  const palpate_step_flags flags = piercing.drive(needle, 0.058);
  EXPECT_TRUE(flags & PALPATE_STEP_NOT_TOUCHABLE);
  EXPECT_EQ(piercing.state().condition, PALPATE_NEEDLE_STUCK);
  EXPECT_LE(piercing.state().tip_force, 0.02 * (1 + 1e-6));
  SceneDef def = piercing_def();
  def.needles.needle_places = 2;
  Piercing few(def);
  EXPECT_TRUE(few.drive(needle_at(kEntry), 0.03) & PALPATE_STEP_CONTACTS_DROPPED);
  EXPECT_EQ(few.state().places, 2);
}

// Grips come first. What the needle held in the step before must not answer for rows that it does not have in this one.
TEST(Needle, PlacesForWhichTheGripsLeaveNoRoomBearNothingAndTheStepIsFlagged) {
  SceneDef def = piercing_def();
  def.max_points = 16, def.max_contact_nodes = 48;
  Piercing piercing(def);
  palpate_needle needle = needle_at(kEntry);
  needle.friction = 1, needle.cutting_force = 0.02;
  ASSERT_EQ(piercing.drive(needle, 0.03), 0u);
  ASSERT_EQ(piercing.state().places, 5);
  ASSERT_GT(piercing.state().shaft_force, 0.02);
  std::vector<palpate_grip> grips;
  for (int i = 0; i < 16; ++i) grips.push_back(grip_at_node(box().touchable[5 * i], {2e-3, 1e-3, 1e-3}));
  // 48 nodes: 16 of the grips, 8 of the tip and 20 of the places. With 28, the places have 4.
  ASSERT_EQ(piercing.step(&piercing.last, grips), 0u);
  def.max_contact_nodes = 28;
  Piercing short_of_nodes(def);
  ASSERT_EQ(short_of_nodes.drive(needle, 0.03), 0u);
  const palpate_step_flags flags = short_of_nodes.step(&short_of_nodes.last, grips);
  EXPECT_TRUE(flags & PALPATE_STEP_CONTACTS_DROPPED);
  EXPECT_LE(std::fabs(short_of_nodes.state().shaft_force), needle.friction * 6e-3) << "of one place";
  EXPECT_TRUE(short_of_nodes.force().allFinite());
  EXPECT_EQ(short_of_nodes.state().places, 5);
}

TEST(Needle, BadInputKeepsTheLastGoodNeedle) {
  Piercing piercing;
  piercing.drive(needle_at(kEntry), 0.02);
  for (int field = 0; field < 6; ++field) {
    palpate_needle bad = piercing.last;
    if (field == 0) bad.tip[1] = NAN;
    if (field == 1) bad.direction[0] = 2;
    if (field == 2) bad.radius = 0;
    if (field == 3) bad.friction = -1;
    if (field == 4) bad.spacing = 0;
    if (field == 5) bad.triangle = 1 << 30;
    EXPECT_TRUE(piercing.step(&bad) & PALPATE_STEP_BAD_INPUT) << field;
    EXPECT_EQ(piercing.state().places, 3) << field;
  }
}

TEST(Needle, ASceneWithoutNeedlesMapsNoCorridorAndABundleWithoutACorridorIsRefused) {
  SceneDef def = piercing_def();
  const auto passes_that_map_it = [&def] {
    const ScenePointer scene = box().scene(def);
    return std::ranges::count_if(plan_of(scene.get()), [](const palpate_plan_pass& pass) {
      return std::string(pass.sections).find("corridor") != std::string::npos;
    });
  };
  EXPECT_EQ(passes_that_map_it(), 1);
  const palpate_error error = refusal_of(tiny_box(), def);
  EXPECT_EQ(error.status, PALPATE_ERROR_EFFECT);
  EXPECT_THAT(error.text, ::testing::HasSubstr("[[corridor]]"));
  def.needles.needles = 0;
  EXPECT_EQ(passes_that_map_it(), 0);
}

TEST(Needle, ASavedStateGoesOnWithTheSameBits) {
  Piercing one, two;
  palpate_needle needle = needle_at(kEntry);
  needle.friction = 2, needle.cutting_force = 0.01;
  one.drive(needle, 0.017);
  restore_from(one.scene.get(), two.scene.get());
  two.depth = one.depth;
  for (Piercing* piercing : {&one, &two}) piercing->drive(needle, 0.024), piercing->drive(needle, 0.02);
  EXPECT_EQ(std::memcmp(&one.state(), &two.state(), sizeof(palpate_needle_state)), 0);
}

}  // namespace
}  // namespace palpate::tests
