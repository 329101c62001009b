// A world of organs: the bits of its scenes, tools that are far, sums over organs, states, refusals.
#include <thread>

#include "runtime/base/step_work.h"
#include "tests/runtime/world/played_world.h"
#include "tests/support/bundle_forms.h"
#include "tests/support/relaxation.h"

namespace palpate::tests {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

const TouchedBox& box() {
  static const TouchedBox shared({}, add_everything);
  return shared;
}

SceneDef def_with(palpate_collision collision, palpate_contact_law law) {
  SceneDef def;
  def.collision = collision, def.law = law, def.report.report = PALPATE_REPORT_CONTACTS;
  def.relaxation = relaxation_of({{0.5, 0.02}});
  def.max_operations = 10'000'000;  // nothing is put off: no points of far tools are tested
  return def;
}

std::vector<SceneDef> some_defs() {
  std::vector<SceneDef> defs;
  for (const auto collision : {PALPATE_COLLISION_OFF, PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED})
    for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_SLIDING, PALPATE_LAW_COULOMB})
      defs.push_back(def_with(collision, law));
  return defs;
}

// Two tools of three points, which go in and out of boxes that stand at `places`, and jump from one to the next between them. Now and then
// one is not sent, or sends numbers that are no numbers.
class Hands {
 public:
  explicit Hands(std::vector<Vector3d> places) : places_(std::move(places)) {}
  const std::vector<palpate_tool>& at(int s) {
    tools_.clear();
    for (int t = 0; t < 2; ++t) {
      if (s % 130 > 120 && t == s / 130 % 2) continue;
      const Vector3d& place = places_[static_cast<std::size_t>((s + 37 * t) / 100) % places_.size()];
      for (int i = 0; i < 3; ++i) {
        const Vector3d p =
            place + Vector3d(0.0605 + 0.004 * std::cos(0.09 * s + t), 0.02 + 0.007 * i + 0.003 * std::sin(0.05 * s),
                             0.012 + 0.009 * t + 0.002 * std::sin(0.04 * s));
        std::copy(p.begin(), p.end(), points_[t][i]);
        if (s % 77 == 5 && i == t) points_[t][i][1] = NAN;
      }
      palpate_tool tool = point_tool(points_[t][0], 3, 0.003, 0.3);
      tool.id = 7 - t, tool.has_torque = 1;
      Eigen::Map<Vector3d>(tool.reference) = place;
      tools_.push_back(tool);
    }
    if (s % 3 == 0) std::reverse(tools_.begin(), tools_.end());
    return tools_;
  }

 private:
  std::vector<Vector3d> places_;
  double points_[2][3][3] = {};
  std::vector<palpate_tool> tools_;
};

palpate_step_flags touch(palpate_world* world, WorldContacts& contacts, const std::vector<palpate_tool>& tools) {
  return palpate_world_touch(world, tools.data(), static_cast<std::int32_t>(tools.size()), 1e-3, contacts.get(),
                             contacts.bytes());
}

// Whether the bytes are the same, but for the counted operations.
void expect_same(const palpate_contacts& one, const palpate_contacts& other, const palpate_scene* scene, int s) {
  ASSERT_EQ(one.used_bytes, other.used_bytes) << s;
  Contacts a(scene), b(scene);
  std::memcpy(a.get(), &one, one.used_bytes), std::memcpy(b.get(), &other, other.used_bytes);
  a->operations = b->operations = 0;
  ASSERT_EQ(std::memcmp(a.get(), b.get(), one.used_bytes), 0) << s;
}

