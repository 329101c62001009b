// Rigid surfaces that the organ does not enter, against full solves of the dense body and against Newton's method.
#include <Eigen/Dense>

#include <numbers>
#include <random>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/large/large_scene.h"
#include "tests/runtime/moved_box.h"
#include "tests/runtime/world/played_world.h"
#include "tests/support/box_corridor.h"

namespace palpate::tests {
namespace {

using Eigen::AngleAxisd;
using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;
using ::testing::HasSubstr;

const Vector3d kFarFace(0.06, 0.025, 0.02);

palpate_pose pose_of(const Vector3d& position, const Vector3d& normal) {
  palpate_pose pose = palpate_default_pose();
  const Quaterniond q = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), normal);
  Eigen::Map<Vector3d>(pose.position) = position;
  pose.orientation[0] = q.w(), pose.orientation[1] = q.x(), pose.orientation[2] = q.y(), pose.orientation[3] = q.z();
  return pose;
}

palpate_obstacle plate(const Vector3d& position, const Vector3d& normal, double friction = 0, double size = 0.2) {
  palpate_obstacle plate = palpate_default_obstacle();
  plate.kind = PALPATE_OBSTACLE_RECTANGLE, plate.size[0] = plate.size[1] = size, plate.friction = friction;
  const palpate_pose pose = pose_of(position, normal);
  std::copy_n(pose.position, 3, plate.position), std::copy_n(pose.orientation, 4, plate.orientation);
  return plate;
}

struct Obstructed : SolvedScene {
  Obstructed(const TouchedBody& body, SceneDef def, const std::vector<palpate_obstacle>& list)
      : SolvedScene(body, with_list(def, list)) {}
  static SceneDef with_list(SceneDef def, const std::vector<palpate_obstacle>& list) {
    def.obstacles.count = static_cast<std::int32_t>(list.size()), def.obstacles.list = list.data();
    return def;
  }
  void put(int obstacle, const palpate_pose& pose) {
    palpate_error error = {};
    ASSERT_EQ(palpate_scene_set_obstacle_pose(get(), obstacle, &pose, &error), PALPATE_OK) << error.text;
  }
  const palpate_obstacle_state& state(int obstacle = 0) const { return *palpate_scene_obstacle_state(get(), obstacle); }
  Vector3d force(int obstacle = 0) const { return Vector3d(state(obstacle).force); }
};

SceneDef plain_def() {
  return with(unlimited_def(), PALPATE_COLLISION_DEFORMED, PALPATE_SHAPE_VOLUME);
}

std::vector<std::int32_t> face_nodes(const TouchedBody& body, int axis, double at) {
  std::vector<std::int32_t> nodes;
  for (std::int32_t n = 0; n < body.body.surface_nodes; ++n)
    if (std::abs(body.node(n)[axis] - at) < 1e-9) nodes.push_back(n);
  return nodes;
}

// ---- the linear organ --------------------------------------------------------------------------------------------------

// A platen on the far face: without friction it holds the nodes along x alone, with much friction along all three.
TEST(Obstacles, APlateThatPressesIsAFullSolveSlidingAndWithFriction) {
  const TouchedBox& box = tiny_box();
  for (const double friction : {0.0, 5.0}) {
    Obstructed scene(box, plain_def(), {plate(kFarFace + Vector3d(0.003, 0, 0), {-1, 0, 0}, friction)});
    for (int s = 0; s <= 90; ++s) {
      scene.put(0, pose_of(kFarFace + Vector3d(0.00305 - 1e-4 * s, 0, 0), {-1, 0, 0}));
      ASSERT_EQ(scene.touch(), 0u) << s;
    }
    const MatrixXd k = box.stiffness();
    // With friction each node stays where the first step in which it presses, without friction yet, has brought it along the plate: by 0.05 mm.
    VectorXd u = VectorXd::Zero(k.rows());
    for (const double pressed : {5e-5, 5.95e-3}) {
      std::vector<bool> imposed(box.fixed.begin(), box.fixed.end());
      for (const std::int32_t n : face_nodes(box, 0, 0.06)) {
        u[3 * n] = -pressed, imposed[3 * n] = true;
        if (friction > 0 && pressed > 1e-3) imposed[3 * n + 1] = imposed[3 * n + 2] = true;
      }
      u = solve_imposed(k, imposed, u, VectorXd::Zero(k.rows()));
    }
    const VectorXd force = k * u;
    Vector3d sum = Vector3d::Zero();
    for (const std::int32_t n : face_nodes(box, 0, 0.06)) sum += force.segment<3>(3 * n);
    EXPECT_LT((scene.field() - u).norm(), 1e-3 * u.norm()) << friction;
    EXPECT_LT((scene.force() + sum).norm(), 1e-3 * sum.norm()) << friction << " " << scene.force().transpose();
    EXPECT_LT(scene.state().deepest, 1e-6);
    EXPECT_EQ(scene.state().nodes, static_cast<int>(face_nodes(box, 0, 0.06).size()));
  }
}

