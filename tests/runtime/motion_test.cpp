// An organ whose supports move, under pressure and gravity, against the dense body; and against tools that move the opposite way where
// the motion is rigid.
#include <Eigen/Dense>
#include <algorithm>
#include <numbers>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/moved_box.h"
#include "tests/support/box_corridor.h"

namespace palpate::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;
using ::testing::HasSubstr;

const MovedBox& on_one() {
  static const MovedBox shared(false);
  return shared;
}
const MovedBox& on_two() {
  static const MovedBox shared(true);
  return shared;
}

// Plays a scene step by step.
struct Played : TouchedScene {
  explicit Played(const TouchedBody& box, const SceneDef& def = moved_def()) : TouchedScene(box, def) {}
  const palpate_motion_state& state(std::int32_t motion) { return *palpate_scene_motion_state(scene.get(), motion); }
};

// ---- against full solves ---------------------------------------------------------------------------------------------

// The body with its held dofs where the motions bring them, loads of the motions, and grips imposed: K u = f with the reactions of the
// grips. Unknowns: the free dofs without those of the grips.
struct FullSolve {
  VectorXd u, force;  // force: of the grips on the body
};
FullSolve solve_fully(const MovedBox& box, const Vector4d& q, const std::vector<palpate_grip>& grips) {
  const MatrixXd k = box.stiffness();
  VectorXd load = k * box.motions.field * q, u = VectorXd::Zero(k.rows());  // on free dofs the loads of the motions
  std::vector<bool> imposed(box.fixed.begin(), box.fixed.end());
  for (Eigen::Index i = 0; i < k.rows(); ++i)
    if (box.fixed[i]) u[i] = box.motions.field.row(i).dot(q);
  for (const palpate_grip& grip : grips)
    for (int d = 0; d < 3; ++d)
      if (grip.axes >> d & 1u) u[3 * grip.node + d] = grip.displacement[d], imposed[3 * grip.node + d] = true;
  u = solve_imposed(k, imposed, u, load);
  return {u, k * u - load};
}

TEST(Motions, ABreathingOrganUnderAToolAtRestHasTheForcesOfAFullSolveAtEveryPhase) {
  Played played(on_two(), with(moved_def(), PALPATE_COLLISION_OFF, PALPATE_SHAPE_VOLUME));
  // Two nodes that a tool holds, one of them along two axes alone.
  const std::vector<palpate_grip> grips = {grip_at_node(on_two().touchable[20], {-0.002, 0.001, 0}),
                                           grip_at_node(on_two().touchable[9], {0.001, 0, -0.001}, 5)};
  for (int phase = 0; phase < 8; ++phase) {
    const double t = 2 * std::numbers::pi * phase / 8;
    const Vector4d q(0.005 * std::sin(t), 0.05 * std::cos(t), 80 * std::sin(2 * t), 9.81 * std::cos(t));
    set_amounts(played.scene.get(), q);
    ASSERT_EQ(played.hold(grips), 0u) << phase;
    const FullSolve full = solve_fully(on_two(), q, grips);
    Vector3d expected = Vector3d::Zero();
    for (const palpate_grip& grip : grips)
      for (int d = 0; d < 3; ++d)
        if (grip.axes >> d & 1u) expected[d] -= full.force[3 * grip.node + d];
    // Columns and motions are stored in single precision: 6e-8 of displacements, which the stiffness of close nodes makes 1e-5 of forces.
    EXPECT_LT((played.force() - expected).norm(), 1e-5 * (1e-3 + expected.norm())) << phase;
    const auto u = played.shape();
    for (std::size_t i = 0; i < u.size(); ++i)
      ASSERT_NEAR(static_cast<double>(u[i]), full.u[static_cast<Eigen::Index>(i)], 2e-8) << phase << ' ' << i;
    const double swept = on_two().motions.sweep.dot(full.u);
    EXPECT_NEAR(played.state(kFilling).volume, swept, 1e-6 * std::abs(swept) + 1e-14) << phase;
    EXPECT_EQ(played.state(kTurn).amount, q[kTurn]);
    EXPECT_EQ(played.state(kTurn).volume, 0);
  }
}

