// An organ that moves and turns in the world: only the motion of the tools relative to it counts.
#include <Eigen/Geometry>

#include "runtime/base/sine.h"
#include "tests/runtime/played_box.h"
#include "tests/support/relaxation.h"

namespace palpate::tests {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

SceneDef sliding_def(palpate_contact_law law = PALPATE_LAW_COULOMB,
                     palpate_collision collision = PALPATE_COLLISION_DEFORMED) {
  return with(SceneDef(), collision, law, relaxation_of({{0.5, 0.02}}));
}

palpate_pose pose_at(const Vector3d& position, const Quaterniond& turn = Quaterniond::Identity()) {
  palpate_pose pose = palpate_default_pose();
  Eigen::Map<Vector3d>(pose.position) = position;
  pose.orientation[0] = turn.w(), pose.orientation[1] = turn.x(), pose.orientation[2] = turn.y(),
  pose.orientation[3] = turn.z();
  return pose;
}

// Where the tool is in the organ's frame: it comes down on the far face, slides over it with friction and goes out.
Vector3d in_organ(int s) {
  const std::int32_t triangle = tiny_box().far_triangle(5);
  return tiny_box().place(triangle, {.3, .3, .4}) + 0.002 * std::cos(0.05 * s) * tiny_box().outward(triangle) +
         Vector3d(0, 0.0005 * std::sin(0.03 * s), 2e-5 * s);
}

// A scene with one disc.
struct Played : TouchedScene {
  explicit Played(const SceneDef& def = sliding_def()) : TouchedScene(tiny_box(), def) {}

  void pose(const palpate_pose& pose) {
    palpate_error error = {};
    ASSERT_EQ(palpate_scene_set_pose(scene.get(), &pose, &error), PALPATE_OK) << error.text;
  }
  palpate_step_flags step(const Vector3d& p) { return press(p, 0.004, 0.2); }
  Vector3d force() { return Vector3d(tool().force); }
  Vector3d raw() { return TouchedScene::force(); }
};

// The contact nodes, which are in the organ's frame, to the bit; -0 is 0.
void expect_same_nodes(Played& a, Played& b, int s) {
  ASSERT_EQ(a.contacts->node_count, b.contacts->node_count) << s;
  for (std::int32_t n = 0; n < a.contacts->node_count; ++n) {
    const palpate_contact_node &one = a.contacts.nodes()[n], &other = b.contacts.nodes()[n];
    EXPECT_EQ(one.node, other.node);
    EXPECT_EQ(Vector3d(one.force), Vector3d(other.force)) << s;
    EXPECT_EQ(Vector3d(one.modified_displacement), Vector3d(other.modified_displacement)) << s;
  }
}

TEST(Pose, OfIdentityGivesTheSameBits) {
  Played without, with;
  Quaterniond turn = Quaterniond::Identity();
  turn.coeffs() = -turn.coeffs();  // the same turn
  for (int s = 0; s < 150; ++s) {
    with.pose(s % 2 ? pose_at(Vector3d::Zero(), turn) : palpate_default_pose());
    without.step(in_organ(s)), with.step(in_organ(s));
    // All but the quaternion's sign.
    std::copy_n(without.contacts->organ_orientation, 4, with.contacts->organ_orientation);
    ASSERT_TRUE(without.has_bytes_of(with)) << s;
  }
}

TEST(Pose, OfAnOrganThatMovesAgainstAToolAtRestGivesTheBitsOfAToolThatMoves) {
  for (const auto law : kEveryLaw)
    for (const auto collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED}) {
      Played tool_moves(sliding_def(law, collision)), organ_moves(sliding_def(law, collision));
      const Vector3d resting(0.25, -0.5, 0.75);
      int touching = 0, slipping = 0, began = 0;
      for (int s = 0; s < 150; ++s) {
        const Vector3d position = resting - in_organ(s);
        organ_moves.pose(pose_at(position));
        const palpate_step_flags flags = organ_moves.step(resting);
        EXPECT_EQ(tool_moves.step(resting - position), flags) << s;
        EXPECT_EQ(organ_moves.force(), tool_moves.force()) << s;
        EXPECT_EQ(organ_moves.raw(), tool_moves.raw()) << s;
        expect_same_nodes(organ_moves, tool_moves, s);
        began += touching == 0 && organ_moves.tool().contact_count > 0;
        touching += organ_moves.tool().contact_count > 0, slipping += organ_moves.tool().slip_count > 0;
      }
      EXPECT_GT(touching, 30);
      EXPECT_EQ(began, 1);
      EXPECT_EQ(slipping > 5, law == PALPATE_LAW_COULOMB) << slipping;
    }
}