// The plate draws the face aside: with much friction as far as it goes, with little by no more than the friction.
TEST(Obstacles, ARetractorDrawsTissueAsideWithItsFriction) {
  const TouchedBox& box = tiny_box();
  const MatrixXd k = box.stiffness();
  for (const double friction : {0.3, 5.0}) {
    Obstructed scene(box, plain_def(), {plate(kFarFace + Vector3d(1e-3, 0, 0), {-1, 0, 0}, friction)});
    VectorXd pressed;
    for (int s = 0; s <= 150; ++s) {
      const Vector3d way(-1e-4 * std::min(s, 50), (friction < 1 ? 1e-4 : 2e-5) * std::max(0, s - 60), 0);
      scene.put(0, pose_of(kFarFace + Vector3d(1e-3, 0, 0) + way, {-1, 0, 0}));
      ASSERT_EQ(scene.touch(), 0u) << s;
      if (s == 60) pressed = scene.field();
    }
    const Vector3d force = scene.force();
    if (friction < 1) {
      EXPECT_EQ(scene.state().slips, scene.state().nodes);
      // Each node slides along the plate, most of them along y.
      EXPECT_NEAR(-force[1], friction * force[0], 0.05 * friction * force[0]);
      // 6 of the 9 mm back: friction opposes that, and does not draw back to where the nodes came to press.
      for (int s = 1; s <= 60; ++s) {
        scene.put(0, pose_of(kFarFace + Vector3d(-4e-3, 9e-3 - 1e-4 * s, 0), {-1, 0, 0}));
        ASSERT_EQ(scene.touch(), 0u) << s;
      }
      EXPECT_GT(scene.force()[1], 0);
      continue;
    }
    EXPECT_EQ(scene.state().slips, 0);
    VectorXd u = VectorXd::Zero(k.rows());
    std::vector<bool> imposed(box.fixed.begin(), box.fixed.end());
    Vector3d sum = Vector3d::Zero();
    for (const std::int32_t n : face_nodes(box, 0, 0.06)) {
      u.segment<3>(3 * n) = pressed.segment<3>(3 * n) + Vector3d(0, 0.0018, 0);
      for (int i = 0; i < 3; ++i) imposed[3 * n + i] = true;
    }
    u = solve_imposed(k, imposed, u, VectorXd::Zero(k.rows()));
    for (const std::int32_t n : face_nodes(box, 0, 0.06)) sum += (k * u).segment<3>(3 * n);
    EXPECT_LT((scene.field() - u).norm(), 1e-3 * u.norm());
    EXPECT_LT((force + sum).norm(), 1e-3 * sum.norm());
  }
}

// What a force f presses against planes u_z >= -gap of some nodes: the active set of a full solve.
VectorXd solve_on_table(const TouchedBody& body, const VectorXd& f, const std::vector<std::int32_t>& nodes, double gap,
                        VectorXd* force) {
  const MatrixXd k = body.stiffness();
  std::vector<bool> presses(nodes.size(), false);
  for (int turn = 0; turn < 50; ++turn) {
    VectorXd u = VectorXd::Zero(k.rows());
    std::vector<bool> imposed(body.fixed.begin(), body.fixed.end());
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (presses[i]) u[3 * nodes[i] + 2] = -gap, imposed[static_cast<std::size_t>(3 * nodes[i] + 2)] = true;
    u = solve_imposed(k, imposed, u, f);
    *force = k * u - f;
    bool changed = false;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const Eigen::Index z = 3 * nodes[i] + 2;
      const bool now = presses[i] ? (*force)[z] > 0 : u[z] < -gap && !body.fixed[static_cast<std::size_t>(z)];
      changed = changed || now != presses[i], presses[i] = now;
    }
    if (!changed) return u;
  }
  throw std::logic_error("no active set");
}

