// Dead weights and tractions on patches of the surface, against the dense body.
#include <Eigen/Dense>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/moved_box.h"
#include "tests/runtime/world/played_world.h"
#include "tests/support/box_corridor.h"

namespace palpate::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;
using ::testing::HasSubstr;

const Vector3d kFarFace(0.06, 0.025, 0.02);
constexpr double kFarArea = 0.05 * 0.04;  // m^2

SceneDef loaded_def(const Vector3d& centre = kFarFace, double radius = 0.05) {
  SceneDef def = with(moved_def(), PALPATE_COLLISION_OFF, PALPATE_SHAPE_VOLUME);
  def.motions.motions = 0, def.loads.count = 1;
  std::copy_n(centre.data(), 3, def.loads.centre[0]), def.loads.radius[0] = radius;
  return def;
}

// N on each dof: 1 N along `force`, spread over the far face.
VectorXd on_far_face(const TouchedBody& box, const Vector3d& force) {
  VectorXd f = VectorXd::Zero(box.dofs());
  for (std::size_t t = 0; t < box.body.triangles.size(); ++t) {
    const auto& corners = box.body.triangles[t];
    if (box.outward(static_cast<std::int32_t>(t))[0] < 0.99) continue;
    const Vector3d a = box.node(corners[0]), b = box.node(corners[1]), c = box.node(corners[2]);
    for (const auto n : corners) f.segment<3>(3 * n) += (b - a).cross(c - a).norm() / 6 / kFarArea * force;
  }
  return f;
}

// u and the forces of the grips on the body.
struct FullSolve {
  VectorXd u, force;
};
FullSolve solve_fully(const TouchedBody& box, const VectorXd& load, const std::vector<palpate_grip>& grips) {
  const MatrixXd k = box.stiffness();
  VectorXd u = VectorXd::Zero(k.rows());
  std::vector<bool> imposed(box.fixed.begin(), box.fixed.end());
  for (const palpate_grip& grip : grips)
    for (int d = 0; d < 3; ++d) u[3 * grip.node + d] = grip.displacement[d], imposed[3 * grip.node + d] = true;
  u = solve_imposed(k, imposed, u, load);
  return {u, k * u - load};
}

void set_load(TouchedScene& scene, palpate_load_kind kind, const Vector3d& vector) {
  palpate_error error = {};
  ASSERT_EQ(palpate_scene_set_load(scene.get(), 0, kind, vector.data(), &error), PALPATE_OK) << error.text;
}

void expect_field(TouchedScene& scene, const VectorXd& u) {
  const std::vector<float> found = scene.shape();
  // Columns and rows are stored in single precision: 6e-8 of 10 mm, and sums of a hundred of them.
  for (std::size_t i = 0; i < found.size(); ++i) ASSERT_NEAR(found[i], u[static_cast<Eigen::Index>(i)], 2e-8) << i;
}

TEST(SurfaceLoads, ADeadWeightOnAnOrganThatIsTiltedUnderAToolIsAFullSolve) {
  const TouchedBox& box = tiny_box();
  const std::vector<palpate_grip> grips = {grip_at_node(box.touchable[20], {-0.002, 0.001, 0})};
  TouchedScene scene(box, loaded_def());
  const Vector3d weight(0, 0, -0.08);
  set_load(scene, PALPATE_LOAD_FORCE_IN_WORLD, weight);
  for (const double tilt : {0.0, 0.4, 1.3, 3.0}) {
    const Eigen::Quaterniond turned(Eigen::AngleAxisd(tilt, Vector3d(1, 2, -1).normalized()));
    const palpate_pose pose = pose_at({0.1, 0.2, -0.3}, turned);
    ASSERT_EQ(palpate_scene_set_pose(scene.get(), &pose, nullptr), PALPATE_OK);
    for (int s = 0; s < 20; ++s) scene.touch({tool_of(grips)});
    ASSERT_EQ(scene.flags, 0u);
    const Vector3d force = turned.conjugate() * weight;
    const FullSolve full = solve_fully(box, on_far_face(box, force), grips);
    expect_field(scene, full.u);
    const Vector3d on_tool = turned.conjugate() * scene.force();
    EXPECT_LT((on_tool + full.force.segment<3>(3 * grips[0].node)).norm(), 1e-5 * full.force.norm());
    const palpate_load_state& state = *palpate_scene_load_state(scene.get(), 0);
    Vector3d mean;
    for (int d = 0; d < 3; ++d) mean[d] = on_far_face(box, Vector3d::Unit(d)).dot(full.u);
    EXPECT_LT((Vector3d(state.displacement) - turned * mean).norm(), 1e-7);
    EXPECT_LT((Vector3d(state.place) - Vector3d(0.1, 0.2, -0.3) - turned * (kFarFace + mean)).norm(), 1e-7);
    EXPECT_LT((Vector3d(state.force) - weight).norm(), 1e-15);
  }
}