// Of all nodes, Pa: the stress of displacements [nodes][3].
std::vector<float> stresses(palpate_scene* scene, std::vector<float> u) {
  const auto nodes = static_cast<std::int32_t>(u.size() / 3);
  palpate_shape_out shape = shape_out(u.data(), nullptr, nodes);
  shape.node_count = nodes;
  std::vector<float> stress(2 * u.size());
  palpate_inside_out out = palpate_default_inside_out();
  out.capacity = nodes, out.stresses = stress.data();
  EXPECT_EQ(palpate_scene_inside(scene, &shape, &out), 0u);
  return stress;
}

TEST(Motions, TheStressInsideAnOrganThatMotionsDeformIsThatOfAFullSolve) {
  SceneDef def = with(moved_def(), PALPATE_COLLISION_OFF, PALPATE_SHAPE_VOLUME, PALPATE_INSIDE_ON);
  Played played(on_two(), def);
  const std::vector<palpate_grip> grips = {grip_at_node(on_two().touchable[20], {-0.002, 0.001, 0})};
  const Vector4d q(0.003, 0.05, 80, 9.81);
  set_amounts(played.scene.get(), q);
  ASSERT_EQ(played.hold(grips), 0u);
  const VectorXd full = solve_fully(on_two(), q, grips).u;
  const std::vector<float> found = stresses(played.scene.get(), played.shape());
  const std::vector<float> expected = stresses(played.scene.get(), {full.begin(), full.end()});
  const float most = std::abs(*std::ranges::max_element(expected, {}, [](float x) { return std::abs(x); }));
  ASSERT_GT(most, 100);
  // Displacements agree to 2e-8 m, as above; over a tetrahedron of 10 mm under a bulk modulus of 18 kPa that is 0.1 Pa.
  for (std::size_t i = 0; i < found.size(); ++i) ASSERT_NEAR(found[i], expected[i], 0.1) << i;
}

TEST(Motions, ARigidMotionOfAllSupportsMakesNoStressInside) {
  Played played(on_one(), with(moved_def(), PALPATE_SHAPE_VOLUME, PALPATE_INSIDE_ON));
  set_amounts(played.scene.get(), {0.004, 0, 0, 0});
  ASSERT_EQ(played.touch(), 0u);
  const auto u = played.shape();
  for (std::size_t i = 0; i < u.size(); ++i) ASSERT_NEAR(u[i], i % 3 == 0 ? 0.004 : 0, 1e-8);
  for (const float stress : stresses(played.scene.get(), u))
    ASSERT_LT(std::abs(stress), 0.01);  // rounding of 4 mm: 2e-10 m
}

TEST(Motions, AHeldVolumeHasThePressureOfAFullSolve) {
  Played played(on_two(), with(moved_def(), PALPATE_COLLISION_OFF));
  const std::vector<palpate_grip> grips = {grip_at_node(on_two().touchable[20], {-0.002, 0.001, 0}),
                                           grip_at_node(on_two().touchable[21], {-0.002, 0, 0})};
  const Vector4d q(0.003, 0.02, 0, 5);
  set_amounts(played.scene.get(), q);
  palpate_error error = {};
  constexpr double volume = 3e-6;
  ASSERT_EQ(palpate_scene_hold_volume(played.scene.get(), kFilling, 1, volume, &error), PALPATE_OK) << error.text;
  // In the first step the secant has met it; its tolerance is 1e-7 of the displacement.
  ASSERT_EQ(played.hold(grips), 0u);
  const double pressure = played.state(kFilling).amount;
  EXPECT_NEAR(played.state(kFilling).volume, volume, 1e-5 * volume);
  const FullSolve full = solve_fully(on_two(), Vector4d(q[0], q[1], pressure, q[3]), grips);
  EXPECT_NEAR(on_two().motions.sweep.dot(full.u), volume, 1e-5 * volume);
  // Without the tool another pressure holds the same volume; and it stays when the volume is let go.
  played.touch();
  EXPECT_NE(played.state(kFilling).amount, pressure);
  EXPECT_NEAR(played.state(kFilling).volume, volume, 1e-9 * volume);
  const double last = played.state(kFilling).amount;
  ASSERT_EQ(palpate_scene_hold_volume(played.scene.get(), kFilling, 0, 0, &error), PALPATE_OK);
  played.touch();
  EXPECT_EQ(played.state(kFilling).amount, last);
}