TEST(Obstacles, AnOrganThatItsWeightLaysOnATableIsAFullSolveWithUnilateralRows) {
  static const MovedBox box(false);
  SceneDef def = moved_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.shape = PALPATE_SHAPE_VOLUME;
  for (const double tilt : {0.0, 0.7}) {
    // The table turns with the organ, which lies on it all the same.
    const Quaterniond turn(AngleAxisd(tilt, Vector3d(1, 2, -1).normalized()));
    const palpate_pose pose = pose_at({0.1, 0.2, -0.3}, turn);
    Obstructed scene(box, def, {plate({0, 0, -0.5}, {0, 0, 1})});
    ASSERT_EQ(palpate_scene_set_pose(scene.get(), &pose, nullptr), PALPATE_OK);
    palpate_pose table = pose_at(Vector3d(pose.position) + turn * Vector3d(0.03, 0.02, -0.001), turn);
    scene.put(0, table);
    for (int s = 1; s <= 200; ++s) {
      set_amounts(scene.get(), {0, 0, 0, -0.01 * std::min(s, 150)});
      scene.touch();
    }
    EXPECT_EQ(scene.flags, 0u);
    VectorXd f = VectorXd::Zero(box.dofs()), force;
    for (Eigen::Index z = 2; z < f.size(); z += 3) f[z] = -1.5e-3;
    const std::vector<std::int32_t> bottom = face_nodes(box, 2, 0);
    const VectorXd u = solve_on_table(box, f, bottom, 0.001, &force);
    double sum = 0;
    int pressing = 0;
    for (const std::int32_t n : bottom)
      if (!box.fixed[3 * n + 2]) sum += force[3 * n + 2], pressing += force[3 * n + 2] > 1e-9;
    EXPECT_GT(sum, 0.01);
    EXPECT_GT(pressing, 3);
    EXPECT_EQ(scene.state().nodes, pressing);
    EXPECT_LT((scene.field() - u).norm(), 1e-3 * u.norm());
    EXPECT_LT((turn.conjugate() * scene.force() - Vector3d(0, 0, -sum)).norm(), 1e-3 * sum);
  }
}

// Half a cylinder along y, its axis at the origin.
struct Rib {
  std::vector<float> positions;
  std::vector<std::int32_t> triangles;
  palpate_obstacle at(const Vector3d& place, double radius, double length) {
    constexpr int parts = 16;
    for (int i = 0; i <= parts; ++i)
      for (int end = 0; end < 2; ++end) {
        const double angle = std::numbers::pi * i / parts;
        for (const double x : {radius * std::cos(angle), (end - 0.5) * length, radius * std::sin(angle)})
          positions.push_back(static_cast<float>(x));
      }
    for (std::int32_t i = 0; i < parts; ++i)
      triangles.insert(triangles.end(), {2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 1, 2 * i + 3, 2 * i + 2});
    palpate_obstacle rib = palpate_default_obstacle();
    rib.kind = PALPATE_OBSTACLE_MESH, rib.positions = positions.data(), rib.triangles = triangles.data();
    rib.vertex_count = static_cast<std::int32_t>(positions.size() / 3);
    rib.triangle_count = static_cast<std::int32_t>(triangles.size() / 3);
    std::copy_n(place.data(), 3, rib.position);
    return rib;
  }
};

// The weight draws the box on two ribs of 12 mm radius: no node is in them, and each force is along the rib's radius.
TEST(Obstacles, RibsHoldAPressedOrganOutsideWithForcesAlongTheirRadii) {
  static const MovedBox box(false);
  SceneDef def = moved_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.shape = PALPATE_SHAPE_VOLUME;
  Rib ribs[2];
  const double radius = 0.012;
  const Vector3d axis[2] = {{0.022, 0.025, -0.0125}, {0.055, 0.025, -0.0125}};
  Obstructed scene(box, def, {ribs[0].at(axis[0], radius, 0.1), ribs[1].at(axis[1], radius, 0.1)});
  for (int s = 1; s <= 300; ++s) {
    set_amounts(scene.get(), {0, 0, 0, -0.05 * std::min(s, 150)});
    scene.touch();
  }
  EXPECT_EQ(scene.flags, 0u);
  const VectorXd u = scene.field();
  int pressing = 0;
  for (std::int32_t e = 0; e < scene.contacts->node_count; ++e) {
    const palpate_contact_node& node = scene.contacts.nodes()[e];
    ASSERT_EQ(node.source, PALPATE_SOURCE_OBSTACLE);
    const Vector3d force(node.force), at = box.node(node.node) + u.segment<3>(3 * node.node) - axis[node.index];
    const Vector3d out(at[0], 0, at[2]);
    // Chords of 16 parts lie up to 0.06 mm below the circle.
    EXPECT_GT(out.norm(), radius - 7e-5);
    if (force.norm() < 1e-6) continue;
    ++pressing;
    EXPECT_LT(out.norm(), radius + 1e-5);
    // Between two corners a normal is off by no more than a small part of the 11 degrees from one to the next.
    EXPECT_GT(force.dot(out), 0.9995 * force.norm() * out.norm());
  }
  EXPECT_GE(pressing, 6);
  EXPECT_EQ(pressing, scene.state(0).nodes + scene.state(1).nodes);
}

