// Jaws that hold tissue and turn it: force and torque against dense solves, with the jaws' rows and with every node below the jaws held.
#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "studies/coupled/grasped_rows.h"
#include "tests/runtime/asked_scene.h"
#include "tests/runtime/played_box.h"
#include "tests/support/box_corridor.h"

namespace palpate::tests {
namespace {

using Eigen::AngleAxisd;
using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kRadius = 0.012;

const TinyBox kForm = {.cells = {6, 9, 7}, .poisson = 0.4, .interior = false};
const TouchedBox& box() {
  static const TouchedBox shared(kForm);
  return shared;
}

const Vector3d kMiddle(0.06, 0.024, 0.019);

palpate_grasp grasp_of(const PlaceOnFace& place, Vector3d position = kMiddle, double radius = kRadius) {
  palpate_grasp grasp = palpate_default_grasp();
  grasp.triangle = place.triangle, grasp.radius = radius;
  Eigen::Map<Vector3d>(grasp.barycentric) = place.weights;
  Eigen::Map<Vector3d>(grasp.position) = position;
  return grasp;
}
palpate_grasp grasp_of_the_middle() {
  return grasp_of(place_at(box(), {1, 0, 0}, kMiddle));
}
void move(palpate_grasp& grasp, Vector3d way, Quaterniond turn = Quaterniond::Identity()) {
  Eigen::Map<Vector3d>(grasp.position) += way;
  grasp.orientation[0] = turn.w(), grasp.orientation[1] = turn.x(), grasp.orientation[2] = turn.y();
  grasp.orientation[3] = turn.z();
}

SceneDef grasping_def() {
  SceneDef def = unlimited_def(PALPATE_COLLISION_OFF);
  def.torque_limit = def.torque_slew = INFINITY, def.grasps.grasps = 1;
  return def;
}

struct Grasping : TouchedScene {
  explicit Grasping(const SceneDef& def = grasping_def(), const TouchedBox& of = box()) : TouchedScene(of, def) {}
  palpate_step_flags step(const palpate_grasp* grasp, Vector3d reference = kMiddle,
                          const std::vector<palpate_tool>& others = {}) {
    palpate_tool tool = palpate_default_tool();
    tool.id = 3, tool.parts = grasp ? &grasp->part : nullptr, tool.has_torque = 1;
    Eigen::Map<Vector3d>(tool.reference) = reference;
    std::vector<palpate_tool> tools = others;
    for (std::size_t i = 0; i < tools.size(); ++i) tools[i].id = 10 + static_cast<std::int32_t>(i);
    tools.insert(tools.begin(), tool);
    return touch(tools);
  }
  const palpate_grasp_state& state() { return *palpate_scene_grasp_state(scene.get(), 3); }
};

// Every node of the face within kRadius of the middle held at the rigid motion; the force and the torque about the moved middle that
// the tool then feels.
struct Held {
  Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero();
};
Held all_nodes_held(Vector3d way, Quaterniond turn) {
  static const MatrixXd stiffness = box().stiffness();
  VectorXd u = VectorXd::Zero(box().dofs());
  std::vector<bool> is_held(box().fixed.begin(), box().fixed.end());
  std::vector<std::int32_t> nodes;
  for (std::int32_t n = 0; n < box().body.surface_nodes; ++n) {
    const Vector3d x = box().node(n) - kMiddle;
    if (std::fabs(x[0]) > 1e-9 || x.norm() > kRadius) continue;
    nodes.push_back(n);
    u.segment<3>(3 * n) = turn * x - x + way;
    for (int d = 0; d < 3; ++d) is_held[3 * n + d] = true;
  }
  const VectorXd f = stiffness * solve_imposed(stiffness, is_held, u, VectorXd::Zero(u.size()));
  Held held;
  for (const std::int32_t n : nodes) {
    held.force -= f.segment<3>(3 * n);
    held.torque -= (turn * (box().node(n) - kMiddle)).cross(f.segment<3>(3 * n));
  }
  return held;
}

// A disc that is small against the mesh has the stiffness of a rigid disc on a half-space: 4 G a / (1 - nu) along the normal, 8 G a / (2 - nu)
// across it, 8 G a^3 / (3 (1 - nu)) against a tilt, 16 G a^3 / 3 against a twist (Johnson, Contact Mechanics, sections 3.4 and 5.4;
// Mindlin 1949; Reissner and Sagoci 1944).
TEST(Grasp, OfASmallDiscHasTheStiffnessOfARigidDiscOnAHalfSpace) {
  const double a = 1e-4, nu = 0.4, g = 5400 / (2 * (1 + nu)), angle = 0.05, way = 1e-5;
  const auto held = [&](Vector3d by, Vector3d axis) {
    Grasping grasping;
    palpate_grasp grasp = grasp_of(place_at(box(), {1, 0, 0}, kMiddle), kMiddle, a);
    grasping.step(&grasp);
    move(grasp, by, Quaterniond(AngleAxisd(axis.norm(), axis.norm() > 0 ? axis.normalized() : Vector3d(1, 0, 0))));
    EXPECT_EQ(grasping.step(&grasp), 0u);
    return std::pair(grasping.force(), grasping.torque());
  };
  // The box bends by a thirtieth of what the disc gives way across its normal: 1 N/m against 30 N/m.
  const double within = 0.05;
  const double normal = 4 * g * a / (1 - nu) * way, across = 8 * g * a / (2 - nu) * way,
               tilt = 8 * g * a * a * a / (3 * (1 - nu)) * angle, twist = 16 * g * a * a * a / 3 * angle;
  EXPECT_NEAR(-held({way, 0, 0}, Vector3d::Zero()).first[0], normal, within * normal);
  EXPECT_NEAR(-held({0, way, 0}, Vector3d::Zero()).first[1], across, within * across);
  EXPECT_NEAR(-held({0, 0, 0}, {0, angle, 0}).second[1], tilt, within * tilt);
  EXPECT_NEAR(-held({0, 0, 0}, {0, 0, angle}).second[2], tilt, within * tilt);
  EXPECT_NEAR(-held({0, 0, 0}, {angle, 0, 0}).second[0], twist, within * twist);
}

// A disc that the mesh resolves, one that it does not, and both beside a node that is gripped.
TEST(Grasp, HasForceTorqueAndShapeOfADenseSolveWithItsRows) {
  const MatrixXd c = dense_compliance(dense_box(kForm));
  const studies::CoupledBody body{[&](const MatrixXd& loads) { return MatrixXd(c * loads); }, c.rows()};
  const studies::GraspedSurface surface =
      studies::grasped_surface(box().body.mesh.nodes, box().body.surface_nodes, box().body.triangles, box().touchable);
  const Vector3d way(0.002, -0.001, 0.003);
  const Quaterniond turn(AngleAxisd(0.35, Vector3d(1, 2, -1).normalized()));
  for (const double radius : {kRadius, 0.003})
    for (const bool gripped : {false, true}) {
      palpate_grasp grasp = grasp_of(place_at(box(), {1, 0, 0}, kMiddle), kMiddle, radius);
      studies::GraspedRows disc(surface, *box().bundle(), surface_point_of(grasp.triangle, grasp.barycentric), radius);
      Grasping grasping;
      grasping.step(&grasp);
      move(grasp, way, turn);
      std::vector<palpate_tool> others;
      const palpate_grip grip =
          grip_at_place(place_at(box(), {1, 0, 0}, {0.06, 0.045, 0.03}).triangle, {1, 0, 0}, {0.001, 0.002, 0});
      if (gripped) others = {grip_tool(&grip, 1)};
      EXPECT_EQ(grasping.step(&grasp, kMiddle + way, others), 0u);
      std::vector<studies::Row> rows = disc.rows(kMiddle, way, turn);
      for (int d = 0; gripped && d < 3; ++d) {
        studies::Row& row = rows.emplace_back();
        row.add(0, box().body.triangles[grip.triangle][0], Vector3d::Unit(d));
        row.target = grip.displacement[d];
      }
      const studies::CoupledAnswer full = studies::solve_coupled(rows, {body});
      const studies::GraspedRows::Felt felt = disc.felt(full.force, kMiddle, turn);
      // Columns are stored in single precision, 6e-8, and the shape is given in it.
      EXPECT_LT((grasping.force() - felt.force).norm(), 1e-6 * felt.force.norm()) << radius << " " << gripped;
      EXPECT_LT((grasping.torque() - felt.torque).norm(), 1e-6 * felt.torque.norm()) << radius << " " << gripped;
      const std::vector<float> u = grasping.shape();
      for (std::size_t i = 0; i < u.size(); ++i)
        EXPECT_NEAR(u[i], full.u[0][static_cast<Eigen::Index>(i)], 4e-6 * full.u[0].cwiseAbs().maxCoeff());
    }
}

// On this mesh, whose nodes are 5.6 mm apart, the nodes that are held are a disc of another radius than kRadius, by up to a fifth of that
// distance: force grows with the radius, torque with its cube. (1 + 1.1 / 12)^3 = 1.3. Measured: forces within 6 %, torques within 19 %.
// Against the closed forms of a rigid disc: tests/precompute/grasped_block_test.cpp.
TEST(Grasp, OfADiscHasForceAndTorqueOfASolveWithAllItsNodesHeld) {
  const double angle = 20 * M_PI / 180;
  const struct {
    Vector3d way;
    AngleAxisd turn;
  } moves[] = {{{0.004, 0, 0}, AngleAxisd(0, Vector3d::UnitX())},
               {{0, 0.004, 0}, AngleAxisd(0, Vector3d::UnitX())},
               {{0, 0, 0}, AngleAxisd(angle, Vector3d::UnitX())},
               {{0, 0, 0}, AngleAxisd(angle, Vector3d::UnitY())},
               {{0, 0, 0}, AngleAxisd(angle, Vector3d::UnitZ())},
               {{0.002, -0.001, 0.003}, AngleAxisd(angle, Vector3d(1, 2, -1).normalized())}};
  for (const auto& to : moves) {
    const Quaterniond turn(to.turn);
    Grasping grasping;
    palpate_grasp grasp = grasp_of_the_middle();
    EXPECT_EQ(grasping.step(&grasp), 0u);
    EXPECT_LT(grasping.force().norm(), 1e-12);
    move(grasp, to.way, turn);
    EXPECT_EQ(grasping.step(&grasp, kMiddle + to.way), 0u);
    const Held expected = all_nodes_held(to.way, turn);
    const Vector3d force = grasping.force(), torque = grasping.torque();
    if (to.way.norm() > 0) {
      EXPECT_LT((force - expected.force).norm(), 0.09 * expected.force.norm());
    }
    if (to.turn.angle() > 0) {
      EXPECT_LT((torque - expected.torque).norm(), 0.22 * expected.torque.norm());
    }
  }
}

TEST(Grasp, TorqueAboutAnotherReferenceDiffersByTheForceTimesTheWay) {
  Grasping one, other;
  palpate_grasp grasp = grasp_of_the_middle();
  const Vector3d a = kMiddle, b = kMiddle + Vector3d(0.1, -0.07, 0.2);
  one.step(&grasp, a), other.step(&grasp, b);
  move(grasp, {0.003, 0.001, -0.002}, Quaterniond(AngleAxisd(0.3, Vector3d(1, 1, 0).normalized())));
  one.step(&grasp, a), other.step(&grasp, b);
  EXPECT_EQ(one.force(), other.force());
  EXPECT_GT(one.torque().norm(), 1e-4);
  EXPECT_LT((other.torque() - one.torque() - (a - b).cross(one.force())).norm(), 1e-13 * one.force().norm());
  EXPECT_LT((one.torque() - Vector3d(one.state().torque)).norm(), 1e-13);
  EXPECT_LT((one.force() - Vector3d(one.state().force)).norm(), 1e-12);
}

// Force and torque are the derivative of the energy, which is what keeps a device passive: along a small closed way in position and
// angle the tool does no work.
TEST(Grasp, DoesNoWorkRoundAClosedWay) {
  Grasping grasping;
  palpate_grasp grasp = grasp_of_the_middle();
  grasping.step(&grasp);
  const palpate_grasp at_rest = grasp;
  double work = 0, moved = 0;
  const int steps = 400;
  Vector3d before = kMiddle, force, torque;
  Quaterniond turn_before = Quaterniond::Identity();
  for (int s = 0; s <= steps; ++s) {
    const double phase = 2 * M_PI * s / steps;
    const Vector3d way = 0.003 * Vector3d(std::sin(phase), 1 - std::cos(phase), 0.5 * std::sin(2 * phase));
    const Quaterniond turn(AngleAxisd(0.2 * (1 - std::cos(phase)), Vector3d(1, -1, 2).normalized()));
    grasp = at_rest;
    move(grasp, way, turn);
    const Vector3d at = kMiddle + way, force_before = force, torque_before = torque;
    grasping.step(&grasp, at);
    force = grasping.force(), torque = grasping.torque();
    const AngleAxisd by(turn * turn_before.inverse());
    const double done =
        0.5 * (force + force_before).dot(at - before) + 0.5 * (torque + torque_before).dot(by.angle() * by.axis());
    if (s > 0) work += done, moved += std::fabs(done);
    before = at, turn_before = turn;
  }
  EXPECT_GT(moved, 1e-4);
  // The trapezoidal rule leaves (2 pi / steps)^2 of the work.
  EXPECT_LT(std::fabs(work), 3e-4 * moved);
}

TEST(Grasp, ClosesWithoutAForceWhereverTheTissueIsAndReleasesClean) {
  Grasping grasping;
  const palpate_grip grip =
      grip_at_place(place_at(box(), {1, 0, 0}, {0.06, 0.04, 0.03}).triangle, {.3, .3, .4}, {0.003, 0.002, 0});
  const palpate_tool other = grip_tool(&grip, 1, 0.004);
  palpate_grasp grasp = grasp_of_the_middle();
  grasping.step(nullptr, kMiddle, {other});
  const Vector3d alone = grasping.force(1);
  const auto nodes = grasping.contacts->node_count;
  for (int s = 0; s < 3; ++s) EXPECT_EQ(grasping.step(&grasp, kMiddle, {other}), 0u);
  // Displacements of the last step are those of the single precision of the tensors.
  EXPECT_LT(grasping.force().norm(), 1e-6 * alone.norm());
  EXPECT_EQ(grasping.state().condition, PALPATE_GRASP_HOLDS);
  move(grasp, {0.002, 0, 0});
  grasping.step(&grasp, kMiddle, {other});
  EXPECT_GT(grasping.force().norm(), 0.05);
  grasping.step(nullptr, kMiddle, {other});
  EXPECT_EQ(grasping.force().norm(), 0);
  EXPECT_EQ(grasping.contacts->node_count, nodes);
  EXPECT_EQ(grasping.force(1), alone);
  EXPECT_EQ(grasping.state().condition, PALPATE_GRASP_OPEN);
}

// The jaws open and close in one step: they let go of what they held.
TEST(Grasp, ThatClosesAnewUnderTensionBeginsWithoutAForce) {
  Grasping grasping;
  const palpate_grip grip =
      grip_at_place(place_at(box(), {1, 0, 0}, {0.06, 0.04, 0.03}).triangle, {.3, .3, .4}, {0.003, 0.002, 0});
  const palpate_tool other = grip_tool(&grip, 1, 0.004);
  palpate_grasp grasp = grasp_of_the_middle();
  grasping.step(nullptr, kMiddle, {other});
  grasping.step(&grasp, kMiddle, {other});
  move(grasp, {0.003, 0.001, 0});
  EXPECT_EQ(grasping.step(&grasp, kMiddle, {other}), 0u);
  const double tension = grasping.force().norm();
  ASSERT_GT(tension, 0.2);
  for (int s = 0; s < 3; ++s) {
    grasp.id = 1;
    EXPECT_EQ(grasping.step(&grasp, kMiddle, {other}), 0u);
    EXPECT_EQ(grasping.state().condition, PALPATE_GRASP_HOLDS) << s;
    // Displacements of the last step are those of the single precision of the tensors.
    EXPECT_LT(grasping.force().norm(), 1e-6 * tension) << s;
    EXPECT_LT((Vector3d(grasping.state().place) - kMiddle).norm(), 0.01) << s;
  }
  move(grasp, {0.003, 0.001, 0});
  grasping.step(&grasp, kMiddle, {other});
  // The same way from where the tissue is without a force: the system is linear, its tensors are in single precision.
  EXPECT_NEAR(grasping.force().norm(), tension, 1e-5 * tension);
}

TEST(Grasp, ChangesTheForceThatIsSentByItsSlewWhenItOpens) {
  SceneDef def = grasping_def();
  def.force_slew = 20;
  Grasping grasping(def);
  palpate_grasp grasp = grasp_of_the_middle();
  grasping.step(&grasp);
  move(grasp, {0.004, 0, 0});
  for (int s = 0; s < 100; ++s) grasping.step(&grasp);
  const Vector3d held(grasping.tool().force);
  EXPECT_EQ(held, grasping.force());
  grasping.step(nullptr);
  EXPECT_NEAR((Vector3d(grasping.tool().force) - held).norm(), 0.02, 1e-12);
}

TEST(Grasp, SlipsAtItsFrictionAndLetsGoBeyondItsRadius) {
  Grasping grasping;
  palpate_grasp grasp = grasp_of_the_middle();
  grasp.friction = 0.4, grasp.clamp_force = 1.5;
  grasping.step(&grasp);
  bool slipped = false, gone = false;
  double before = 0;
  for (int s = 0; s < 400 && !gone; ++s) {
    move(grasp, {0.03e-3, 0.05e-3, 0});
    EXPECT_EQ(grasping.step(&grasp), 0u);
    const palpate_grasp_state& state = grasping.state();
    gone = state.condition == PALPATE_GRASP_LET_GO;
    EXPECT_DOUBLE_EQ(state.friction_limit, 0.6);
    EXPECT_LT(grasping.force().norm(), 0.6 * 1.002) << s;
    if (!gone && state.condition == PALPATE_GRASP_SLIPS) {
      // What it slips back is taken from the excess, if nothing but the discs' own compliance held it.
      EXPECT_GT(grasping.force().norm(), 0.6 * 0.9) << s;
      EXPECT_GT(state.slipped, before);
      slipped = true;
    }
    before = state.slipped;
  }
  EXPECT_TRUE(slipped);
  ASSERT_TRUE(gone);
  grasping.step(&grasp);
  EXPECT_EQ(grasping.force().norm(), 0);
  EXPECT_EQ(grasping.contacts->node_count, 0);
  grasp.id = 1;
  grasping.step(&grasp);
  EXPECT_EQ(grasping.state().condition, PALPATE_GRASP_HOLDS);
  EXPECT_EQ(grasping.state().slipped, 0);
}

TEST(Grasp, TellsTheReportWhatBecameOfIt) {
  Grasping grasping(with(grasping_def(), PALPATE_REPORT_CONTACTS));
  palpate_grasp grasp = grasp_of_the_middle();
  grasp.friction = 0.4, grasp.clamp_force = 1.5;
  std::vector<std::pair<int, std::uint64_t>> told;  // kind, step
  const auto step = [&](const palpate_grasp* of) {
    grasping.step(of);
    const palpate_contact_report* report = palpate_scene_report(grasping.scene.get());
    EXPECT_EQ(report->contact_count, 0) << "a grasp is no contact of the report";
    for (std::int32_t e = 0; e < report->event_count; ++e) {
      const palpate_contact_event& event = *palpate_report_event(report, e);
      told.emplace_back(event.kind, report->step);
      EXPECT_EQ(event.tool_id, 3);
      EXPECT_EQ(event.point, -1);
      EXPECT_EQ(event.triangle, grasp.triangle);
      EXPECT_LT((Vector3d(event.place) - kMiddle).norm(), 0.05);
    }
  };
  step(&grasp);
  EXPECT_EQ(told.back().first, PALPATE_EVENT_GRASP_CLOSED);
  step(&grasp);
  for (int s = 0; s < 400 && grasping.state().condition != PALPATE_GRASP_SLIPS; ++s)
    move(grasp, {0.05e-3, 0, 0}), step(&grasp);
  EXPECT_EQ(told.back().first, PALPATE_EVENT_GRASP_SLIPS);
  move(grasp, {-1e-3, 0, 0}), step(&grasp);
  EXPECT_EQ(told.back().first, PALPATE_EVENT_GRASP_HOLDS);
  grasp.id = 1, step(&grasp);
  ASSERT_EQ(told.size(), 5u);
  EXPECT_EQ(told[3].first, PALPATE_EVENT_GRASP_OPENED);
  EXPECT_EQ(told[4].first, PALPATE_EVENT_GRASP_CLOSED) << "it closes anew in the same step";
  for (int s = 0; s < 400 && grasping.state().condition != PALPATE_GRASP_LET_GO; ++s)
    move(grasp, {0.2e-3, 0, 0}), step(&grasp);
  EXPECT_EQ(told.back().first, PALPATE_EVENT_GRASP_LET_GO);
  const std::size_t before = told.size();
  step(&grasp), step(nullptr);
  EXPECT_EQ(told.size(), before) << "what has let go does not open";
  step(&grasp), step(nullptr);
  ASSERT_EQ(told.size(), before + 2);
  EXPECT_EQ(told[before].first, PALPATE_EVENT_GRASP_CLOSED);
  EXPECT_EQ(told[before + 1].first, PALPATE_EVENT_GRASP_OPENED);
  step(&grasp);
  grasping.touch();
  const palpate_contact_report* report = palpate_scene_report(grasping.scene.get());
  ASSERT_EQ(report->event_count, 1) << "a tool that is not sent opens its jaws";
  EXPECT_EQ(palpate_report_event(report, 0)->kind, PALPATE_EVENT_GRASP_OPENED);
}

// A plate between two discs: they press it together, the tool feels nothing of that, and the pressure gives the friction.
TEST(Grasp, OfAFoldPressesItTogetherAndSlipsByItsPressure) {
  const TouchedBox plate({.cells = {6, 6, 2}, .size = {0.06, 0.05, 0.008}, .poisson = 0.4, .interior = false});
  const Vector3d above(0.045, 0.024, 0.008), below(0.045, 0.024, 0);
  palpate_grasp grasp = grasp_of(place_at(plate, {0, 0, 1}, above), above, 0.005);
  const PlaceOnFace opposite = place_at(plate, {0, 0, -1}, below);
  grasp.opposite_triangle = opposite.triangle;
  Eigen::Map<Vector3d>(grasp.opposite_barycentric) = opposite.weights;
  Grasping grasping(grasping_def(), plate);
  grasping.step(&grasp, above);
  grasp.closing = 0.002, grasp.friction = 0.5;
  EXPECT_EQ(grasping.step(&grasp, above), 0u);
  const double limit = grasping.state().friction_limit;
  EXPECT_GT(limit, 0.05);
  EXPECT_LT(grasping.force().norm(), 0.05 * limit) << "the discs press each other, not the tool";
  EXPECT_EQ(grasping.state().condition, PALPATE_GRASP_HOLDS);
  palpate_grasp more = grasp;
  more.closing = 0.003;
  grasping.step(&more, above);
  EXPECT_NEAR(grasping.state().friction_limit, 1.5 * limit, 0.02 * limit) << "linear in the closing";
  for (int s = 0; s < 100 && grasping.state().condition == PALPATE_GRASP_HOLDS; ++s) {
    move(more, {0, 0.3e-3, 0});
    grasping.step(&more, above);
  }
  EXPECT_EQ(grasping.state().condition, PALPATE_GRASP_SLIPS);
  EXPECT_NEAR(grasping.force().norm(), grasping.state().friction_limit, 0.1 * grasping.state().friction_limit);
}

TEST(Grasp, DoesNotDependOnThePoseOfTheOrgan) {
  Grasping resting, turned;
  const Quaterniond turn(AngleAxisd(1.1, Vector3d(1, 2, -1).normalized()));
  const Vector3d position(0.4, -0.3, 0.2);
  palpate_pose pose = palpate_default_pose();
  Eigen::Map<Vector3d>(pose.position) = position;
  pose.orientation[0] = turn.w(), pose.orientation[1] = turn.x(), pose.orientation[2] = turn.y();
  pose.orientation[3] = turn.z();
  ASSERT_EQ(palpate_scene_set_pose(turned.scene.get(), &pose, nullptr), PALPATE_OK);
  const Quaterniond by(AngleAxisd(0.3, Vector3d(0, 1, 1).normalized()));
  palpate_grasp grasp = grasp_of_the_middle(), in_world = grasp;
  Eigen::Map<Vector3d>(in_world.position) = position + turn * kMiddle;
  resting.step(&grasp), turned.step(&in_world, position + turn * kMiddle);
  move(grasp, {0.002, 0.001, 0}, by);
  move(in_world, turn * Vector3d(0.002, 0.001, 0), turn * by * turn.inverse());
  resting.step(&grasp), turned.step(&in_world, position + turn * kMiddle);
  EXPECT_LT((turned.force() - turn * resting.force()).norm(), 1e-10);
  EXPECT_LT((turned.torque() - turn * resting.torque()).norm(), 1e-12);
}

// Also beside a disc, with which it shares what the mesh does not resolve.
TEST(Grasp, GoesOnFromASavedStateWithTheSameBits) {
  Grasping one, other;
  palpate_grasp grasp = grasp_of(place_at(box(), {1, 0, 0}, kMiddle), kMiddle, 0.004);
  grasp.friction = 0.3, grasp.clamp_force = 0.3;
  const PlaceOnFace beside = place_at(box(), {1, 0, 0}, kMiddle + Vector3d(0, 0.001, 0));
  const palpate_grip grip = grip_at_place(beside.triangle, beside.weights, {0.001, 0, 0});
  palpate_tool disc = grip_tool(&grip, 1);
  disc.disc_radius = 0.003;
  one.step(&grasp, kMiddle, {disc});
  for (int s = 0; s < 20; ++s) move(grasp, {0.1e-3, 0.1e-3, 0}), one.step(&grasp, kMiddle, {disc});
  EXPECT_GT(one.state().slipped, 0);
  restore_from(one.scene.get(), other.scene.get());
  for (int s = 0; s < 20; ++s) {
    move(grasp, {0.1e-3, -0.2e-3, 0});
    grasp.id = s / 10;
    one.step(&grasp, kMiddle, {disc}), other.step(&grasp, kMiddle, {disc});
    ASSERT_EQ(std::memcmp(&one.state(), &other.state(), sizeof(palpate_grasp_state)), 0);
    ASSERT_EQ(one.force(), other.force());
  }
}

// Jaws with friction beside something that holds the same tissue fast: a node that is gripped, jaws that do not slip, jaws that slip, too. The
// tissue gives way less than it would for the jaws alone, and a slip as long as for these would throw them back.
TEST(Grasp, SlipsAtItsFrictionBesideWhatHoldsTheSameTissue) {
  enum class Beside { grip, jaws, slipping_jaws };
  for (const Beside beside : {Beside::grip, Beside::jaws, Beside::slipping_jaws})
    for (const auto collision : {PALPATE_COLLISION_OFF, PALPATE_COLLISION_DEFORMED})
      for (const double radius : {0.003, kRadius})
        for (const Vector3d& way : {Vector3d(2e-4, 0, 0), Vector3d(0, 2e-4, 1e-4)}) {
          Grasping grasping(with(grasping_def(), collision));
          const PlaceOnFace place = place_at(box(), {1, 0, 0}, kMiddle);
          palpate_grasp mine = grasp_of(place, kMiddle, radius), its = mine;
          mine.friction = 0.4, mine.clamp_force = 0.5;
          if (beside == Beside::slipping_jaws) its = mine;
          const palpate_grip grip = grip_at_place(place.triangle, place.weights, Vector3d::Zero());
          palpate_tool other = palpate_default_tool();
          if (beside == Beside::grip)
            other = grip_tool(&grip, 1), other.disc_radius = radius;
          else
            other.parts = &its.part;
          grasping.step(&mine, kMiddle, {other});
          int slipped = 0;
          for (int s = 1; s <= 40; ++s) {
            move(mine, way);
            EXPECT_EQ(grasping.step(&mine, kMiddle, {other}), 0u);
            const double limit = grasping.state().friction_limit;
            if (grasping.state().condition == PALPATE_GRASP_LET_GO) break;
            ASSERT_LE(grasping.force().norm(), limit * (1 + 2e-3)) << s;  // twice what section 16 of method.md allows
            slipped += grasping.state().condition == PALPATE_GRASP_SLIPS;
          }
          EXPECT_GT(slipped, 5);
        }
}

// A disc that slips beside the jaws gives way, and the tissue is softer for the jaws than it would be with a disc that held. The slips of a
// step tell by how much.
TEST(Grasp, SlipsAtItsFrictionBesideADiscThatSlips) {
  Grasping grasping(with(grasping_def(), PALPATE_LAW_COULOMB, PALPATE_COLLISION_REST));
  palpate_grasp grasp = grasp_of_the_middle();
  grasp.friction = 0.2, grasp.clamp_force = 0.5;
  int slipped = 0;
  for (int s = 0; s <= 40; ++s) {
    const Vector3d point = kMiddle + Vector3d(s == 0 ? 1e-3 : -1e-4 * s, 0.003 + 1e-4 * s, 0);
    EXPECT_EQ(grasping.step(&grasp, kMiddle, {point_tool(point.data(), 1, 0.004, 0.4)}), 0u) << s;
    if (grasping.state().condition == PALPATE_GRASP_LET_GO) break;
    EXPECT_LE(grasping.force().norm(), grasping.state().friction_limit * (1 + 1e-3)) << s;
    slipped += grasping.state().condition == PALPATE_GRASP_SLIPS;
    move(grasp, {-1e-4, -2e-4, 0});
  }
  EXPECT_GT(slipped, 20);
}

// Jaws with other limits 6 mm apart: when one pair slips, its neighbour gets more.
TEST(Grasp, SlipsTogetherWithOtherJawsThatSlip) {
  int slipped = 0;
  for (const double radius : {0.003, kRadius})
    for (const double friction : {0.1, 0.2, 0.4})
      for (const Vector3d& way : {Vector3d(2e-4, 0, 0), Vector3d(0, 2e-4, 1e-4), Vector3d(-1e-4, -2e-4, 0)}) {
        Grasping grasping;
        palpate_grasp mine = grasp_of(place_at(box(), {1, 0, 0}, kMiddle), kMiddle, radius);
        palpate_grasp its = grasp_of(place_at(box(), {1, 0, 0}, kMiddle + Vector3d(0, 0.006, 0)), kMiddle, radius);
        mine.friction = friction, mine.clamp_force = 0.5, its.friction = 0.7 * friction, its.clamp_force = 0.6;
        palpate_tool other = palpate_default_tool();
        other.parts = &its.part;
        for (int s = 0; s <= 40; ++s) {
          EXPECT_EQ(grasping.step(&mine, kMiddle, {other}), 0u) << s;
          if (grasping.state().condition == PALPATE_GRASP_LET_GO) break;
          ASSERT_LE(grasping.force().norm(), grasping.state().friction_limit * (1 + 1e-3)) << s;
          slipped += grasping.state().condition == PALPATE_GRASP_SLIPS;
          move(mine, way), move(its, 0.7 * way);
        }
      }
  EXPECT_GT(slipped, 300);
}

// Two tools that grasp the same place and draw it apart, and one that is turned round.
TEST(Grasp, AgainstGraspStaysFiniteAndBounded) {
  Grasping grasping;
  palpate_grasp mine = grasp_of_the_middle(), its = grasp_of_the_middle();
  palpate_tool other = palpate_default_tool();
  other.parts = &its.part;
  grasping.step(&mine, kMiddle, {other});
  for (int s = 1; s <= 200; ++s) {
    mine = its = grasp_of_the_middle();
    move(mine, {0.0002 * s, 0, 0.0001 * s}, Quaterniond(AngleAxisd(0.03 * s, Vector3d::UnitX())));
    move(its, {0, -0.0002 * s, 0}, Quaterniond(AngleAxisd(-0.02 * s, Vector3d::UnitY())));
    const palpate_step_flags flags = grasping.step(&mine, kMiddle, {other});
    EXPECT_EQ(flags & ~palpate_step_flags{PALPATE_STEP_REGULARISED}, 0u);
    for (int t = 0; t < 2; ++t) {
      const palpate_tool_state& state = grasping.tool(t);
      ASSERT_TRUE(Vector3d(state.force_raw).allFinite() && Vector3d(state.torque_raw).allFinite());
      // The whole box hangs on a spring of E A / l = 180 N/m: 1,024 times that for each metre is beyond every limit.
      ASSERT_LT(Vector3d(state.force_raw).norm(), 1024 * 180 * 0.05);
    }
  }
}

TEST(Grasp, ThatIsBadKeepsTheLastGoodOne) {
  Grasping grasping;
  const palpate_grasp good = grasp_of_the_middle();
  palpate_grasp moved = good;
  grasping.step(&good);
  move(moved, {0.002, 0, 0});
  EXPECT_EQ(grasping.step(&moved), 0u);
  const Vector3d force = grasping.force();
  const auto bad = [&](const std::function<void(palpate_grasp&)>& change) {
    palpate_grasp grasp = moved;
    change(grasp);
    EXPECT_TRUE(grasping.step(&grasp) & PALPATE_STEP_BAD_INPUT);
    EXPECT_EQ(grasping.force(), force);
  };
  bad([](palpate_grasp& g) { g.radius = 0; });
  bad([](palpate_grasp& g) { g.radius = NAN; });
  bad([](palpate_grasp& g) { g.triangle = -1; });
  bad([](palpate_grasp& g) { g.opposite_triangle = 1 << 24; });
  bad([](palpate_grasp& g) { g.barycentric[1] = 2; });
  bad([](palpate_grasp& g) { g.position[2] = INFINITY; });
  bad([](palpate_grasp& g) { g.orientation[0] = 0.5; });
  bad([](palpate_grasp& g) { g.closing = -1e-3; });
  bad([](palpate_grasp& g) { g.friction = NAN; });
  bad([](palpate_grasp& g) { g.clamp_force = -1; });
  bad([](palpate_grasp& g) { g.part.struct_bytes = 8; });
  SceneDef off = grasping_def();
  off.grasps.grasps = 0;
  Grasping without(off);
  EXPECT_TRUE(without.step(&good) & PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_grasp_state(without.scene.get(), 3), nullptr);
  const palpate_error error = refusal_of(box(), with(grasping_def(), PALPATE_CONTACT_POINT));
  EXPECT_EQ(error.status, PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, testing::HasSubstr("contact PATCH"));
}

}  // namespace
}  // namespace palpate::tests