// The contacts' forces on the body and the pressures of a step, on the dense body.
VectorXd solve_under_forces(const MovedBox& box, const MatrixXd& compliance, const Vector4d& q,
                            const palpate_contacts* contacts) {
  VectorXd force = VectorXd::Zero(compliance.rows());
  for (std::int32_t e = 0; e < contacts->node_count; ++e) {
    const palpate_contact_node& node = *palpate_contacts_node(contacts, e);
    force.segment<3>(3 * node.node) += Vector3d(node.force);
  }
  return box.motions.field * q + compliance * force;
}

// Points that stick, slide and release while the volume jumps up and down: the dense body holds the volume under what the step tells, and lies
// where each point that presses is.
TEST(Motions, AHeldVolumeIsMetUnderContactsOfEveryLaw) {
  static const MatrixXd compliance = dense_compliance(box_on_supports(true));
  std::vector<std::int32_t> far;
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(on_two().body.triangles.size()); ++t)
    if (on_two().outward(t)[0] > 0.9) far.push_back(t);
  constexpr double most = 5e-6;  // m^3
  for (const palpate_contact_law law : kEveryLaw)
    for (const palpate_contact_model contact : {PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH}) {
      Played played(on_two(), with(moved_def(), law, contact, PALPATE_REPORT_CONTACTS));
      int pressed = 0, met = 0;
      for (int s = 0; s < 40; ++s) {
        const double volume = most * std::sin(1.7 * s * s);
        ASSERT_EQ(palpate_scene_hold_volume(played.scene.get(), kFilling, 1, volume, nullptr), PALPATE_OK);
        std::vector<Vector3d> points;
        for (std::size_t i = 0; i < 3; ++i) {
          const std::int32_t triangle = far[(3 + 5 * i) % far.size()];
          const double depth = s < 3 ? -0.02 : 0.006 + 0.0018 * static_cast<double>(i);
          points.push_back(on_two().place(triangle, {.3, .3, .4}) - depth * on_two().outward(triangle));
        }
        const double radius = contact == PALPATE_CONTACT_PATCH ? 0.004 : 0;
        const palpate_step_flags flags = played.touch({point_tool(points[0].data(), 3, radius, 0.2)});
        // Discs of the far face reach the held side, and volumes jump.
        ASSERT_EQ(flags & ~(PALPATE_STEP_MOTION_LIMITED | PALPATE_STEP_NOT_TOUCHABLE), 0u)
            << law << ' ' << contact << ' ' << s;
        pressed += played.tool().contact_count > 0;
        const palpate_motion_state& filling = played.state(kFilling);
        const VectorXd full =
            solve_under_forces(on_two(), compliance, {0, 0, filling.amount, 0}, played.contacts.get());
        // Columns and motions are stored in single precision.
        ASSERT_NEAR(on_two().motions.sweep.dot(full), filling.volume, 1e-6 * most) << law << ' ' << contact << ' ' << s;
        if (!(flags & PALPATE_STEP_MOTION_LIMITED)) {
          ASSERT_NEAR(filling.volume, volume, 1e-12 * most) << law << ' ' << contact << ' ' << s;
          ++met;
        }
        const palpate_contact_report* report = palpate_scene_report(played.scene.get());
        for (std::int32_t c = 0; contact == PALPATE_CONTACT_POINT && c < report->contact_count; ++c) {
          const palpate_contact& at = *palpate_report_contact(report, c);
          if (at.state != PALPATE_CONTACT_STICKS) continue;
          Vector3d place = on_two().place(at.triangle, {at.barycentric[0], at.barycentric[1], at.barycentric[2]});
          for (int v = 0; v < 3; ++v)
            place += at.barycentric[v] * full.segment<3>(3 * on_two().body.triangles[at.triangle][v]);
          ASSERT_LT((place - Vector3d(at.tool_point)).norm(), 1e-7) << law << ' ' << s;
        }
      }
      EXPECT_GT(pressed, 30) << law << ' ' << contact;
      EXPECT_GT(met, 30) << law << ' ' << contact;
    }
}

