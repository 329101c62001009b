// Bad input from a device, a socket or a careless caller: never a crash, never a force spike, always a flag.
#include "tests/runtime/touched_box.h"

namespace palpate::tests {
namespace {

// A tool point pressed 1 mm into the far face.
struct Pressed : TouchedScene {
  explicit Pressed(const SceneDef& def) : TouchedScene(tiny_box(), def) {
    const std::int32_t triangle = tiny_box().far_triangle(5);
    place = tiny_box().place(triangle, {.3, .3, .4}), out = tiny_box().outward(triangle);
    move(place + 0.001 * out);
    move(place - 0.001 * out);
  }
  palpate_step_flags move(const Eigen::Vector3d& p, double dt = 1e-3) { return press(p, 0, 0, dt); }
  Eigen::Vector3d force() { return Eigen::Vector3d(tool().force); }
  Eigen::Vector3d raw() { return TouchedScene::force(); }
  Eigen::Vector3d place, out;
};

TEST(Device, KeepsTheLastGoodInputWhenItSendsNonsense) {
  Pressed tool(unlimited_def());
  const Eigen::Vector3d before = tool.raw();
  ASSERT_GT(before.norm(), 0);
  for (const double bad : {double(NAN), double(INFINITY), -double(INFINITY), 1e300, -1e7}) {
    EXPECT_EQ(tool.move({bad, 0, 0}), PALPATE_STEP_BAD_INPUT);
    EXPECT_EQ(tool.raw(), before);
    EXPECT_EQ(tool.tool().flags, PALPATE_STEP_BAD_INPUT);
  }
  EXPECT_EQ(tool.move(tool.place - 0.001 * tool.out), 0u);
  EXPECT_EQ(tool.raw(), before);
  for (const double dt : {0.0, -1.0, double(NAN), double(INFINITY)})
    EXPECT_EQ(tool.move(tool.place - 0.001 * tool.out, dt), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(tool.raw(), before);
}

TEST(Device, KeepsTheLastGoodInputWhenCountsAndPointersAreWrong) {
  Pressed tool(unlimited_def());
  const Eigen::Vector3d before = tool.raw();
  double p[3] = {};
  palpate_grip grip = grip_at_node(3, {0, 0, 0.001});
  const auto with_grips = [&](const palpate_grip* grips, std::int32_t count) {
    palpate_tool both = point_tool(p);
    both.grips = grips, both.grip_count = count;
    return both;
  };
  const auto expect_kept = [&](const palpate_tool* tools, std::int32_t count) {
    EXPECT_EQ(tool.touch(tools, count), PALPATE_STEP_BAD_INPUT);
    EXPECT_EQ(tool.raw(), before);
  };
  static double packed[4] = {};  // a device's record, at an odd address
  const auto* odd = reinterpret_cast<const double*>(reinterpret_cast<const char*>(packed) + 4);
  expect_kept(nullptr, 1);
  expect_kept(nullptr, -3);
  expect_kept(reinterpret_cast<const palpate_tool*>(odd), 1);
  for (const palpate_tool& bad :
       {point_tool(nullptr), point_tool(p, -1), with_grips(nullptr, 1), with_grips(&grip, -1),
        with_grips(nullptr, INT32_MIN), point_tool(nullptr, INT32_MAX), point_tool(odd), point_tool(p, 1, 1.1),
        point_tool(p, 1, -1e-3), point_tool(p, 1, .003, 101), point_tool(p, 1, .003, -1e-3)})
    expect_kept(&bad, 1);
  std::vector<palpate_grip> bad_grips;
  for (const std::int32_t node : {1 << 30, tiny_box().body.surface_nodes})
    bad_grips.push_back(grip_at_node(node, {0, 0, 0}));
  for (const std::int32_t triangle :
       {-1, INT32_MAX, INT32_MIN, static_cast<std::int32_t>(tiny_box().body.triangles.size())})
    bad_grips.push_back(grip_at_place(triangle, {.2, .3, .5}, {0, 0, 0}));
  for (const Eigen::Vector3d& k :
       {Eigen::Vector3d(.5, .5, .5), Eigen::Vector3d(2, -1, 0), Eigen::Vector3d(NAN, .5, .5)})
    bad_grips.push_back(grip_at_place(0, k, {0, 0, 0}));
  bad_grips.push_back(grip_at_node(3, {NAN, 0, 0}));
  bad_grips.push_back(grip_at_node(3, {0, 0, 0}, 0));
  bad_grips.push_back(grip_at_node(3, {0, 0, 0}, 8));
  for (const palpate_grip& bad : bad_grips) {
    const palpate_tool with_bad = grip_tool(&bad);
    expect_kept(&with_bad, 1);
  }
  EXPECT_EQ(palpate_scene_touch(nullptr, nullptr, 0, 1e-3, tool.contacts.get(), tool.contacts.bytes()),
            PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_touch(tool.scene.get(), nullptr, 0, 1e-3, nullptr, SIZE_MAX), PALPATE_STEP_BAD_INPUT);
  const std::vector<palpate_tool> many(20, point_tool(p));  // more than the scene has
  EXPECT_EQ(tool.touch(many), PALPATE_STEP_CONTACTS_DROPPED);
}

TEST(Device, IsNotSentAForceAboveTheLimitNorAJump) {
  SceneDef def;
  def.force_limit = 0.5, def.force_slew = 20;
  Pressed tool(def);
  Eigen::Vector3d last = tool.force();
  bool limited = false;
  std::uint32_t state = 1;
  const auto random = [&] {  // any reproducible noise
    state = state * 1664525u + 1013904223u;
    return (state >> 8) * (1.0 / (1 << 24)) - 0.5;
  };
  for (int s = 0; s < 3000; ++s) {  // jumps of metres in a millisecond
    Eigen::Vector3d p = tool.place + Eigen::Vector3d(random(), random(), random()) * (s % 10 == 0 ? 4 : 0.01);
    if (s % 17 == 0) p[s % 3] = NAN;
    const palpate_step_flags flags = tool.move(p);
    ASSERT_TRUE(tool.force().allFinite());
    ASSERT_LE(tool.force().norm(), 0.5 * (1 + 1e-12));
    ASSERT_LE((tool.force() - last).norm(), 20 * 1e-3 * (1 + 1e-12));
    ASSERT_TRUE((tool.force() - tool.raw()).norm() <= 1e-12 || flags & PALPATE_STEP_FORCE_LIMITED);
    limited = limited || flags & PALPATE_STEP_FORCE_LIMITED;
    last = tool.force();
  }
  EXPECT_TRUE(limited);
}

TEST(Device, LeavesTheOtherToolsAsTheyAreWhenOneHasNoSoundRadius) {
  TouchedScene scene(tiny_box());
  const std::int32_t far[2] = {tiny_box().far_triangle(5), tiny_box().far_triangle(11)};
  const auto touch = [&](double depth, double radius) {
    Eigen::Vector3d p[2];
    for (int t = 0; t < 2; ++t) p[t] = tiny_box().place(far[t], {.3, .3, .4}) - depth * tiny_box().outward(far[t]);
    const palpate_tool tools[2] = {point_tool(p[0].data(), 1, 0.003), point_tool(p[1].data(), 1, radius)};
    scene.touch(tools);
    return scene.force();
  };
  touch(-1e-4, 0.003);
  const Eigen::Vector3d good = touch(1e-3, 0.003);
  ASSERT_GT(good.norm(), 0);
  for (const double radius : {double(NAN), -1.0, double(INFINITY), 1e300}) {
    EXPECT_EQ(touch(1e-3, radius), good) << radius;  // the other one keeps its last good input, radius included
    EXPECT_EQ(scene.tool().flags, 0u);
    EXPECT_EQ(scene.tool(1).flags, PALPATE_STEP_BAD_INPUT);
  }
  // A disc with a tiny radius has no noticeable stiffness. The scene.contacts beside it must stay solvable.
  for (const double radius : {5e-324, 1e-300, 1e-12}) {
    EXPECT_GT(touch(1e-3, radius).norm(), 0.5 * good.norm()) << radius;
    EXPECT_EQ(scene.contacts->flags, 0u);
    EXPECT_LT(scene.force(1).norm(), 1e-3 * good.norm());
  }
}

TEST(Device, HoldsAFrozenPointWithASteadyForce) {
  for (const auto collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED}) {
    Pressed tool(unlimited_def(collision));
    for (int s = 0; s < 10; ++s) tool.move(tool.place - 0.001 * tool.out);
    const Eigen::Vector3d held = tool.force();
    ASSERT_GT(held.norm(), 0);
    for (int s = 0; s < 5000; ++s) {
      EXPECT_EQ(tool.move(tool.place - 0.001 * tool.out), 0u);
      ASSERT_EQ(tool.force(), held);
    }
  }
}

TEST(Device, IsNotSentASpikeWhenTheContactBudgetIsExhausted) {
  SceneDef def;
  def.force_limit = 0.5, def.force_slew = 20, def.max_points = def.max_contact_nodes = 3;
  TouchedScene scene(tiny_box(), def);
  std::vector<std::int32_t> triangles;
  for (int which = 0; which < 6; ++which) triangles.push_back(tiny_box().far_triangle(which));
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  bool dropped = false;
  for (int s = 0; s < 400; ++s) {  // points that come and go, three of which have room
    std::vector<Eigen::Vector3d> points;
    for (std::size_t t = 0; t < triangles.size(); ++t)
      points.push_back(tiny_box().place(triangles[t], {.3, .3, .4}) +
                       0.002 * std::cos(0.1 * s + static_cast<double>(t)) * tiny_box().outward(triangles[t]));
    dropped = scene.touch({point_tool(points[0].data(), static_cast<std::int32_t>(points.size()))}) &
                  PALPATE_STEP_CONTACTS_DROPPED ||
              dropped;
    const Eigen::Vector3d force(scene.tool().force);
    ASSERT_LE(scene.contacts->node_count, 3);
    ASSERT_LE(force.norm(), 0.5 * (1 + 1e-12));
    ASSERT_LE((force - last).norm(), 20 * 1e-3 * (1 + 1e-12));
    last = force;
  }
  EXPECT_TRUE(dropped);
}

TEST(Device, DoesNothingWithOutputsThatAreNotAligned) {
  Pressed tool(unlimited_def());
  const auto before = tool.contacts.memory;
  auto* odd = reinterpret_cast<palpate_contacts*>(reinterpret_cast<char*>(tool.contacts.get()) + 4);
  EXPECT_EQ(palpate_scene_touch(tool.scene.get(), nullptr, 0, 1e-3, odd, tool.contacts.bytes()),
            PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(tool.contacts.memory, before);
  float u[64] = {};
  palpate_shape_out out = shape_out(reinterpret_cast<float*>(reinterpret_cast<char*>(u) + 2), nullptr, 4);
  EXPECT_EQ(palpate_scene_shape(tool.scene.get(), tool.contacts.get(), &out), PALPATE_STEP_BAD_INPUT);
  out.displacements = u;
  EXPECT_EQ(palpate_scene_shape(tool.scene.get(), odd, &out), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_shape(tool.scene.get(), tool.contacts.get(), &out), 0u);
}

TEST(Device, FeelsNothingWhenTheToolIsGone) {
  Pressed tool(unlimited_def());
  EXPECT_EQ(tool.touch(), 0u);
  EXPECT_EQ(tool.contacts->node_count, 0);
  EXPECT_EQ(tool.contacts->tool_count, 0);
  tool.move(tool.place - 0.001 * tool.out);  // back, inside: nothing until it has been outside
  EXPECT_EQ(tool.tool().contact_count, 0);
}

TEST(Shape, TrustsNothingInTheContactsItIsGiven) {
  Pressed tool(unlimited_def());
  const std::int32_t nodes = tiny_box().body.surface_nodes;
  const auto good = tool.shape();
  const auto with = [&](auto change) {
    Contacts bad(tool.scene.get());
    bad.memory = tool.contacts.memory;
    change(*bad.get(), *const_cast<palpate_contact_node*>(bad.nodes()));
    palpate_step_flags flags = 0;
    const auto u = displacements(tool.scene.get(), bad.get(), nodes, &flags);
    for (const float x : u) EXPECT_TRUE(std::isfinite(x));
    return flags;
  };
  using Node = palpate_contact_node;
  EXPECT_EQ(with([](palpate_contacts&, Node&) {}), 0u);
  EXPECT_EQ(with([](palpate_contacts& c, Node&) { c.node_count = -1; }), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(with([](palpate_contacts& c, Node&) { c.node_count = INT32_MAX; }), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(with([](palpate_contacts& c, Node&) { c.used_bytes = 7; }), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(with([](palpate_contacts& c, Node&) { c.tool_count = 1000; }), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(with([](palpate_contacts&, Node& n) { n.column = -1; }), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(with([](palpate_contacts&, Node& n) { n.column = 1 << 30; }), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(with([](palpate_contacts&, Node& n) { n.source = static_cast<palpate_contact_source>(-1); }),
            PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(with([](palpate_contacts&, Node& n) { n.index = 99; }), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(with([](palpate_contacts&, Node& n) { n.modified_displacement[1] = NAN; }), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(tool.shape(), good);

  palpate_step_flags flags = 0;
  for (const float x : displacements(tool.scene.get(), nullptr, nodes, &flags)) EXPECT_EQ(x, 0);
  EXPECT_EQ(flags, PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_scene_shape(nullptr, tool.contacts.get(), nullptr), PALPATE_STEP_BAD_INPUT);
  float u[6] = {9, 9, 9, 9, 9, 9};
  palpate_shape_out out = shape_out(u, nullptr, -5);
  EXPECT_EQ(palpate_scene_shape(tool.scene.get(), tool.contacts.get(), &out), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(out.node_count, 0);
  out.node_capacity = 1;  // a short array is filled as far as it goes
  EXPECT_EQ(palpate_scene_shape(tool.scene.get(), tool.contacts.get(), &out), 0u);
  EXPECT_EQ(out.node_count, 1);
  EXPECT_EQ(u[3], 9);
}

TEST(Device, GetsNoForceFromABundleWhoseTensorsAreNotFinite) {
  const TouchedBox bad({}, [](BundleParts& parts) {
    auto tensors = parts.get<float>(formats::SectionId::displacement_surface);
    std::fill(tensors.begin(), tensors.end(), NAN);
    const auto shape = parts.sections[formats::SectionId::displacement_surface].shape;
    parts.set(formats::SectionId::displacement_surface, shape, tensors);
  });
  TouchedScene scene(bad);
  const std::vector<palpate_grip> grips = {grip_at_node(bad.touchable[3], {0, 0, .001}),
                                           grip_at_node(bad.touchable[9], {0, 0, .001})};
  EXPECT_EQ(scene.hold(grips), PALPATE_STEP_UNSOLVED);
  EXPECT_EQ(Eigen::Vector3d(scene.tool().force).norm(), 0);
}

}  // namespace
}  // namespace palpate::tests
