// Organs that touch while their supports move: a rigid motion of the supports is a motion of the pose.
#include <numbers>

#include "tests/runtime/moved_box.h"
#include "tests/runtime/world/played_world.h"

namespace palpate::tests {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Held at the face x = 0, which the piston moves along x: the box moves as it is.
const MovedBox& box() {
  static const MovedBox shared(false);
  return shared;
}

// A box at the origin, which moves by its supports or by its pose, and another box that stands at a pose. moving: the number of the first
// one in the world, 0 or 1; of two equal boxes the one with number 0 carries the pairs.
class Pair {
 public:
  Pair(bool motions, const palpate_pose& other, double friction, std::int32_t moving = 0)
      : motions_(motions), moving_(moving) {
    SceneDef def = moved_def();
    def.law = PALPATE_LAW_UNILATERAL;
    def.max_tools = def.max_points = 1, def.max_contact_nodes = 3;  // room for one touch beside the pairs
    SceneDef still = def;
    still.motions.motions = 0;
    const palpate_pose start = palpate_default_pose();
    std::vector<palpate_world_organ> organs = {organ_of(box().bundle(), motions ? &def : &still, &start),
                                               organ_of(box().bundle(), &still, &other)};
    if (moving == 1) std::swap(organs[0], organs[1]);
    palpate_world_def world = palpate_default_world_def();
    world.organs = organs.data(), world.organ_count = 2;
    world.max_pairs = 100, world.friction = friction;
    palpate_world* made = nullptr;
    palpate_error error = {};
    if (palpate_world_create(&world, &made, &error) != PALPATE_OK) throw std::runtime_error(error.text);
    world_.reset(made);
    contacts = std::make_unique<WorldContacts>(made);
  }
  palpate_scene* scene(std::int32_t organ) { return palpate_world_scene(world_.get(), organ); }
  // The box that moves is q along x from where it began.
  palpate_step_flags step(double q) {
    const palpate_pose pose = pose_at({q, 0, 0});
    if (motions_)
      set_amounts(scene(moving_), {q, 0, 0, 0});
    else
      EXPECT_EQ(palpate_scene_set_pose(scene(moving_), &pose, nullptr), PALPATE_OK);
    return palpate_world_touch(world_.get(), nullptr, 0, 1e-3, contacts->get(), contacts->bytes());
  }
  Vector3d pressed(std::int32_t organ) { return Vector3d(contacts->state(organ).pressed); }
  std::vector<float> shape(std::int32_t organ) {
    return displacements(scene(organ), &contacts->organ(organ), box().body.surface_nodes);
  }

  std::unique_ptr<WorldContacts> contacts;

 private:
  bool motions_;
  std::int32_t moving_;
  WorldPointer world_;
};

// Both worlds go the same way; the other box ends `lower` below where it began. `least`: N, what the boxes feel at least.
// sinks: m, by which vertices may be inside of the other box.
void expect_the_same(const palpate_pose& other, double lower, double friction, double depth, double least,
                     std::int32_t moving = 0, double sinks = 1e-9) {
  Pair by_supports(true, other, friction, moving), by_pose(false, other, friction, moving);
  // With friction the places of pairs that press are found anew in every step. Those of pairs that are only near are found where bounds ask
  // for it, which differ, and a pair begins to press at such a place. Without friction a place lags by a tenth of an edge at most.
  const double share = friction > 0 ? 1e-4 : 0.02, shape = friction > 0 ? 1e-6 : 5e-6;
  double most = 0, apart = 0;
  for (int s = 0; s < 220; ++s) {
    palpate_pose lowered = other;
    lowered.position[2] -= lower * std::min(1.0, s / 20.0);
    const double q = s < 20 ? 0 : depth * (1 - std::cos(2 * std::numbers::pi * (s - 20) / 100)) / 2;
    for (Pair* pair : {&by_supports, &by_pose})
      ASSERT_EQ(palpate_scene_set_pose(pair->scene(1 - moving), &lowered, nullptr), PALPATE_OK);
    EXPECT_EQ(by_supports.step(q), by_pose.step(q)) << s;
    const Vector3d expected = by_pose.pressed(0);
    most = std::max(most, expected.norm());
    for (const std::int32_t organ : {0, 1})
      apart = std::max(apart, (by_supports.pressed(organ) - by_pose.pressed(organ)).norm());
    for (std::int32_t i = 0; i < by_supports.contacts->get()->pair_count; ++i) {
      const palpate_world_pair& pair = *palpate_world_contacts_pair(by_supports.contacts->get(), i);
      EXPECT_GT(pair.gap, -sinks) << s;
      if (pair.pressure > 0) {
        EXPECT_LT(pair.gap, 1e-9) << s;
      }
    }
    if (s % 40 != 30) continue;
    for (const std::int32_t organ : {0, 1}) {
      const std::vector<float> u = by_supports.shape(organ), v = by_pose.shape(organ);
      for (std::size_t i = 0; i < u.size(); ++i)
        ASSERT_NEAR(static_cast<double>(u[i]), static_cast<double>(v[i]) + (organ == moving && i % 3 == 0 ? q : 0),
                    shape);
    }
  }
  EXPECT_GT(most, least);
  EXPECT_LT(apart, share * most);
}

// The far face of the first box looks at the upper face of the other one, 1 mm away.
palpate_pose face_to_face() {
  return pose_at({0.101, 0.02, -0.01}, Quaterniond(Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3d(0, 1, 0))));
}