TEST(Obstacles, WhatIsFarCostsNothing) {
  const TouchedBox& box = tiny_box();
  std::vector<palpate_obstacle> far;
  for (int i = 0; i < PALPATE_MAX_OBSTACLES; ++i) far.push_back(plate({0.03, 0.02, -0.1 - 0.01 * i}, {0, 0, 1}, 0.3));
  Obstructed scene(box, plain_def(), far);
  TouchedScene alone(box, plain_def());
  for (int s = 0; s < 100; ++s) {
    const Vector3d p(0.03, 0.025, 0.041 - 5e-5 * s);
    scene.press(p), alone.press(p);
    EXPECT_EQ(scene.contacts->operations, alone.contacts->operations);
    EXPECT_EQ(scene.contacts->node_count, alone.contacts->node_count);
    EXPECT_EQ(scene.flags, alone.flags);
    EXPECT_EQ((scene.TouchedScene::force() - alone.force()).norm(), 0);
  }
}

// An obstacle that stands in the organ when the scene begins exerts no force, and the organ goes no deeper into it.
TEST(Obstacles, WhatIsInsideAtFirstStaysThereWithoutAForce) {
  const TouchedBox& box = tiny_box();
  Obstructed scene(box, plain_def(), {plate(kFarFace - Vector3d(0.004, 0, 0), {-1, 0, 0})});
  for (int s = 0; s < 10; ++s) scene.touch();
  EXPECT_LT(scene.force().norm(), 1e-12);
  EXPECT_LT(scene.field().norm(), 1e-12);
  for (int s = 0; s <= 10; ++s) {
    scene.put(0, pose_of(kFarFace - Vector3d(0.004 + 1e-4 * s, 0, 0), {-1, 0, 0}));
    scene.touch();
  }
  EXPECT_GT(scene.force()[0], 0.1);
  EXPECT_NEAR(scene.field()[3 * face_nodes(box, 0, 0.06)[0]], -1e-3, 1e-6);
}

// What a plate has lifted stays above its place at rest under a tool that presses it. So the tool's target is against its push, and the account of
// energy has to go by what the tool stores.
TEST(Obstacles, AToolOnTissueThatAPlateHasLiftedFeelsWhatAFullSolveSays) {
  const TouchedBox& box = tiny_box();
  const MatrixXd k = box.stiffness();
  std::int32_t top = -1;
  for (const std::int32_t n : face_nodes(box, 2, 0.04)) {
    const Vector3d middle(0.045, 0.025, 0.04);
    if (top < 0 || (box.node(n) - middle).norm() < (box.node(top) - middle).norm()) top = n;
  }
  for (const palpate_contact_law law : {PALPATE_LAW_UNILATERAL, PALPATE_LAW_SLIDING})
    for (const double friction : {0.0, 5.0}) {
      const Vector3d end(0.06, 0.025, -1e-3);
      Obstructed scene(box, with(plain_def(), PALPATE_CONTACT_NODE, law), {plate(end, {0, 0, 1}, friction, 0.03)});
      for (int s = 0; s <= 60; ++s) {
        scene.put(0, pose_of(end + Vector3d(0, 0, 1e-4 * s), {0, 0, 1}));
        ASSERT_EQ(scene.touch(), 0u) << s;
      }
      const VectorXd lifted = scene.field();
      ASSERT_GT(lifted[3 * top + 2], 1.5e-3);
      Vector3d point;
      for (int s = 0; s <= 60; ++s) {
        point = box.node(top) + lifted.segment<3>(3 * top) + Vector3d(0, 0, 1e-4 - 2e-5 * s);
        ASSERT_EQ(scene.touch({point_tool(point.data())}), 0u) << law << " " << friction << " " << s;
      }
      // The plate holds the nodes that it presses where they are, the tool one more along z.
      VectorXd u = scene.field();
      std::vector<bool> imposed(box.fixed.begin(), box.fixed.end());
      for (std::int32_t e = 0; e < scene.contacts->node_count; ++e)
        if (const palpate_contact_node& node = scene.contacts.nodes()[e]; node.force[2] > 0) {
          imposed[3 * node.node + 2] = true;
          if (friction > 0) imposed[3 * node.node] = imposed[3 * node.node + 1] = true;
        }
      imposed[3 * top + 2] = true, u[3 * top + 2] = point[2] - box.node(top)[2];
      u = solve_imposed(k, imposed, u, VectorXd::Zero(k.rows()));
      const double pushed = -(k.row(3 * top + 2) * u)(0);
      EXPECT_GT(pushed, 0.05);
      EXPECT_NEAR(scene.tool().force_raw[2], pushed, 5e-3 * pushed) << law << " " << friction;
    }
}