// Under a tool at rest: what holds the volume that is there is the pressure that is there.
TEST(Motions, AVolumeThatBeginsOrCeasesToBeHeldChangesNothing) {
  Played played(on_two(), with(moved_def(), PALPATE_LAW_COULOMB, PALPATE_CONTACT_PATCH));
  const std::int32_t triangle = on_two().far_triangle(5);
  set_amounts(played.scene.get(), {0.002, 0, 60, 3});
  const auto step = [&](int s) {
    const Vector3d p = on_two().place(triangle, {.3, .3, .4}) + Vector3d(0.002, 0, 0) +
                       (0.002 - 1e-4 * std::min(s, 50)) * on_two().outward(triangle);
    return played.press(p, 0.005, 0.4);
  };
  for (int s = 0; s < 120; ++s) step(s);
  const Vector3d force = played.force();
  const palpate_motion_state state = played.state(kFilling);
  ASSERT_GT(force.norm(), 0.05);
  for (const int holds : {1, 0, 1}) {
    ASSERT_EQ(palpate_scene_hold_volume(played.scene.get(), kFilling, holds, state.volume, nullptr), PALPATE_OK);
    for (int s = 0; s < 5; ++s) {
      ASSERT_EQ(step(120) & ~PALPATE_STEP_NOT_TOUCHABLE, 0u);
      // The end of the iterations of the law.
      ASSERT_LT((played.force() - force).norm(), 1e-6 * force.norm()) << holds << ' ' << s;
      ASSERT_NEAR(played.state(kFilling).amount, state.amount, 1e-6 * state.amount) << holds << ' ' << s;
      ASSERT_NEAR(played.state(kFilling).volume, state.volume, 1e-6 * std::abs(state.volume)) << holds << ' ' << s;
    }
  }
}

// ---- rigid motions: an organ that moves against a tool is a tool that moves against the organ -----------------------------

// The organ's held face, and so the whole organ, moves by q along x; the tool stands. Beside it a scene whose tool moves by -q.
TEST(Motions, AnOrganThatMovesAgainstAToolAtRestIsMetLikeAToolThatMoves) {
  for (const palpate_contact_law law : {PALPATE_LAW_STICKING, PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB})
    for (const palpate_contact_model contact : {PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH}) {
      SceneDef def = with(moved_def(), law, contact);
      Played moved(on_one(), def);
      def.motions.motions = 0;
      Played still(on_one(), def);
      const std::int32_t triangle = on_one().far_triangle(5);
      const Vector3d above = on_one().place(triangle, {.3, .3, .4}) + 0.001 * on_one().outward(triangle);
      int in_contact = 0;
      for (int s = 0; s < 400; ++s) {
        const double q = 0.004 * (1 - std::cos(2 * std::numbers::pi * s / 200)) / 2;
        const Vector3d met = above - Vector3d(q, 0, 0);
        set_amounts(moved.scene.get(), {q, 0, 0, 0});
        const double radius = contact == PALPATE_CONTACT_PATCH ? 0.008 : 0;
        const palpate_step_flags flags = moved.press(above, radius, 0.3);
        still.press(met, radius, 0.3);
        ASSERT_EQ(flags, 0u) << s;
        const int here = moved.tool().contact_count, there = still.tool().contact_count;
        ASSERT_EQ(here, there) << "contacts begin and end in the same steps";
        in_contact += here;
        // Both are stored in single precision; what the moved organ holds is the difference of two such numbers.
        EXPECT_LT((moved.force() - still.force()).norm(), 2e-5 * (0.01 + still.force().norm())) << law << ' ' << s;
        if (s % 40 != 7 || here == 0) continue;
        const auto u = moved.shape(), v = still.shape();
        for (std::size_t i = 0; i < u.size(); ++i)
          ASSERT_NEAR(static_cast<double>(u[i]), static_cast<double>(v[i]) + (i % 3 == 0 ? q : 0), 1e-7);
      }
      EXPECT_GT(in_contact, 150) << "most of two breaths of 3 mm depth";
    }
}

TEST(Motions, AToolIsLeftWhereTheOrganGoesAwayAndMetWhereItComesBack) {
  Played played(on_one());
  const std::int32_t triangle = on_one().far_triangle(5);
  const Vector3d p = on_one().place(triangle, {.3, .3, .4}) + 0.001 * on_one().outward(triangle);
  int begun = 0, last = 0;
  for (int s = 0; s < 1000; ++s) {
    const double q = 0.002 * std::sin(2 * std::numbers::pi * s / 250);
    set_amounts(played.scene.get(), {q, 0, 0, 0});
    ASSERT_EQ(played.press(p), 0u);
    const int count = played.tool().contact_count;
    begun += count > last, last = count;
    // 1 mm away at rest: the force is none while the organ is away, and pushes the tool outwards while it presses.
    if (q < 0.0009) {
      EXPECT_EQ(played.force().norm(), 0) << s;
    }
    if (q > 0.0012) {
      EXPECT_GT(played.force()[0], 0) << s;
    }
  }
  EXPECT_EQ(begun, 4);
}