TEST(SurfaceLoads, ATractionIsThatForceOverTheAreaAndTurnsWithTheOrgan) {
  const TouchedBox& box = tiny_box();
  const Vector3d traction(20, -10, 30);
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(0.8, Vector3d(0, 1, 1).normalized()));
  const palpate_pose pose = pose_at({0, 0, 0}, turned);
  for (const auto kind : {PALPATE_LOAD_TRACTION, PALPATE_LOAD_TRACTION_IN_WORLD}) {
    TouchedScene scene(box, loaded_def());
    palpate_scene_set_pose(scene.get(), &pose, nullptr);
    set_load(scene, kind, traction);
    ASSERT_EQ(scene.touch(), 0u);
    const Vector3d on_organ = kind == PALPATE_LOAD_TRACTION ? traction : Vector3d(turned.conjugate() * traction);
    expect_field(scene, solve_fully(box, on_far_face(box, kFarArea * on_organ), {}).u);
    EXPECT_NEAR(palpate_scene_load_state(scene.get(), 0)->area, kFarArea, 1e-12);
  }
}

// A patch of 12 mm radius amid the face: the area of the disc, less what its edge cuts through parts of triangles.
TEST(SurfaceLoads, APatchHasTheAreaOfItsDisc) {
  const TouchedScene scene(tiny_box(), loaded_def({0.06, 0.024, 0.021}, 0.012));
  // Each triangle has 256 parts of 0.7 mm: the edge, 75 mm long, cuts through some 2 % of the disc, about half of it on either side.
  EXPECT_NEAR(palpate_scene_load_state(scene.get(), 0)->area, 3.14159e-6 * 144, 0.01 * 3.14159e-6 * 144);
}

TEST(SurfaceLoads, MotionsAndHeldVolumesCountWhatLoadsSweep) {
  static const MovedBox box(true);
  SceneDef def = loaded_def({0.03, 0.025, 0.04}, 1e-4);
  def.motions.motions = 1;
  TouchedScene scene(box, def);
  set_load(scene, PALPATE_LOAD_FORCE, {0.01, 0.02, -0.05});
  set_amounts(scene.get(), {0.003, 0.02, 0, 5});
  palpate_error error = {};
  constexpr double volume = 3e-6;
  ASSERT_EQ(palpate_scene_hold_volume(scene.get(), kFilling, 1, volume, &error), PALPATE_OK) << error.text;
  ASSERT_EQ(scene.hold({grip_at_node(box.touchable[20], {-0.002, 0.001, 0})}), 0u);
  const palpate_motion_state& state = *palpate_scene_motion_state(scene.get(), kFilling);
  EXPECT_NEAR(state.volume, volume, 1e-5 * volume);
  const std::vector<float> told = scene.shape();
  const VectorXd u = Eigen::Map<const Eigen::VectorXf>(told.data(), box.dofs()).cast<double>();
  EXPECT_NEAR(box.motions.sweep.dot(u), volume, 1e-5 * volume);
  // Let go, and held at what it then is: nothing moves.
  ASSERT_EQ(palpate_scene_hold_volume(scene.get(), kFilling, 0, 0, &error), PALPATE_OK);
  const double pressure = state.amount;
  scene.hold({grip_at_node(box.touchable[20], {-0.002, 0.001, 0})});
  EXPECT_EQ(state.amount, pressure);
  EXPECT_NEAR(state.volume, volume, 1e-5 * volume);
}