TEST(World, OfOneOrganGivesTheBitsOfItsScene) {
  const palpate_pose pose = pose_at({0.1, -0.2, 0.05}, Quaterniond(AngleAxisd(0.7, Vector3d(1, 2, 3).normalized())));
  for (const SceneDef& def : some_defs()) {
    const ScenePointer scene = box().scene(def);
    ASSERT_EQ(palpate_scene_set_pose(scene.get(), &pose, nullptr), PALPATE_OK);
    const WorldPointer world = world_of({organ_of(box().bundle(), &def, &pose)});
    ASSERT_TRUE(world);
    Contacts alone(scene.get());
    WorldContacts in_world(world.get());
    Hands hands({{0.1, -0.2, 0.05}});
    long touched = 0;
    for (int s = 0; s < 300; ++s) {
      const auto& tools = hands.at(s);
      const auto count = static_cast<std::int32_t>(tools.size());
      const double dt = s % 50 == 9 ? NAN : 1e-3;
      const auto expected = palpate_scene_touch(scene.get(), tools.data(), count, dt, alone.get(), alone.bytes());
      EXPECT_EQ(palpate_world_touch(world.get(), tools.data(), count, dt, in_world.get(), in_world.bytes()), expected);
      ASSERT_EQ(in_world.organ(0).used_bytes, alone->used_bytes);
      ASSERT_EQ(std::memcmp(&in_world.organ(0), alone.get(), alone->used_bytes), 0) << s;
      for (std::int32_t i = 0; i < alone->tool_count; ++i) {
        const palpate_tool_state& tool = *palpate_contacts_tool(alone, i);
        EXPECT_EQ(std::memcmp(in_world.tool(i).force, tool.force, sizeof tool.force), 0) << s;
        EXPECT_EQ(std::memcmp(in_world.tool(i).torque, tool.torque, sizeof tool.torque), 0) << s;
        EXPECT_EQ(in_world.tool(i).flags, tool.flags) << s;
        touched += tool.contact_count;
      }
    }
    EXPECT_EQ(touched > 100, def.collision != PALPATE_COLLISION_OFF);
  }
}

// One bundle stands in both organs. The tools jump from one organ to the other within a step, also into it.
TEST(World, OfOrgansApartGivesTheBitsOfTheirScenes) {
  const Vector3d places[2] = {{0, 0, 0}, {0.25, 0.02, -0.01}};
  const palpate_pose poses[2] = {pose_at(places[0]),
                                 pose_at(places[1], Quaterniond(AngleAxisd(0.05, Vector3d(0, 0, 1))))};
  for (SceneDef def : some_defs())
    for (const double speed : {10.0, double(INFINITY)}) {
      def.max_tool_speed = speed;
      ScenePointer scenes[2] = {box().scene(def), box().scene(def)};
      Contacts alone[2] = {Contacts(scenes[0].get()), Contacts(scenes[1].get())};
      for (int k = 0; k < 2; ++k) palpate_scene_set_pose(scenes[k].get(), &poses[k], nullptr);
      const WorldPointer world =
          world_of({organ_of(box().bundle(), &def, &poses[0]), organ_of(box().bundle(), &def, &poses[1])});
      ASSERT_TRUE(world);
      WorldContacts in_world(world.get());
      Hands hands({places[0], places[1]});
      long touched[2] = {}, far = 0;
      for (int s = 0; s < 500; ++s) {
        // The second organ drifts, so that tools at rest come near too.
        palpate_pose drifting = poses[1];
        drifting.position[0] += 0.03 * std::sin(0.02 * s);
        palpate_scene_set_pose(scenes[1].get(), &drifting, nullptr);
        palpate_scene_set_pose(palpate_world_scene(world.get(), 1), &drifting, nullptr);
        const auto& tools = hands.at(s);
        const auto count = static_cast<std::int32_t>(tools.size());
        palpate_world_touch(world.get(), tools.data(), count, 1e-3, in_world.get(), in_world.bytes());
        for (int k = 0; k < 2; ++k) {
          palpate_scene_touch(scenes[k].get(), tools.data(), count, 1e-3, alone[k].get(), alone[k].bytes());
          expect_same(in_world.organ(k), *alone[k].get(), scenes[k].get(), s);
          if (testing::Test::HasFatalFailure()) return;
          const palpate_contact_report *one = palpate_scene_report(scenes[k].get()),
                                       *other = palpate_scene_report(palpate_world_scene(world.get(), k));
          ASSERT_EQ(one->used_bytes, other->used_bytes) << s;
          ASSERT_EQ(std::memcmp(one, other, one->used_bytes), 0) << s;
          for (std::int32_t i = 0; i < count; ++i) touched[k] += palpate_contacts_tool(alone[k], i)->contact_count;
          far += count - in_world.state(k).near_tools;
        }
      }
      const bool collides = def.collision != PALPATE_COLLISION_OFF;
      for (const long count : touched) EXPECT_EQ(count > 50, collides);
      EXPECT_EQ(far > 100, collides);
    }
}