TEST(Motions, AGraspFollowsARigidMotionAsIfTheJawsMovedBack) {
  SceneDef def = moved_def();
  def.contact = PALPATE_CONTACT_PATCH, def.grasps.grasps = 1;
  Played moved(on_one(), def);
  def.motions.motions = 0;
  Played still(on_one(), def);
  for (int s = 0; s < 60; ++s) {
    const double q = 0.004 * std::sin(0.1 * s);
    set_amounts(moved.scene.get(), {q, 0, 0, 0});
    palpate_grasp grasp = palpate_default_grasp();
    grasp.triangle = on_one().far_triangle(14), grasp.radius = 0.006;
    Eigen::Map<Vector3d>(grasp.barycentric) = Vector3d(.3, .3, .4);
    palpate_tool tool = palpate_default_tool();
    tool.parts = &grasp.part;
    // The jaws close where the organ already moves.
    const std::vector<palpate_tool> tools = s < 10 ? std::vector<palpate_tool>{} : std::vector<palpate_tool>{tool};
    grasp.position[0] = 0.001 * s;
    moved.touch(tools);
    grasp.position[0] = 0.001 * s - q;
    still.touch(tools);
    if (tools.empty()) continue;
    const Vector3d f(palpate_scene_grasp_state(moved.scene.get(), 0)->force),
        g(palpate_scene_grasp_state(still.scene.get(), 0)->force);
    EXPECT_LT((f - g).norm(), 0.02 * g.norm() + 0.02) << s;
  }
}

TEST(Motions, QueriesAndTheReportSeeTheOrganWhereTheMotionsBringIt) {
  Played played(on_one(), with(moved_def(), PALPATE_QUERIES_ON, PALPATE_REPORT_CONTACTS));
  const std::int32_t triangle = on_one().far_triangle(5);
  const Vector3d at = on_one().place(triangle, {.3, .3, .4}), out = on_one().outward(triangle);
  set_amounts(played.scene.get(), {0.003, 0, 0, 0});
  ASSERT_EQ(played.touch(), 0u);
  const Vector3d from = at + 0.05 * out, along = -out;
  palpate_surface_hit hit = palpate_default_surface_hit();
  EXPECT_EQ(palpate_scene_cast_ray(played.scene.get(), played.contacts, from.data(), along.data(), 1, &hit), 0u);
  EXPECT_NEAR(hit.distance, 0.047, 1e-8);
  EXPECT_EQ(palpate_scene_cast_ray(played.scene.get(), nullptr, from.data(), along.data(), 1, &hit), 0u);
  EXPECT_NEAR(hit.distance, 0.05, 1e-8);
  // The organ comes against a tool that stands in its way.
  const Vector3d p = at + 0.004 * out;
  for (int s = 0; s < 40; ++s) {
    set_amounts(played.scene.get(), {0.003 + 5e-5 * s, 0, 0, 0});
    played.press(p);
  }
  const palpate_contact_report* report = palpate_scene_report(played.scene.get());
  ASSERT_EQ(report->contact_count, 1);
  const palpate_contact& contact = *palpate_report_contact(report, 0);
  EXPECT_NEAR(contact.gap, 0, 1e-6);
  EXPECT_LT((Vector3d(contact.place) - p).norm(), 1e-6);
  EXPECT_LT(Vector3d(contact.velocity).norm(), 1e-3) << "it sticks: the place stands where the tool does";
}

// ---- limits and bad input ----------------------------------------------------------------------------------------------

TEST(Motions, AJumpIsTakenStepByStepAndSaid) {
  SceneDef def = moved_def();
  def.max_tool_speed = 1;
  Played played(on_one(), def);
  // The first step takes what was set.
  set_amounts(played.scene.get(), {0.02, 0, 0, 0});
  EXPECT_EQ(played.touch(), 0u);
  EXPECT_EQ(played.state(kPiston).amount, 0.02);
  set_amounts(played.scene.get(), {0.02 - 0.0095, 0, 0, 0});
  int limited = 0;
  double last = 0.02;
  for (int s = 0; s < 12; ++s) {
    limited += (played.touch() & PALPATE_STEP_MOTION_LIMITED) != 0;
    EXPECT_LE(std::abs(played.state(kPiston).amount - last), 0.001 * (1 + 1e-9)) << "1 m/s for a millisecond";
    last = played.state(kPiston).amount;
  }
  EXPECT_EQ(limited, 9);
  EXPECT_EQ(last, 0.02 - 0.0095);
  played.reset();
  EXPECT_EQ(played.touch(), 0u) << "after a reset the first step takes them again";
  EXPECT_EQ(played.state(kPiston).amount, 0.02 - 0.0095);
}