TEST(Obstacles, AnEdgeThatComesIntoTheTissueAndAPlateThatMovesFastStayBounded) {
  const TouchedBox& box = tiny_box();
  Obstructed scene(box, plain_def(), {plate({0.1, 0.025, 0.05}, {0, 0, -1}, 0.2, 0.03)});
  double most = 0;
  for (int s = 0; s <= 500; ++s) {
    // 10 mm deep into the side, at 0.2 m/s, then down and back.
    const Vector3d at(0.1 - 2e-4 * std::min(s, 250), 0.025, 0.038 - 1e-4 * std::clamp(s - 250, 0, 60));
    scene.put(0, pose_of(at, {0, 0, -1}));
    scene.touch();
    most = std::max(most, scene.force().norm());
    ASSERT_TRUE(scene.field().allFinite());
  }
  EXPECT_GT(most, 0.1);
  EXPECT_LT(most, 10);
  for (int s = 0; s < 3; ++s) {
    scene.put(0, pose_of({0.5, 0, 0}, {0, 0, -1}));
    scene.touch();
  }
  EXPECT_EQ(scene.field().norm(), 0);
  EXPECT_EQ(scene.state().nodes, 0);
}

// J, stored in the linear organ.
double stored(Obstructed& scene) {
  const VectorXd u = scene.field();
  double sum = 0;
  for (std::int32_t e = 0; e < scene.contacts->node_count; ++e) {
    const palpate_contact_node& node = scene.contacts.nodes()[e];
    sum += 0.5 * Vector3d(node.force).dot(u.segment<3>(3 * node.node));
  }
  return sum;
}

// Plates that wander and turn, with friction: what is stored is at most the work that they have done.
TEST(Obstacles, PlatesThatWanderAtRandomGiveNoEnergyAndLeaveTheOrganAtRest) {
  const TouchedBox& box = tiny_box();
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Vector3d(normal(random), normal(random), normal(random)); };
  Obstructed scene(box, plain_def(), {plate({1, 0, 0}, {-1, 0, 0}, 0.5, 0.04), plate({1, 0, 0}, {0, 0, -1}, 0.1, 0.1)});
  for (int tour = 0; tour < 20; ++tour) {
    const Vector3d away[2] = {kFarFace + Vector3d(0.012, 0, 0), Vector3d(0.04, 0.025, 0.05)};
    const Vector3d in[2] = {{-0.012, 0, 0}, {0, 0, -0.012}};
    Vector3d speed[2], spin[2];
    for (int i = 0; i < 2; ++i) speed[i] = 0.004 * vector(), spin[i] = 0.15 * vector();
    double work = 0, most = 0;
    Vector3d force[2] = {}, torque[2] = {}, place[2] = {}, angle[2] = {};
    for (int s = 0; s <= 500; ++s) {
      const double share = std::sin(std::numbers::pi * s / 500);
      for (int i = 0; i < 2; ++i) {
        const Vector3d now = away[i] + share * in[i] + share * std::sin(0.05 * s) * speed[i];
        const Vector3d turned = share * std::sin(0.03 * s) * spin[i];
        palpate_pose pose = pose_of(now, i == 0 ? Vector3d(-1, 0, 0) : Vector3d(0, 0, -1));
        const Quaterniond q =
            Quaterniond(AngleAxisd(turned.norm(), turned.normalized())) *
            Quaterniond(pose.orientation[0], pose.orientation[1], pose.orientation[2], pose.orientation[3]);
        pose = pose_at(now, q);
        scene.put(i, pose);
        if (s > 0) work += -0.5 * force[i].dot(now - place[i]) - 0.5 * torque[i].dot(turned - angle[i]);
        place[i] = now - place[i], angle[i] = turned - angle[i];
      }
      scene.touch();
      ASSERT_EQ(scene.flags & ~std::uint32_t{PALPATE_STEP_SOLVE_INEXACT}, 0u) << tour << " " << s;
      for (int i = 0; i < 2; ++i) {
        force[i] = scene.force(i), torque[i] = Vector3d(scene.state(i).torque);
        if (s > 0) work += -0.5 * force[i].dot(place[i]) - 0.5 * torque[i].dot(angle[i]);
        place[i] = Vector3d(scene.state(i).position);
        angle[i] = share * std::sin(0.03 * s) * spin[i];
      }
      const double energy = stored(scene);
      most = std::max(most, energy);
      ASSERT_TRUE(std::isfinite(energy));
      // The work is a sum of 500 trapezia.
      EXPECT_LE(energy, work + 0.02 * most + 1e-9) << tour << " " << s;
    }
    EXPECT_GT(most, 1e-4);
    EXPECT_EQ(scene.field().norm(), 0) << tour;
  }
}