// The second organ stands 30 mm beside the tool, so near that its scene alone looks for its nearest triangle.
TEST(World, AFarToolCostsABoxTest) {
  const SceneDef def = def_with(PALPATE_COLLISION_DEFORMED, PALPATE_LAW_UNILATERAL);
  const palpate_pose beside = pose_at({0, 0.06, 0});
  const WorldPointer world =
      world_of({organ_of(box().bundle(), &def, nullptr), organ_of(box().bundle(), &def, &beside)});
  const ScenePointer scene = box().scene(def);
  ASSERT_EQ(palpate_scene_set_pose(scene.get(), &beside, nullptr), PALPATE_OK);
  Contacts alone(scene.get());
  WorldContacts in_world(world.get());
  // Of taking the points in.
  constexpr std::int64_t taken_in = 10 * StepWork::kOfPoint;
  std::int64_t counted = 0, near = 0;
  for (int s = 0; s < 100; ++s) {
    double points[10][3];
    for (int i = 0; i < 10; ++i) points[i][0] = 0.061 - 2e-5 * s, points[i][1] = 0.01 + 2e-3 * i, points[i][2] = 0.02;
    const palpate_tool tool = point_tool(points[0], 10);
    palpate_world_touch(world.get(), &tool, 1, 1e-3, in_world.get(), in_world.bytes());
    palpate_scene_touch(scene.get(), &tool, 1, 1e-3, alone.get(), alone.bytes());
    EXPECT_EQ(in_world.state(1).near_tools, 0);
    EXPECT_EQ(in_world.organ(1).operations, taken_in) << s;
    counted += alone->operations - taken_in, near += in_world.organ(0).operations - taken_in;
  }
  EXPECT_GT(counted, 100);
  EXPECT_GT(near, 1000);
  EXPECT_EQ(in_world.state(0).near_tools, 1);
  EXPECT_EQ(in_world.tool(0).organ_count, 1);
}

// The world takes in points that no organ tests. More than the operations of a step allow are refused, as of a scene.
TEST(World, CountsThePointsOfToolsThatAreFarFromAllOrgansAndRefusesMoreThanFit) {
  SceneDef def;
  def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_POINT;
  def.max_tools = 1, def.max_points = 2'000, def.max_operations = 200'000;
  const palpate_pose beside = pose_at({0, 0.06, 0});
  const WorldPointer world =
      world_of({organ_of(box().bundle(), &def, nullptr), organ_of(box().bundle(), &def, &beside)});
  WorldContacts contacts(world.get());
  const std::vector<double> points(3 * static_cast<std::size_t>(def.max_points), 1.0);
  const palpate_tool tool = point_tool(points.data(), def.max_points);
  for (int s = 0; s < 3; ++s) {
    palpate_world_touch(world.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes());
    for (int k = 0; k < 2; ++k) {
      EXPECT_EQ(contacts.state(k).near_tools, 0);
      EXPECT_EQ(contacts.organ(k).operations, StepWork::kOfPoint * def.max_points);
    }
  }
  def.max_points = 20'000;
  const auto organ = organ_of(box().bundle(), &def, nullptr);
  palpate_world_def both = palpate_default_world_def();
  both.organs = &organ, both.organ_count = 1;
  palpate_world* refused = nullptr;
  palpate_error error = {};
  EXPECT_NE(palpate_world_create(&both, &refused, &error), PALPATE_OK);
  EXPECT_THAT(std::string(error.text), testing::HasSubstr("max_operations"));
  EXPECT_EQ(refused, nullptr);
}