// A load that goes round while a tool holds a node: a linear body gives back what it took.
TEST(SurfaceLoads, ALoadThatGoesRoundDoesNoNetWork) {
  TouchedScene scene(tiny_box(), loaded_def());
  const std::vector<palpate_grip> grips = {grip_at_node(tiny_box().touchable[20], {-0.002, 0.001, 0})};
  double work = 0, most = 0;
  Vector3d force = Vector3d::Zero(), moved = force;
  for (int s = 0; s <= 400; ++s) {
    const double at = 2 * 3.14159265358979 * s / 400;
    set_load(scene, PALPATE_LOAD_FORCE, 0.05 * Vector3d(std::sin(at), std::cos(at) - 1, std::sin(2 * at)));
    ASSERT_EQ(scene.hold(grips), 0u);
    const palpate_load_state& state = *palpate_scene_load_state(scene.get(), 0);
    if (s > 0) work += 0.5 * (force + Vector3d(state.force)).dot(Vector3d(state.displacement) - moved);
    force = Vector3d(state.force), moved = Vector3d(state.displacement), most = std::max(most, std::abs(work));
  }
  // The trapezoidal rule is exact for a linear body; displacements are stored in single precision.
  EXPECT_LT(std::abs(work), 1e-6 * most);
}

TEST(SurfaceLoads, ALoadIsTakenNoFasterThanToolsMoveAndStaysFinite) {
  SceneDef def = loaded_def();
  def.max_tool_speed = 0.1;
  TouchedScene scene(tiny_box(), def);
  scene.touch();
  set_load(scene, PALPATE_LOAD_FORCE, {0, 0, -0.2});
  EXPECT_EQ(scene.touch(), PALPATE_STEP_MOTION_LIMITED);
  // 0.1 mm in a step of 1 ms, of the node that moves farthest along one axis.
  const std::vector<float> u = scene.shape();
  EXPECT_LT(std::abs(*std::ranges::max_element(u, {}, [](float x) { return std::abs(x); })), 1.0001e-4);
  for (int s = 0; s < 1000 && scene.touch() != 0; ++s) {
  }
  EXPECT_EQ(scene.flags, 0u);
  EXPECT_EQ(palpate_scene_load_state(scene.get(), 0)->force[2], -0.2);
  // After a reset the first step takes it at once.
  palpate_scene_reset(scene.get());
  EXPECT_EQ(scene.touch(), 0u);
  EXPECT_EQ(palpate_scene_load_state(scene.get(), 0)->force[2], -0.2);
}

TEST(SurfaceLoads, WhatIsNoLoadIsRefused) {
  const auto text_of = [](const SceneDef& def) { return std::string(refusal_of(tiny_box(), def).text); };
  EXPECT_THAT(text_of(with(loaded_def(), PALPATE_COLLISION_REST)), HasSubstr("collision DEFORMED"));
  EXPECT_THAT(text_of(loaded_def({0.2, 0, 0}, 0.01)), HasSubstr("load 0 is farther from the surface"));
  EXPECT_THAT(text_of(loaded_def({0, 0.025, 0.02}, 0.01)), HasSubstr("held"));
  EXPECT_THAT(text_of(loaded_def(kFarFace, 0)), HasSubstr("radii above 0"));
  EXPECT_THAT(text_of(loaded_def({NAN, 0, 0})), HasSubstr("centres"));
  TouchedScene scene(tiny_box(), loaded_def());
  set_load(scene, PALPATE_LOAD_FORCE, {0, 0, -0.1});
  const auto refused = [&](std::int32_t load, int kind, const Vector3d& vector, const char* noun) {
    palpate_error error = {};
    EXPECT_EQ(palpate_scene_set_load(scene.get(), load, static_cast<palpate_load_kind>(kind), vector.data(), &error),
              PALPATE_ERROR_ARGUMENT);
    EXPECT_THAT(error.text, HasSubstr(noun));
  };
  refused(1, 0, {0, 0, 0}, "load 1"), refused(-1, 0, {0, 0, 0}, "load -1"), refused(0, 4, {0, 0, 0}, "kind");
  refused(0, 0, {NAN, 0, 0}, "finite"), refused(0, 0, {1e12, 0, 0}, "1e6 m");
  scene.touch();
  EXPECT_EQ(palpate_scene_load_state(scene.get(), 0)->force[2], -0.1);
  EXPECT_EQ(palpate_scene_load_state(scene.get(), 1), nullptr);
  TouchedScene without(tiny_box(), unlimited_def());
  EXPECT_EQ(palpate_scene_load_state(without.get(), 0), nullptr);
  EXPECT_EQ(palpate_scene_set_load(without.get(), 0, PALPATE_LOAD_FORCE, kFarFace.data(), nullptr),
            PALPATE_ERROR_ARGUMENT);
}

}  // namespace
}  // namespace palpate::tests