TEST(Motions, BadInputIsRefusedAndChangesNothing) {
  Played played(on_one());
  set_amounts(played.scene.get(), {0.001, 0.002, 3, 4});
  palpate_error error = {};
  const auto refused = [&](const double* amounts, std::int32_t count, const char* sentence) {
    EXPECT_EQ(palpate_scene_set_motions(played.scene.get(), amounts, count, &error), PALPATE_ERROR_ARGUMENT);
    EXPECT_THAT(error.text, HasSubstr(sentence));
  };
  const double nan[4] = {0, NAN, 0, 0}, infinite[4] = {INFINITY, 0, 0, 0}, far[4] = {1e7, 0, 0, 0},
               huge[4] = {1e308, 0, 0, 0};
  refused(nullptr, 4, "found 0 amounts");
  refused(nan, 3, "found 3 amounts");
  for (const double* bad : {nan, infinite, far, huge}) refused(bad, 4, "1e6 m");
  const auto held = [&](std::int32_t motion, double volume, const char* sentence) {
    EXPECT_EQ(palpate_scene_hold_volume(played.scene.get(), motion, 1, volume, &error), PALPATE_ERROR_ARGUMENT);
    EXPECT_THAT(error.text, HasSubstr(sentence));
  };
  held(4, 0, "bundle's motions");
  held(-1, 0, "bundle's motions");
  held(kPiston, 0, "of kind PRESSURE");
  held(kFilling, NAN, "a finite volume");
  held(kFilling, 1e30, "a finite volume");
  EXPECT_EQ(played.touch(), 0u);
  EXPECT_EQ(played.state(kPiston).amount, 0.001);
  EXPECT_EQ(played.state(kWeight).amount, 4);
  EXPECT_EQ(palpate_scene_motion_state(played.scene.get(), 4), nullptr);
  EXPECT_EQ(palpate_scene_motion_state(played.scene.get(), -1), nullptr);

  SceneDef def = moved_def();
  def.motions.motions = 0;
  Played without(on_one(), def);
  EXPECT_EQ(palpate_scene_set_motions(without.scene.get(), nan, 4, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, HasSubstr("scene with motions"));
  EXPECT_EQ(palpate_scene_hold_volume(nullptr, 0, 1, 0, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_motion_state(without.scene.get(), 0), nullptr);
}

// The box with a second pressure in the place of its piston, on the same face; V is [[own, common], [common, own]], own `scale` times that of the
// filling and common `share` of own.
TouchedBody box_with_two_pressures(double scale, double share) {
  return TouchedBody(box_on_supports(false), [&](BundleParts& parts) {
    using formats::SectionId;
    add_motions(parts, box_on_supports(false));
    auto rows = parts.get<float>(SectionId::motion_surface);
    const std::size_t numbers = rows.size() / kMotions;
    std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(kFilling * numbers), numbers, rows.begin());
    parts.set(SectionId::motion_surface, parts.sections.at(SectionId::motion_surface).shape, rows);
    auto volume = parts.get<double>(SectionId::motion_volume);
    const auto at = [&](std::size_t row, std::size_t by) -> double& { return volume[row * kMotions + by]; };
    at(kFilling, kFilling) *= scale;
    at(kPiston, kPiston) = at(kFilling, kFilling);
    at(kPiston, kFilling) = at(kFilling, kPiston) = share * at(kFilling, kFilling);
    parts.set(SectionId::motion_volume, {kMotions, kMotions}, volume);
    parts.set(SectionId::motion_kinds, {kMotions}, std::vector<std::int32_t>{4, 2, 4, 5});
  });
}

// Two pressures on one face sweep one volume: V has no inverse, and where each moves the other one more than itself it is of no organ. Whether
// rounding leaves the second pivot at zero depends on the last bits of V, so there are several.
TEST(Motions, AVolumeThatTheHeldOnesDecideIsRefused) {
  constexpr double volume = 1e-7;
  for (const double share : {1.0, 1.5, 1 - 1e-12})
    for (const double scale : {1.0, 1.1, 1.3, 1.7, 1.9, 2.3}) {
      SCOPED_TRACE(testing::Message() << "share " << share << ", scale " << scale);
      const TouchedBody body = box_with_two_pressures(scale, share);
      Played played(body);
      palpate_scene* const scene = played.scene.get();
      palpate_error error = {};
      ASSERT_EQ(palpate_scene_hold_volume(scene, kPiston, 1, volume, &error), PALPATE_OK) << error.text;
      EXPECT_EQ(palpate_scene_hold_volume(scene, kFilling, 1, volume, &error), PALPATE_ERROR_ARGUMENT);
      EXPECT_THAT(error.text, HasSubstr("volume does not follow from those that are held; motion 2"));
      // What was held still is, alone.
      EXPECT_EQ(played.touch(), 0u);
      EXPECT_NEAR(played.state(kPiston).volume, volume, 1e-9 * volume);
      EXPECT_EQ(played.state(kFilling).amount, 0);
      ASSERT_EQ(palpate_scene_hold_volume(scene, kPiston, 0, 0, &error), PALPATE_OK);
      EXPECT_EQ(palpate_scene_hold_volume(scene, kFilling, 1, volume, &error), PALPATE_OK) << error.text;
    }
}

TEST(Motions, ScenesThatCannotMoveAreRefusedWithOneSentence) {
  const auto refusal = [&](const TouchedBody& of, auto change) {
    SceneDef def = moved_def();
    change(def);
    return std::string(refusal_of(of, def).text);
  };
  EXPECT_THAT(refusal(on_one(), [](SceneDef& def) { def.collision = PALPATE_COLLISION_REST; }),
              HasSubstr("collision DEFORMED"));
  EXPECT_THAT(refusal(on_one(), [](SceneDef& def) { def.motions.motions = 2; }), HasSubstr("motions must be 0 or 1"));
  static const TouchedBox plain;
  EXPECT_THAT(refusal(plain, [](SceneDef&) {}), HasSubstr("motion/displacement_surface"));
  const auto damaged = [&](auto change) {
    const TouchedBody body(box_on_supports(false), [&](BundleParts& parts) {
      add_motions(parts, box_on_supports(false));
      change(parts);
    });
    return refusal(body, [](SceneDef& def) { def.shape = PALPATE_SHAPE_VOLUME; });
  };
  using formats::SectionId;
  const auto with_number = [&](SectionId id, std::size_t at, auto number) {
    return damaged([&](BundleParts& parts) {
      auto numbers = parts.get<decltype(number)>(id);
      numbers[at] = number;
      parts.set(id, parts.sections.at(id).shape, numbers);
    });
  };
  EXPECT_THAT(with_number(SectionId::motion_surface, 5, std::numeric_limits<float>::quiet_NaN()),
              HasSubstr("motion/displacement_surface"));
  EXPECT_THAT(with_number(SectionId::motion_interior, 2, std::numeric_limits<float>::infinity()),
              HasSubstr("motion/displacement_interior"));
  EXPECT_THAT(with_number(SectionId::motion_volume, kFilling * kMotions + kFilling, 0.0), HasSubstr("motion/volume"));
  EXPECT_THAT(with_number(SectionId::motion_volume, 3, std::nan("")), HasSubstr("motion/volume"));
  EXPECT_THAT(with_number(SectionId::motion_kinds, 1, std::int32_t{0}), HasSubstr("motion/kinds"));
  EXPECT_THAT(damaged([](BundleParts& parts) { parts.sections.erase(SectionId::motion_interior); }),
              HasSubstr("motion/displacement_interior"));
  EXPECT_THAT(damaged([](BundleParts& parts) { parts.sections.erase(SectionId::motion_volume); }),
              HasSubstr("motion/volume"));
}

TEST(Motions, AreNamedByTheBundle) {
  EXPECT_EQ(palpate_bundle_describe(on_one().bundle()).motion_count, kMotions);
  const char* names[] = {"piston", "turn", "filling", "weight"};
  const palpate_motion_kind kinds[] = {PALPATE_MOTION_PISTON, PALPATE_MOTION_ROTATION, PALPATE_MOTION_PRESSURE,
                                       PALPATE_MOTION_GRAVITY};
  palpate_error error = {};
  for (int m = 0; m < kMotions; ++m) {
    palpate_motion_info info = {};
    ASSERT_EQ(palpate_bundle_motion(on_one().bundle(), m, &info, sizeof info, &error), PALPATE_OK) << error.text;
    EXPECT_STREQ(info.name, names[m]);
    EXPECT_EQ(info.kind, kinds[m]);
  }
  palpate_motion_info info = {};
  EXPECT_EQ(palpate_bundle_motion(on_one().bundle(), kMotions, &info, sizeof info, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_bundle_motion(on_one().bundle(), -1, &info, sizeof info, &error), PALPATE_ERROR_ARGUMENT);
}

TEST(Motions, ContactsWithOtherAmountsThanAScenesAreBadInput) {
  Played played(on_one());
  set_amounts(played.scene.get(), {0.003, 0, 0, 0});
  played.touch();
  palpate_step_flags flags = 0;
  const auto u = played.shape(&flags);
  EXPECT_EQ(flags, 0u);
  EXPECT_FLOAT_EQ(u[0], 0.003f);
  Contacts changed = played.contacts;
  const_cast<double*>(palpate_contacts_amounts(changed.get()))[0] = NAN;
  displacements(played.scene.get(), changed, on_one().body.surface_nodes, &flags);
  EXPECT_EQ(flags, palpate_step_flags{PALPATE_STEP_BAD_INPUT});
  changed = played.contacts;
  changed->amount_count = 3;
  displacements(played.scene.get(), changed, on_one().body.surface_nodes, &flags);
  EXPECT_EQ(flags, palpate_step_flags{PALPATE_STEP_BAD_INPUT});
}

TEST(Motions, ARestoredStateGoesOnWithTheSameBits) {
  SceneDef def = with(moved_def(), PALPATE_LAW_COULOMB, PALPATE_REPORT_CONTACTS);
  Played one(on_two(), def), two(on_two(), def);
  const std::int32_t triangle = on_two().far_triangle(5);
  const Vector3d p = on_two().place(triangle, {.3, .3, .4}) + 0.0005 * on_two().outward(triangle);
  const auto play = [&](Played& played, int s) {
    set_amounts(played.scene.get(), {0.002 * std::sin(0.05 * s), 0.02 * std::sin(0.03 * s), 0, 2});
    played.press(p, 0, 0.3);
  };
  palpate_error error = {};
  ASSERT_EQ(palpate_scene_hold_volume(one.scene.get(), kFilling, 1, 1e-7, &error), PALPATE_OK);
  for (int s = 0; s < 60; ++s) play(one, s);
  restore_from(one.scene.get(), two.scene.get());
  for (int s = 60; s < 120; ++s) {
    play(one, s), play(two, s);
    ASSERT_TRUE(one.has_bytes_of(two)) << s;
  }
}

TEST(Motions, CostNothingWhereTheyAreOff) {
  SceneDef def = moved_def();
  const auto plan_with = plan_of(on_one().scene(def).get());
  def.motions.motions = 0;
  TouchedScene scene(on_one(), def);
  for (const palpate_plan_pass& pass : plan_of(scene.get())) {
    EXPECT_STRNE(pass.name, "motions");
    EXPECT_THAT(pass.sections, testing::Not(HasSubstr("motion/")));
  }
  EXPECT_EQ(plan_of(scene.get()).size() + 1, plan_with.size());
  // The same bytes in memory, and the same bits of scene.contacts step, as on the bundle that has no motions.
  const TouchedBody plain(box_on_supports(false));
  TouchedScene other(plain, def);
  std::uint64_t bytes[2] = {};
  for (const palpate_plan_pass& pass : plan_of(scene.get())) bytes[0] += pass.memory_bytes + pass.mapped_bytes;
  for (const palpate_plan_pass& pass : plan_of(other.get())) bytes[1] += pass.memory_bytes + pass.mapped_bytes;
  EXPECT_EQ(bytes[0], bytes[1]);
  const std::int32_t triangle = on_one().far_triangle(5);
  for (int s = 0; s < 50; ++s) {
    const Vector3d p = on_one().place(triangle, {.3, .3, .4}) + (0.001 - 5e-5 * s) * on_one().outward(triangle);
    const palpate_tool tool = point_tool(p.data());
    scene.touch({tool});
    other.touch({tool});
    other.contacts->bundle = scene.contacts->bundle;
    ASSERT_EQ(std::memcmp(scene.contacts.get(), other.contacts.get(), scene.contacts->used_bytes), 0) << s;
  }
}

}  // namespace
}  // namespace palpate::tests