TEST(World, SumsForcesAndTorquesOverOrgansThatAToolTouches) {
  // Two boxes side by side with a slit between them. A tool of two points presses on both.
  const SceneDef def = def_with(PALPATE_COLLISION_REST, PALPATE_LAW_STICKING);
  const palpate_pose beside = pose_at({0, 0.055, 0});
  const WorldPointer world =
      world_of({organ_of(box().bundle(), &def, nullptr), organ_of(box().bundle(), &def, &beside)});
  WorldContacts contacts(world.get());
  for (int s = 0; s < 20; ++s) {
    const double x = 0.0605 - 1e-4 * s, points[6] = {x, 0.025, 0.02, x, 0.08, 0.02};
    palpate_tool tool = point_tool(points, 2, 0.003);
    tool.has_torque = 1;
    touch(world.get(), contacts, {tool});
  }
  const palpate_world_tool_state& tool = contacts.tool(0);
  EXPECT_EQ(tool.organ_count, 2);
  EXPECT_EQ(tool.contact_count, 2);
  Vector3d force = Vector3d::Zero(), torque = force, on_organs = force, torque_on_organs = force;
  for (int k = 0; k < 2; ++k) {
    const palpate_tool_state& state = *palpate_contacts_tool(&contacts.organ(k), 0);
    force += Vector3d(state.force_raw), torque += Vector3d(state.torque_raw);
    const Vector3d f(contacts.state(k).force), origin(0, 0.055 * k, 0);
    on_organs += f;
    torque_on_organs += Vector3d(contacts.state(k).torque) + origin.cross(f);
    EXPECT_LT(f.x(), -1e-3);
  }
  EXPECT_EQ(Vector3d(tool.force_raw), force);
  EXPECT_EQ(Vector3d(tool.torque_raw), torque);
  // Instantaneous forces; those on the tool are relaxed, by less than a half. Rounding, against newtons.
  EXPECT_GT(on_organs.norm(), force.norm());
  EXPECT_LT(on_organs.norm(), 2 * force.norm());
  // Both levers begin at the world's origin: places at rest differ from the tool points by the push of 1.4 mm.
  EXPECT_LT((torque_on_organs / on_organs.norm() + torque / force.norm()).norm(), 2e-3);
}

TEST(World, LimitsTheForceOfAllOrgansTogether) {
  const SceneDef def = unlimited_def();
  const palpate_pose beside = pose_at({0, 0.055, 0});
  const palpate_world_organ organs[2] = {organ_of(box().bundle(), &def, nullptr),
                                         organ_of(box().bundle(), &def, &beside)};
  palpate_world_def wanted = palpate_default_world_def();
  wanted.organs = organs, wanted.organ_count = 2, wanted.force_limit = 0.01, wanted.force_slew = 1;
  palpate_world* made = nullptr;
  ASSERT_EQ(palpate_world_create(&wanted, &made, nullptr), PALPATE_OK);
  const WorldPointer world(made);
  WorldContacts contacts(world.get());
  double last = 0;
  for (int s = 0; s < 40; ++s) {
    const double x = 0.0605 - 1e-4 * s, points[6] = {x, 0.025, 0.02, x, 0.08, 0.02};
    const palpate_tool tool = point_tool(points, 2, 0.003);
    touch(world.get(), contacts, {tool});
    const double size = Vector3d(contacts.tool(0).force).norm();
    EXPECT_LE(size, 0.01 * (1 + 1e-12));
    EXPECT_LE(std::fabs(size - last), 1e-3 * (1 + 1e-9));
    last = size;
  }
  EXPECT_NEAR(last, 0.01, 1e-12);
  EXPECT_TRUE(contacts.tool(0).flags & PALPATE_STEP_FORCE_LIMITED);
  EXPECT_TRUE(contacts->flags & PALPATE_STEP_FORCE_LIMITED);
}