// The tool's place in the organ's frame goes through a turn and back: its last digits differ by 2e-16 of a metre, as the organ is
// half a metre from the world's origin. The stiffest response is that of a few node stiffnesses of 1e3 N/m: 1e-12 N. The solver of
// the laws stops when no displacement changes by more than its tolerance, and two starts that differ in the last digit may
// differ in the number of sweeps: 1e-9 m of it times that stiffness.
constexpr double kRounding = 1e-6;  // N

TEST(Pose, OfAnOrganThatTurnsAndMovesAgainstATool) {
  Played tool_moves, organ_moves;
  int touching = 0;
  for (int s = 0; s < 150; ++s) {
    const Quaterniond turn(Eigen::AngleAxisd(0.3 + 0.002 * s, Vector3d(1, -2, 0.5).normalized()));
    const Vector3d position(0.3 + 1e-4 * s, -0.4, 0.1 * std::sin(0.01 * s));
    organ_moves.pose(pose_at(position, turn));
    const palpate_step_flags flags = organ_moves.step(position + turn * in_organ(s));
    EXPECT_EQ(tool_moves.step(in_organ(s)), flags) << s;
    EXPECT_LT((organ_moves.force() - turn * tool_moves.force()).norm(), kRounding) << s;
    EXPECT_LT((organ_moves.raw() - turn * tool_moves.raw()).norm(), kRounding) << s;
    ASSERT_EQ(organ_moves.contacts->node_count, tool_moves.contacts->node_count) << s;
    for (std::int32_t n = 0; n < organ_moves.contacts->node_count; ++n)
      EXPECT_LT(
          (Vector3d(organ_moves.contacts.nodes()[n].force) - Vector3d(tool_moves.contacts.nodes()[n].force)).norm(),
          kRounding)
          << s;
    EXPECT_LT((Vector3d(organ_moves.tool().direction) - Vector3d(tool_moves.tool().direction)).norm(), 1e-9) << s;
    touching += organ_moves.tool().contact_count > 0;
  }
  EXPECT_GT(touching, 30);
}

// An organ that turns about its own axis by 0.02 rad in a step sweeps its side over a tool at rest.
TEST(Pose, OfAnOrganThatTurnsIntoAToolAtRestMeetsItInThatStep) {
  Played turning;
  const Vector3d axis(0, 0, 1), start = in_organ(0);
  int first = -1;
  for (int s = 0; s < 60 && first < 0; ++s) {
    turning.pose(pose_at(Vector3d::Zero(), Quaterniond(Eigen::AngleAxisd(-0.005 * s, axis))));
    turning.step(start);
    if (turning.tool().contact_count > 0) first = s;
  }
  // The same steps of a tool that moves backwards about the axis.
  Played circling;
  for (int s = 0; s <= first; ++s) {
    circling.step(Eigen::AngleAxisd(0.005 * s, axis) * start);
    EXPECT_EQ(circling.tool().contact_count > 0, s == first) << s;
  }
  ASSERT_GT(first, 1);
  EXPECT_LT((circling.force() - Eigen::AngleAxisd(0.005 * first, axis) * turning.force()).norm(), kRounding);
}

TEST(Pose, ThatJumpsIsLostTrackingAndTheForceGoesToZero) {
  SceneDef def = sliding_def(PALPATE_LAW_STICKING);
  def.force_slew = 100;  // N/s
  Played played(def);
  int s = 0;
  for (; s < 60; ++s) played.step(in_organ(s));
  ASSERT_EQ(played.tool().contact_count, 1);
  double before = played.force().norm();
  ASSERT_GT(before, 0.05);
  played.pose(pose_at({0.1, 0, 0}));  // 0.1 m in 1 ms: ten times max_tool_speed
  EXPECT_TRUE(played.step(in_organ(s)) & PALPATE_STEP_TRACKING_LOST);
  EXPECT_EQ(played.tool().contact_count, 0);
  EXPECT_EQ(played.raw(), Vector3d::Zero());
  for (int after = 0; after < 100; ++after) {
    EXPECT_LT(before - played.force().norm(), 100 * 1e-3 + 1e-12);
    before = played.force().norm();
    EXPECT_EQ(played.step(in_organ(s)) & ~PALPATE_STEP_FORCE_LIMITED, 0u);
  }
  EXPECT_EQ(played.force(), Vector3d::Zero());
  // A whole scene that is moved elsewhere, tool and organ together, is no jump.
  Played moved(def);
  for (s = 0; s < 60; ++s) moved.step(in_organ(s));
  moved.pose(pose_at({0.5, 0, 0}));
  EXPECT_EQ(moved.step(in_organ(60) + Vector3d(0.5, 0, 0)) & PALPATE_STEP_TRACKING_LOST, 0u);
  EXPECT_EQ(moved.tool().contact_count, 1);
}