TEST(Obstacles, AreRefusedWithWhatIsWrong) {
  const TouchedBox& box = tiny_box();
  const auto text_of = [&](const palpate_obstacle& obstacle, palpate_collision collision = PALPATE_COLLISION_DEFORMED) {
    const SceneDef def = with(plain_def(), collision);
    return std::string(refusal_of(box, Obstructed::with_list(def, {obstacle})).text);
  };
  palpate_obstacle table = plate({0, 0, 0}, {0, 0, 1});
  EXPECT_EQ(text_of(table), "");
  EXPECT_THAT(text_of(table, PALPATE_COLLISION_REST), HasSubstr("collision"));
  table.size[1] = 0;
  EXPECT_THAT(text_of(table), HasSubstr("size"));
  table.size[1] = 1, table.friction = -1;
  EXPECT_THAT(text_of(table), HasSubstr("friction"));
  table.friction = 0, table.depth = NAN;
  EXPECT_THAT(text_of(table), HasSubstr("depth"));
  table.depth = 0.01, table.orientation[0] = 2;
  EXPECT_THAT(text_of(table), HasSubstr("orientation"));
  table = palpate_default_obstacle();
  EXPECT_THAT(text_of(table), HasSubstr("kind"));
  Rib rib;
  palpate_obstacle mesh = rib.at({0, 0, 0}, 0.01, 0.1);
  EXPECT_EQ(text_of(mesh), "");
  rib.triangles[0] = 1000;
  EXPECT_THAT(text_of(mesh), HasSubstr("vertices"));
  rib.triangles[0] = rib.triangles[1];
  EXPECT_THAT(text_of(mesh), HasSubstr("area"));
  std::swap(rib.triangles[4], rib.triangles[5]), rib.triangles[0] = 0;
  EXPECT_THAT(text_of(mesh), HasSubstr("edge"));
  Obstructed scene(box, plain_def(), {plate({0, 0, -1}, {0, 0, 1})});
  palpate_pose pose = palpate_default_pose();
  EXPECT_EQ(palpate_scene_set_obstacle_pose(scene.get(), 1, &pose, nullptr), PALPATE_ERROR_ARGUMENT);
  pose.position[0] = NAN;
  EXPECT_EQ(palpate_scene_set_obstacle_pose(scene.get(), 0, &pose, nullptr), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_obstacle_state(scene.get(), 1), nullptr);
  EXPECT_EQ(palpate_scene_obstacle_state(TouchedScene(box, plain_def()).get(), 0), nullptr);
}

// A restored scene plays on with the same bits.
TEST(Obstacles, ARestoredSceneHasTheirStates) {
  const TouchedBox& box = tiny_box();
  const auto list = {plate(kFarFace + Vector3d(1e-3, 0, 0), {-1, 0, 0}, 0.3)};
  Obstructed scene(box, plain_def(), list), other(box, plain_def(), list);
  const auto step = [](Obstructed& of, int s) {
    of.put(0, pose_of(kFarFace + Vector3d(1e-3 - 5e-5 * s, 4e-5 * s, 0), {-1, 0, 0}));
    of.touch();
  };
  for (int s = 0; s < 60; ++s) step(scene, s);
  restore_from(scene.get(), other.get());
  for (int s = 60; s < 80; ++s) {
    step(scene, s), step(other, s);
    EXPECT_TRUE(scene.has_bytes_of(other));
    EXPECT_EQ((scene.force() - other.force()).norm(), 0);
  }
  EXPECT_GT(scene.state().nodes, 0);
}

// ---- large deformation -------------------------------------------------------------------------------------------------

constexpr palpate_deformation_model kForms[] = {PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LARGE_BESIDE,
                                                PALPATE_DEFORMATION_LARGE_RENEWED};
// 30 x 50 x 50 mm: a longer one bends aside under a plate without friction.
const TouchedBody& large_box() {
  static const TouchedBody shared = large_body(false, {}, {.cells = {3, 4, 4}, .size = {0.03, 0.05, 0.05}});
  return shared;
}
const LargeReference& newton() {
  static const Seen seen(large_box(), false, 0);
  static const LargeReference reference(seen.body);
  return reference;
}