TEST(World, GripsHoldTheOrganThatTheirToolNames) {
  const SceneDef def = unlimited_def();
  const palpate_pose apart = pose_at({0.5, 0, 0});
  const WorldPointer world =
      world_of({organ_of(box().bundle(), &def, nullptr), organ_of(box().bundle(), &def, &apart)});
  WorldContacts contacts(world.get());
  const palpate_grip grip = grip_at_node(box().touchable[3], {0, 0, 1e-3});
  palpate_tool tool = grip_tool(&grip);
  tool.organ = 1;
  EXPECT_EQ(touch(world.get(), contacts, {tool}), 0u);
  EXPECT_EQ(contacts.organ(0).node_count, 0);
  EXPECT_EQ(contacts.organ(1).node_count, 1);
  EXPECT_GT(Vector3d(contacts.state(1).force).z(), 0);
  tool.organ = 2;
  EXPECT_EQ(touch(world.get(), contacts, {tool}), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(contacts.organ(1).node_count, 1);  // it keeps its last good input
}

TEST(World, ARestoredStateGoesOnWithTheSameBits) {
  const SceneDef def = def_with(PALPATE_COLLISION_DEFORMED, PALPATE_LAW_COULOMB);
  const Vector3d places[2] = {{0, 0, 0}, {0.25, 0.02, -0.01}};
  const palpate_pose apart = pose_at(places[1]);
  const std::vector<palpate_world_organ> organs = {organ_of(box().bundle(), &def, nullptr),
                                                   organ_of(box().bundle(), &def, &apart)};
  const WorldPointer played = world_of(organs), other = world_of(organs);
  WorldContacts one(played.get()), two(other.get());
  Hands hands({places[0], places[1]});
  std::vector<std::uint64_t> state;
  for (int s = 0; s < 400; ++s) {
    const auto& tools = hands.at(s);
    const auto count = static_cast<std::int32_t>(tools.size());
    const auto flags = palpate_world_touch(played.get(), tools.data(), count, 1e-3, one.get(), one.bytes());
    if (s == 110) {  // one tool is far from the first organ, the other one from the second
      state.resize(palpate_world_state_bytes(played.get()) / 8);
      ASSERT_EQ(palpate_world_save(played.get(), state.data(), 8 * state.size(), nullptr), PALPATE_OK);
      palpate_error error = {};
      ASSERT_EQ(palpate_world_restore(other.get(), state.data(), 8 * state.size(), &error), PALPATE_OK) << error.text;
    } else if (s < 110) {
      palpate_world_touch(other.get(), tools.data(), s % 2, 1e-3, two.get(), two.bytes());
    } else {
      EXPECT_EQ(palpate_world_touch(other.get(), tools.data(), count, 1e-3, two.get(), two.bytes()), flags);
      ASSERT_EQ(one->used_bytes, two->used_bytes);
      ASSERT_EQ(std::memcmp(one.get(), two.get(), one->used_bytes), 0) << s;
    }
  }
  // A state that is damaged anywhere is refused, and nothing changes.
  palpate_error error = {};
  for (const std::size_t at : {std::size_t{3}, state.size() / 2, state.size() - 1}) {
    std::vector<std::uint64_t> damaged = state;
    damaged[at] ^= 1;
    EXPECT_NE(palpate_world_restore(other.get(), damaged.data(), 8 * damaged.size(), &error), PALPATE_OK);
  }
  EXPECT_EQ(palpate_world_restore(other.get(), state.data(), 8 * state.size() - 8, &error), PALPATE_ERROR_TRUNCATED);
  const WorldPointer smaller = world_of({organs[0]});
  EXPECT_EQ(palpate_world_restore(smaller.get(), state.data(), 8 * state.size(), &error), PALPATE_ERROR_ARGUMENT);
  const auto& tools = hands.at(401);
  palpate_world_touch(played.get(), tools.data(), 2, 1e-3, one.get(), one.bytes());
  palpate_world_touch(other.get(), tools.data(), 2, 1e-3, two.get(), two.bytes());
  EXPECT_EQ(std::memcmp(one.get(), two.get(), one->used_bytes), 0);
}

TEST(World, ResetMakesItNew) {
  const SceneDef def = def_with(PALPATE_COLLISION_DEFORMED, PALPATE_LAW_COULOMB);
  const palpate_pose apart = pose_at({0.25, 0.02, -0.01});
  const std::vector<palpate_world_organ> organs = {organ_of(box().bundle(), &def, nullptr),
                                                   organ_of(box().bundle(), &def, &apart)};
  const WorldPointer used = world_of(organs), fresh = world_of(organs);
  WorldContacts one(used.get()), two(fresh.get());
  Hands hands({{0, 0, 0}, {0.25, 0.02, -0.01}});
  const auto step = [&](palpate_world* world, WorldContacts& contacts, int s) { touch(world, contacts, hands.at(s)); };
  for (int s = 0; s < 250; ++s) step(used.get(), one, s);
  palpate_world_reset(used.get());
  for (int s = 0; s < 250; ++s) {
    step(used.get(), one, s), step(fresh.get(), two, s);
    ASSERT_EQ(one->used_bytes, two->used_bytes);
    ASSERT_EQ(std::memcmp(one.get(), two.get(), one->used_bytes), 0) << s;
  }
}

// The shape of one organ beside the touch of all.
TEST(World, ShapesRunInThreadsOfTheirOwn) {
  const SceneDef def = def_with(PALPATE_COLLISION_DEFORMED, PALPATE_LAW_COULOMB);
  const palpate_pose apart = pose_at({0.25, 0.02, -0.01});
  const WorldPointer world =
      world_of({organ_of(box().bundle(), &def, nullptr), organ_of(box().bundle(), &def, &apart)});
  WorldContacts contacts(world.get());
  Hands hands({{0, 0, 0}});
  for (int s = 0; s < 90; ++s) touch(world.get(), contacts, hands.at(s));
  WorldContacts copy(world.get());
  copy.memory = contacts.memory;
  const auto nodes = box().body.surface_nodes;
  std::vector<float> u;
  std::thread shape([&] {
    for (int i = 0; i < 50; ++i) u = displacements(palpate_world_scene(world.get(), 0), &copy.organ(0), nodes);
  });
  for (int s = 90; s < 200; ++s) touch(world.get(), contacts, hands.at(s));
  shape.join();
  EXPECT_GT(*std::max_element(u.begin(), u.end()), 1e-5f);
  // The organ that nobody touches is at rest, with the contacts of its own.
  for (const float x : displacements(palpate_world_scene(world.get(), 1), &copy.organ(1), nodes)) EXPECT_EQ(x, 0);
}

TEST(World, ItsPlanHasThePassesOfAllOrgans) {
  const SceneDef rest = def_with(PALPATE_COLLISION_REST, PALPATE_LAW_STICKING),
                 deformed = def_with(PALPATE_COLLISION_DEFORMED, PALPATE_LAW_COULOMB);
  const WorldPointer world =
      world_of({organ_of(box().bundle(), &rest, nullptr), organ_of(box().bundle(), &deformed, nullptr)});
  std::int32_t pass = 0, organ = -2;
  for (std::int32_t k = 0; k < 2; ++k)
    for (const palpate_plan_pass& expected : plan_of(palpate_world_scene(world.get(), k))) {
      const palpate_plan_pass* found = palpate_world_plan(world.get(), pass++, &organ);
      ASSERT_TRUE(found);
      EXPECT_STREQ(found->name, expected.name);
      EXPECT_EQ(organ, k);
    }
  for (const char* name : {"world: input", "world: output"}) {
    const palpate_plan_pass* found = palpate_world_plan(world.get(), pass++, &organ);
    ASSERT_TRUE(found);
    EXPECT_STREQ(found->name, name);
    EXPECT_EQ(organ, -1);
  }
  EXPECT_EQ(palpate_world_plan(world.get(), pass, &organ), nullptr);
  EXPECT_EQ(palpate_world_plan(world.get(), -1, nullptr), nullptr);
}

// Each pass of a touch is told by its index in the world's plan, and has a prediction.
TEST(World, WatchesAndPredictsThePassesOfItsPlan) {
  const SceneDef def = def_with(PALPATE_COLLISION_DEFORMED, PALPATE_LAW_UNILATERAL);
  const palpate_pose beside = pose_at({0.2, 0, 0});
  const palpate_world_organ organs[2] = {organ_of(box().bundle(), &def, nullptr),
                                         organ_of(box().bundle(), &def, &beside)};
  for (const std::int32_t pairs : {0, 20}) {
    palpate_world_def wanted = palpate_default_world_def();
    wanted.organs = organs, wanted.organ_count = 2, wanted.max_pairs = pairs;
    palpate_world* made = nullptr;
    ASSERT_EQ(palpate_world_create(&wanted, &made, nullptr), PALPATE_OK);
    const WorldPointer world(made);
    std::vector<int> seen;
    palpate_world_watch_passes(
        made, [](void* user, std::int32_t pass) { ++static_cast<std::vector<int>*>(user)->at(pass); }, &seen);
    palpate_step_load load = palpate_default_step_load();
    load.tools = load.points = load.contacts = 1, load.rows = load.nodes = 3, load.sweeps = 1;
    std::int32_t pass = 0, of_world = 0, organ = 0;
    while (const palpate_plan_pass* found = palpate_world_plan(made, pass, &organ)) {
      const palpate_pass_work work = palpate_world_predict_pass(made, pass, &load);
      EXPECT_EQ(work.bytes + work.flops + work.steps > 0, std::strcmp(found->half, "create") != 0) << found->name;
      seen.push_back(0), ++pass, of_world += organ < 0;
    }
    EXPECT_EQ(of_world, pairs > 0 ? 4 : 2);
    EXPECT_EQ(palpate_world_predict_pass(made, pass, &load).steps, 0);
    WorldContacts contacts(made);
    palpate_world_touch(made, nullptr, 0, 1e-3, contacts.get(), contacts.bytes());
    for (std::int32_t p = 0; p < pass; ++p) {
      const palpate_plan_pass& found = *palpate_world_plan(made, p, nullptr);
      EXPECT_EQ(seen[p] > 0, std::strcmp(found.half, "touch") == 0) << p << " " << found.name;
    }
    const std::vector<int> before = seen;
    palpate_world_watch_passes(made, nullptr, nullptr);
    palpate_world_touch(made, nullptr, 0, 1e-3, contacts.get(), contacts.bytes());
    EXPECT_EQ(seen, before);
  }
}

TEST(World, RefusesWithASentenceThatNamesTheOrgan) {
  const SceneDef def;
  SceneDef other = def;
  other.max_points = 65;
  palpate_error error = {};
  EXPECT_FALSE(world_of({organ_of(box().bundle(), &def, nullptr), organ_of(box().bundle(), &other, nullptr)}, &error));
  EXPECT_EQ(error.status, PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, testing::AllOf(testing::StartsWith("organ 1: "), testing::HasSubstr("found 4 and 65")));
  EXPECT_FALSE(world_of({organ_of(box().bundle(), &def, nullptr), organ_of(nullptr, &def, nullptr)}, &error));
  EXPECT_THAT(error.text, testing::StartsWith("organ 1: bundle"));
  EXPECT_FALSE(world_of({}, &error));
  EXPECT_THAT(error.text, testing::HasSubstr("organ_count"));
  other = def, other.max_tools = 0;
  EXPECT_FALSE(world_of({organ_of(box().bundle(), &other, nullptr)}, &error));
  EXPECT_THAT(error.text, testing::AllOf(testing::StartsWith("organ 0: "), testing::HasSubstr("max_tools")));
  palpate_pose nowhere = palpate_default_pose();
  nowhere.position[1] = NAN;
  EXPECT_FALSE(world_of({organ_of(box().bundle(), &def, &nowhere)}, &error));
  EXPECT_EQ(std::string(error.text).substr(0, 10), "organ 0: p");
}

TEST(World, StepsAndSavesItsScenesItself) {
  const SceneDef def;
  const WorldPointer world = world_of({organ_of(box().bundle(), &def, nullptr)});
  palpate_scene* scene = palpate_world_scene(world.get(), 0);
  ASSERT_TRUE(scene);
  EXPECT_EQ(palpate_world_scene(world.get(), 1), nullptr);
  Contacts contacts(scene);
  EXPECT_EQ(palpate_scene_touch(scene, nullptr, 0, 1e-3, contacts.get(), contacts.bytes()), PALPATE_STEP_BAD_INPUT);
  std::vector<std::uint64_t> state(palpate_scene_state_bytes(scene) / 8);
  palpate_error error = {};
  EXPECT_EQ(palpate_scene_save(scene, state.data(), 8 * state.size(), &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_restore(scene, state.data(), 8 * state.size(), &error), PALPATE_ERROR_ARGUMENT);
  WorldContacts small(world.get());
  EXPECT_EQ(
      palpate_world_touch(world.get(), nullptr, 0, 1e-3, small.get(), palpate_world_contacts_bytes(world.get()) - 8),
      PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_world_touch(world.get(), nullptr, 0, 1e-3, small.get(), small.bytes()), 0u);
}

}  // namespace
}  // namespace palpate::tests