// A host that sends a pose every 16 steps: the steps between follow the velocities.
TEST(Pose, MovesOnByItsVelocitiesUntilTheNextOne) {
  Played played;
  const Vector3d velocity(0.2, -0.1, 0.05), spin(3, 4, -12);  // 13 rad/s
  const Quaterniond start(Eigen::AngleAxisd(0.4, Vector3d(2, 1, -1).normalized()));
  palpate_pose pose = pose_at({0.1, 0.2, 0.3}, start);
  Eigen::Map<Vector3d>(pose.velocity) = velocity;
  Eigen::Map<Vector3d>(pose.angular_velocity) = spin;
  played.pose(pose);
  for (int s = 0; s < 1000; ++s) {
    played.step({9, 9, 9});
    const double time = 1e-3 * s;
    EXPECT_LT((Vector3d(played.contacts->organ_position) - Vector3d(0.1, 0.2, 0.3) - time * velocity).norm(), 1e-13);
    const Quaterniond expected = Quaterniond(Eigen::AngleAxisd(13 * time, spin / 13)) * start;
    const double* q = played.contacts->organ_orientation;
    // 1,000 products of quaternions, each rounded to 2e-16.
    EXPECT_LT(Quaterniond(q[0], q[1], q[2], q[3]).angularDistance(expected), 1e-12) << s;
  }
  pose.velocity[0] = 2e9;  // beyond 1e6 m within one step: the organ stays
  played.pose(pose);
  for (int s = 0; s < 3; ++s) played.step({9, 9, 9});
  EXPECT_EQ(Vector3d(played.contacts->organ_position), Vector3d(0.1, 0.2, 0.3));
}

TEST(Pose, IsRefusedWhereItIsNone) {
  Played played;
  const palpate_pose good = pose_at({1, 2, 3}, Quaterniond(0.5, 0.5, 0.5, 0.5));
  played.pose(good);
  const auto refused = [&](palpate_pose pose, const char* word) {
    palpate_error error = {};
    EXPECT_EQ(palpate_scene_set_pose(played.scene.get(), &pose, &error), PALPATE_ERROR_ARGUMENT);
    EXPECT_THAT(error.text, testing::HasSubstr(word));
    EXPECT_EQ(palpate_scene_set_pose(played.scene.get(), &pose, nullptr), PALPATE_ERROR_ARGUMENT);
    played.step({9, 9, 9});
    EXPECT_EQ(Vector3d(played.contacts->organ_position), Vector3d(1, 2, 3)) << "the last good pose stays";
    EXPECT_EQ(played.contacts->organ_orientation[3], 0.5);
  };
  for (const double bad : {double(NAN), double(INFINITY), -double(INFINITY), 1e300}) {
    for (int d = 0; d < 3; ++d) {
      palpate_pose pose = good;
      pose.position[d] = bad;
      refused(pose, "a position within 1e6 m");
      if (bad == 1e300) continue;
      pose = good, pose.velocity[d] = bad;
      refused(pose, "a finite velocity");
      pose = good, pose.angular_velocity[d] = bad;
      refused(pose, "a finite angular velocity");
    }
    palpate_pose pose = good;
    pose.orientation[2] = bad;
    refused(pose, "of length 1, found the length");
  }
  for (const double length : {0.0, 0.99, 1.002, 2.0}) {
    palpate_pose pose = good;
    for (double& q : pose.orientation) q *= length;
    refused(pose, "of length 1, found the length");
  }
  palpate_pose old = good;
  old.struct_bytes = 4;
  refused(old, "struct_bytes is 4");
  EXPECT_EQ(palpate_scene_set_pose(nullptr, &good, nullptr), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_set_pose(played.scene.get(), nullptr, nullptr), PALPATE_ERROR_ARGUMENT);
}