TEST(MovedOrgans, SupportsThatMovePressOneOrganOnAnother) {
  for (const std::int32_t moving : {0, 1})
    for (const double friction : {0.0, 0.1}) expect_the_same(face_to_face(), 0, friction, 0.004, 0.1, moving);
}

// The held face itself, which the piston moves, presses the upper face of the other box, 1 mm away. Held vertices sink in by 5 % of
// what they press, and by more near the other box's own support.
TEST(MovedOrgans, AHeldFaceThatMovesPressesAnotherOrgan) {
  const palpate_pose below =
      pose_at({-0.041, 0.02, 0.05}, Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d(0, 1, 0))));
  for (const std::int32_t moving : {0, 1}) expect_the_same(below, 0, 0, -0.004, 0.1, moving, 0.15 * 0.003);
}

// The far face of the other box comes down on the upper face of the first one, which then slides below it, there and back.
TEST(MovedOrgans, SupportsThatMoveRubOneOrganOnAnother) {
  const Quaterniond down(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d(0, 1, 0)));
  for (const std::int32_t moving : {0, 1})
    expect_the_same(pose_at({0.012, 0.003, 0.1002}, down), 0.001, 0.3, 0.006, 0.02, moving);
}

// What is inside of the far face is held while the box moves, so that its pressure withstands the other box.
TEST(MovedOrgans, AHeldVolumeIsHeldAgainstAnotherOrgan) {
  Pair held(true, face_to_face(), 0), left(true, face_to_face(), 0);
  const double swept = box().motions.sweep.dot(box().motions.field.col(kPiston));  // m^3 per metre
  for (int s = 0; s < 60; ++s) {
    const double q = 5e-5 * s;
    ASSERT_EQ(palpate_scene_hold_volume(held.scene(0), kFilling, 1, swept * q, nullptr), PALPATE_OK);
    EXPECT_EQ(held.step(q), 0u);
    left.step(q);
    const palpate_motion_state& filling = *palpate_scene_motion_state(held.scene(0), kFilling);
    const double taken = palpate_scene_motion_state(left.scene(0), kFilling)->volume - swept * q;
    EXPECT_NEAR(filling.volume, swept * q, 1e-12 * std::fabs(swept)) << s;
    if (s < 50) continue;
    EXPECT_GT(std::fabs(taken), 1e-7) << s;
    EXPECT_GT(held.pressed(0).norm(), 1.05 * left.pressed(0).norm()) << "the filled box is stiffer";
  }
}

// What one pressure moves the other one feels.
TEST(MovedOrgans, VolumesAreMetWhereTwoBoxesPressOneAnotherWithTheSurfacesThatHoldThem) {
  SceneDef def = moved_def();
  def.law = PALPATE_LAW_UNILATERAL;
  const palpate_pose start = palpate_default_pose(),
                     opposite = pose_at({0.1215, 0.054, 0.003},
                                        Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Vector3d(0, 0, 1))));
  const std::vector<palpate_world_organ> organs = {organ_of(box().bundle(), &def, &start),
                                                   organ_of(box().bundle(), &def, &opposite)};
  palpate_world_def of = palpate_default_world_def();
  of.organs = organs.data(), of.organ_count = 2, of.max_pairs = 100, of.friction = 0.3;
  palpate_world* made = nullptr;
  ASSERT_EQ(palpate_world_create(&of, &made, nullptr), PALPATE_OK);
  const WorldPointer world(made);
  WorldContacts contacts(made);
  for (int s = 0; s < 60; ++s) {
    const palpate_pose nearer = pose_at({0.1215 - 1e-4 * std::min(s, 30), 0.054, 0.003}, Quaterniond(0, 0, 0, 1));
    palpate_scene_set_pose(palpate_world_scene(made, 1), &nearer, nullptr);
    for (const std::int32_t organ : {0, 1})
      ASSERT_EQ(palpate_scene_hold_volume(palpate_world_scene(made, organ), kFilling, 1, 1e-7, nullptr), PALPATE_OK);
    EXPECT_EQ(palpate_world_touch(made, nullptr, 0, 1e-3, contacts.get(), contacts.bytes()), 0u) << s;
    for (const std::int32_t organ : {0, 1})
      EXPECT_NEAR(palpate_scene_motion_state(palpate_world_scene(made, organ), kFilling)->volume, 1e-7, 1e-18) << s;
  }
  EXPECT_GT(Vector3d(contacts.state(0).pressed).norm(), 0.1);
}