TEST(LargeObstacles, APlatenCompressesABlockBy40PercentAsNewtonsMethodSays) {
  const std::vector<std::int32_t> face = face_nodes(large_box(), 0, 0.03);
  for (const double friction : {0.0, 5.0})
    for (const auto form : kForms) {
      SceneDef def = plain_def();
      def.large.deformation = form;
      Obstructed scene(large_box(), def, {plate({0.03, 0.025, 0.025}, {-1, 0, 0}, friction)});
      palpate_step_flags flags = 0;
      for (int s = 0; s <= 150; ++s) {
        scene.put(0, pose_of({0.03 - 1e-4 * std::min(s, 120), 0.025, 0.025}, {-1, 0, 0}));
        flags = scene.step();
      }
      EXPECT_EQ(flags, 0u) << form;
      const Eigen::Index held = friction > 0 ? 3 : 1, rows = held * static_cast<Eigen::Index>(face.size());
      MatrixXd of = MatrixXd::Zero(rows, large_box().dofs());
      VectorXd target = VectorXd::Zero(rows);
      for (Eigen::Index i = 0; i < rows; ++i) {
        of(i, 3 * face[static_cast<std::size_t>(i / held)] + i % held) = 1;
        if (i % held == 0) target[i] = -0.012;
      }
      const VectorXd found = scene.field();
      VectorXd u = found;
      const VectorXd carried = newton().solve(of, target, &u);
      double sum = 0;
      for (Eigen::Index i = 0; i < rows; i += held) sum += carried[i];
      EXPECT_LT((found - u).norm(), 0.01 * u.norm()) << form << " " << friction;
      EXPECT_NEAR(scene.force()[0], -sum, 0.02 * std::abs(sum)) << form << " " << friction;
    }
}

// A dead weight on the far face lays the box on a table 6 mm below it.
TEST(LargeObstacles, AnOrganThatAWeightLaysOnATableIsNewtonsSolutionWithUnilateralRows) {
  static const TouchedBody box = large_body(false);
  static const Seen seen(box, false, 0);
  const LargeReference reference(seen.body);
  const std::vector<std::int32_t> bottom = face_nodes(box, 2, 0);
  for (const auto form : kForms) {
    SceneDef def = plain_def();
    def.large.deformation = form, def.loads.count = 1, def.loads.radius[0] = 0.05;
    std::copy_n(kFarFace.data(), 3, def.loads.centre[0]);
    Obstructed scene(box, def, {plate({0.03, 0.02, -0.006}, {0, 0, 1})});
    const Vector3d weight(0, 0, -0.65);
    for (int s = 1; s <= 260; ++s) {
      const Vector3d now = std::min(1.0, s / 200.0) * weight;
      ASSERT_EQ(palpate_scene_set_load(scene.get(), 0, PALPATE_LOAD_FORCE, now.data(), nullptr), PALPATE_OK);
      scene.step();
    }
    EXPECT_EQ(scene.flags, 0u) << form;
    VectorXd load = VectorXd::Zero(box.dofs());
    for (std::size_t t = 0; t < box.body.triangles.size(); ++t) {
      const auto& corners = box.body.triangles[t];
      if (box.outward(static_cast<std::int32_t>(t))[0] < 0.99) continue;
      const Vector3d a = box.node(corners[0]), b = box.node(corners[1]), c = box.node(corners[2]);
      for (const auto n : corners) load.segment<3>(3 * n) += (b - a).cross(c - a).norm() / 6 / (0.05 * 0.04) * weight;
    }
    std::vector<std::int32_t> pressing;
    for (std::int32_t e = 0; e < scene.contacts->node_count; ++e)
      if (const palpate_contact_node& node = scene.contacts.nodes()[e]; node.force[2] > 1e-6)
        pressing.push_back(node.node);
    const auto count = static_cast<Eigen::Index>(pressing.size());
    ASSERT_GT(count, 3) << form;
    MatrixXd rows = MatrixXd::Zero(count, box.dofs());
    for (Eigen::Index i = 0; i < count; ++i) rows(i, 3 * pressing[static_cast<std::size_t>(i)] + 2) = 1;
    const VectorXd found = scene.field();
    VectorXd u = found;
    const VectorXd carried = reference.solve(rows, VectorXd::Constant(count, -0.006), &u, 1e-9, {}, nullptr, load);
    EXPECT_GT(carried.minCoeff(), -0.01 * carried.maxCoeff()) << form;
    for (const std::int32_t n : bottom) EXPECT_GT(u[3 * n + 2], -0.006 - 5e-5) << form << " " << n;
    EXPECT_LT((found - u).norm(), 0.01 * u.norm()) << form;
    EXPECT_NEAR(-scene.force()[2], carried.sum(), 0.02 * carried.sum()) << form;
  }
}