TEST(Pose, WhoseQuaternionIsAlmostOfLengthOneTurnsWithoutStretching) {
  Played exact, almost;
  const Quaterniond turn(Eigen::AngleAxisd(1.1, Vector3d(1, 1, 1).normalized()));
  palpate_pose pose = pose_at({0, 0, 0}, turn);
  exact.pose(pose);
  for (double& q : pose.orientation) q *= 1.0009;
  almost.pose(pose);
  for (int s = 0; s < 60; ++s) exact.step(turn * in_organ(s)), almost.step(turn * in_organ(s));
  ASSERT_GT(exact.force().norm(), 0.05);
  EXPECT_LT((exact.force() - almost.force()).norm(), kRounding);
}

TEST(Pose, LeavesAToolWithBadInputWhereItWasInTheWorld) {
  Played played(sliding_def(PALPATE_LAW_STICKING));
  for (int s = 0; s < 60; ++s) played.step(in_organ(s));
  const Vector3d before = played.raw(), p = in_organ(59);
  ASSERT_GT(before.norm(), 0.05);
  Played moved(sliding_def(PALPATE_LAW_STICKING));
  for (int s = 0; s < 60; ++s) moved.step(in_organ(s));
  for (Played* each : {&played, &moved}) each->pose(pose_at(1e-3 * tiny_box().outward(tiny_box().far_triangle(5))));
  EXPECT_EQ(played.step({NAN, 0, 0}), PALPATE_STEP_BAD_INPUT);
  moved.step(p);
  EXPECT_EQ(played.raw(), moved.raw());
  EXPECT_GT(played.raw().norm(), before.norm()) << "the organ has moved against the tool";
}

TEST(Pose, StaysWhenTheSceneIsReset) {
  Played played;
  played.pose(pose_at({1, 2, 3}));
  played.reset();
  played.step({9, 9, 9});
  EXPECT_EQ(Vector3d(played.contacts->organ_position), Vector3d(1, 2, 3));
}

TEST(Pose, IsTheFrameThatTheHelpersAndTheMatrixState) {
  const Quaterniond turn(Eigen::AngleAxisd(2, Vector3d(-1, 0.3, 0.5).normalized()));
  const palpate_pose pose = pose_at({0.4, -0.1, 0.2}, turn);
  const Vector3d p(0.03, 0.05, -0.07), expected = Vector3d(pose.position) + turn * p;
  Vector3d to, back;
  palpate_point_to_world(pose.position, pose.orientation, p.data(), to.data());
  palpate_point_to_organ(pose.position, pose.orientation, to.data(), back.data());
  EXPECT_LT((to - expected).norm(), 1e-15);
  EXPECT_LT((back - p).norm(), 1e-15);
  palpate_vector_to_world(pose.orientation, p.data(), to.data());
  palpate_vector_to_organ(pose.orientation, to.data(), to.data());  // in place
  EXPECT_LT((to - p).norm(), 1e-15);
  Eigen::Matrix4d matrix;
  palpate_pose_matrix(pose.position, pose.orientation, matrix.data());
  EXPECT_LT(((matrix * p.homogeneous()).head<3>() - expected).norm(), 1e-15);
  EXPECT_EQ(matrix.row(3), Eigen::RowVector4d(0, 0, 0, 1));
  const double nothing[4] = {0, 0, 0, 0};
  palpate_vector_to_world(nothing, p.data(), to.data());
  EXPECT_EQ(to, p);
}

TEST(Sine, IsThatOfTheCLibrary) {
  for (double x = -20; x < 20; x += 0.0137) {
    const SineCosine of = sine_cosine(x);
    const double tolerance = 1e-15 * (1 + std::fabs(x));  // as sine.h states
    EXPECT_NEAR(of.sine, std::sin(x), tolerance) << x;
    EXPECT_NEAR(of.cosine, std::cos(x), tolerance) << x;
  }
  EXPECT_EQ(sine_cosine(0).sine, 0);
  EXPECT_EQ(sine_cosine(0).cosine, 1);
}

}  // namespace
}  // namespace palpate::tests