// Two equal boxes one above the other, whose edges and corners lie on one another: the last bits decide which triangle has the nearest place. What they
// decide does not reach the forces.
TEST(MovedOrgans, TheLastBitsOfAnAmountStayTheLastBitsOfTheForces) {
  for (const double friction : {0.0, 0.2}) {
    const palpate_pose above = pose_at({0, 0.05, 0.0805}, Quaterniond(0, 1, 0, 0));
    Pair one(true, above, friction), other(true, above, friction);
    double most = 0, apart = 0;
    for (int s = 0; s < 250; ++s) {
      const double q = 0.001 + 0.002 * std::sin(2 * std::numbers::pi * s / 200), bits = 1e-15 * (s * 7919 % 13 - 6);
      palpate_pose lowered = above;
      lowered.position[2] -= 2e-5 * std::min(s, 100);
      for (Pair* pair : {&one, &other})
        ASSERT_EQ(palpate_scene_set_pose(pair->scene(1), &lowered, nullptr), PALPATE_OK);
      one.step(q), other.step(q + bits);
      most = std::max(most, one.pressed(0).norm());
      apart = std::max(apart, (one.pressed(0) - other.pressed(0)).norm());
    }
    EXPECT_GT(most, 0.05);
    // A tenth of a millimetre makes some per cent of the force, and 1e-14 m of it 1e-11; without the choice among triangles the forces were
    // apart by 7e-2.
    EXPECT_LT(apart, 1e-8 * most) << friction;
  }
}

// A grasp that slips moves its targets, and its step is solved again with them; a spring of no strength makes it a step of two organs.
TEST(MovedOrgans, AGraspThatSlipsHasTheForceThatItHasInItsSceneAlone) {
  SceneDef def = moved_def();
  def.contact = PALPATE_CONTACT_PATCH, def.collision = PALPATE_COLLISION_OFF, def.grasps.grasps = 1;
  SceneDef still = def;
  still.motions.motions = 0;
  const palpate_pose start = palpate_default_pose(), aside = pose_at({0.3, 0, 0});
  const palpate_world_organ organs[] = {organ_of(box().bundle(), &def, &start),
                                        organ_of(box().bundle(), &still, &aside)};
  palpate_world_def world_def = palpate_default_world_def();
  world_def.organs = organs, world_def.organ_count = 2, world_def.max_links = 1;
  palpate_world* made = nullptr;
  ASSERT_EQ(palpate_world_create(&world_def, &made, nullptr), PALPATE_OK);
  const WorldPointer world(made);
  palpate_world_link spring = palpate_default_world_link();
  spring.kind = PALPATE_LINK_SPRING, spring.stiffness = 1e-9, spring.organ[0] = 0, spring.organ[1] = 1;
  for (palpate_link_end& end : spring.ends) {
    end.kind = PALPATE_END_SURFACE_POINT, end.triangle = box().far_triangle(0);
    Eigen::Map<Vector3d>(end.barycentric) = Vector3d(.3, .3, .4);
  }
  ASSERT_EQ(palpate_world_set_links(made, &spring, 1, nullptr), PALPATE_OK);
  const ScenePointer alone = box().scene(def);
  WorldContacts together(made);
  Contacts contacts(alone.get());

  palpate_grasp grasp = palpate_default_grasp();
  grasp.triangle = box().far_triangle(9), grasp.radius = 0.006, grasp.friction = 0.4, grasp.clamp_force = 0.3;
  Eigen::Map<Vector3d>(grasp.barycentric) = Vector3d(.3, .3, .4);
  Eigen::Map<Vector3d>(grasp.position) = box().place(grasp.triangle, {.3, .3, .4});
  palpate_tool tool = palpate_default_tool();
  tool.id = 3, tool.parts = &grasp.part;
  int slips = 0;
  for (int s = 0; s < 120; ++s) {
    const double q = 0.002 * std::sin(0.2 * s);
    set_amounts(alone.get(), {q, 0, 0, 0});
    set_amounts(palpate_world_scene(made, 0), {q, 0, 0, 0});
    grasp.position[0] += 0.03e-3, grasp.position[1] += 0.05e-3;
    palpate_scene_touch(alone.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes());
    palpate_world_touch(made, &tool, 1, 1e-3, together.get(), together.bytes());
    const Vector3d expected(palpate_contacts_tool(contacts, 0)->force_raw), found(together.tool(0).force_raw);
    // Both solvers end within 1e-6 of the largest target; 1e-3 of the force is how near a slip comes to its limit.
    EXPECT_LT((found - expected).norm(), 2e-3 * 0.12) << s;
    const palpate_grasp_state& state = *palpate_scene_grasp_state(palpate_world_scene(made, 0), 3);
    slips += state.condition == PALPATE_GRASP_SLIPS;
    if (state.condition != PALPATE_GRASP_LET_GO) {
      EXPECT_LT(found.norm(), 0.12 * 1.002) << s;
    }
  }
  EXPECT_GT(slips, 20);
}

}  // namespace
}  // namespace palpate::tests