// Plates with friction that wander and turn at 0.05 to 0.2 m/s, and are taken away.
TEST(LargeObstacles, PlatesThatWanderAtRandomLeaveTheBodyFiniteAndAtRest) {
  static const TouchedBody box = large_body(false);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Vector3d(normal(random), normal(random), normal(random)); };
  for (const auto form : kForms) {
    SceneDef def = plain_def();
    def.large.deformation = form;
    Obstructed scene(box, def, {plate({1, 0, 0}, {-1, 0, 0}, 0.5, 0.04), plate({1, 0, 0}, {0, 0, -1}, 0.1, 0.1)});
    double most = 0;
    Vector3d aside[2], spin[2];
    for (int i = 0; i < 2; ++i) aside[i] = 0.004 * vector(), spin[i] = 0.15 * vector();
    for (int s = 0; s <= 400; ++s) {
      const double share = std::sin(std::numbers::pi * s / 400), swing = share * std::sin(0.04 * s);
      const Vector3d at[2] = {kFarFace + Vector3d(0.012 - 0.024 * share, 0, 0) + swing * aside[0],
                              Vector3d(0.04, 0.025, 0.05 - 0.02 * share) + swing * aside[1]};
      for (int i = 0; i < 2; ++i) {
        const palpate_pose pose = pose_of(at[i], i == 0 ? Vector3d(-1, 0, 0) : Vector3d(0, 0, -1));
        const double* const q = pose.orientation;
        const Vector3d turned = swing * spin[i];
        scene.put(i, pose_at(at[i], Quaterniond(AngleAxisd(turned.norm(), turned.normalized())) *
                                        Quaterniond(q[0], q[1], q[2], q[3])));
      }
      scene.step();
      ASSERT_TRUE(scene.force(0).allFinite() && scene.force(1).allFinite()) << form << " " << s;
      most = std::max(most, scene.force(0).norm() + scene.force(1).norm());
    }
    for (int s = 0; s < 200; ++s) scene.step();
    EXPECT_LT(scene.field().cwiseAbs().maxCoeff(), 1e-5) << form;
    EXPECT_EQ(scene.flags, 0u) << form;
    EXPECT_GT(most, 1) << form;
    EXPECT_LT(most, 50) << form;
  }
}

// Two organs of a world lie on one table as each would alone.
TEST(WorldObstacles, TwoOrgansLieOnTheSameTable) {
  static const MovedBox box(false);
  SceneDef def = moved_def();
  def.collision = PALPATE_COLLISION_DEFORMED;
  const std::vector<palpate_obstacle> list = {plate({0, 0, -0.001}, {0, 0, 1}, 0.2, 1)};
  def = Obstructed::with_list(def, list);
  const palpate_pose places[2] = {pose_at({0, 0, 0}), pose_at({0.2, 0, 0})};
  palpate_world_organ organs[2];
  for (int k = 0; k < 2; ++k) organs[k] = organ_of(box.bundle(), &def, &places[k]);
  palpate_world_def of = palpate_default_world_def();
  of.organs = organs, of.organ_count = 2, of.max_pairs = 50;
  palpate_world* made = nullptr;
  palpate_error error = {};
  ASSERT_EQ(palpate_world_create(&of, &made, &error), PALPATE_OK) << error.text;
  const WorldPointer world(made);
  WorldContacts contacts(made);
  Obstructed alone(box, def, list);
  for (int s = 1; s <= 160; ++s) {
    const Vector4d amounts = {0, 0, 0, -0.01 * std::min(s, 150)};
    set_amounts(alone.get(), amounts), alone.touch();
    for (int k = 0; k < 2; ++k) set_amounts(palpate_world_scene(made, k), amounts);
    ASSERT_EQ(palpate_world_touch(made, nullptr, 0, 1e-3, contacts.get(), contacts.bytes()), 0u);
    for (int k = 0; k < 2; ++k) {
      const palpate_obstacle_state& state = *palpate_scene_obstacle_state(palpate_world_scene(made, k), 0);
      ASSERT_LT((Vector3d(state.force) - alone.force()).norm(), 1e-6 * (1e-3 + alone.force().norm())) << s;
    }
  }
  EXPECT_LT(alone.force()[2], -0.01);
}

}  // namespace
}  // namespace palpate::tests
