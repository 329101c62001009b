// What a device, a socket or a careless caller may send: never a crash, never a spike, always a flag.
#include "tests/runtime/touched_box.h"

namespace palpate::tests {
namespace {

const TouchedBox& box() {
  static const TouchedBox shared;
  return shared;
}

// A tool point pressed 1 mm into the far face.
struct Pressed {
  explicit Pressed(const palpate_scene_def& def) : scene(box().scene(def)), contacts(scene.get()) {
    const std::int32_t triangle = box().far_triangle(5);
    place = box().place(triangle, {.3, .3, .4}), out = box().outward(triangle);
    move(place + 0.001 * out);
    move(place - 0.001 * out);
  }
  palpate_step_flags move(const Eigen::Vector3d& p, double dt = 1e-3) {
    const palpate_tool tool = {p.data(), 1, nullptr, 0, 0};
    return palpate_touch(scene.get(), &tool, 1, dt, contacts.get());
  }
  Eigen::Vector3d force() { return Eigen::Vector3d(contacts->tools[0].force); }
  Eigen::Vector3d raw() { return Eigen::Vector3d(contacts->tools[0].force_raw); }
  ScenePointer scene;
  Contacts contacts;
  Eigen::Vector3d place, out;
};

TEST(Device, KeepsTheLastGoodInputWhenItSendsNonsense) {
  Pressed tool(unlimited_def());
  const Eigen::Vector3d before = tool.raw();
  ASSERT_GT(before.norm(), 0);
  for (const double bad : {double(NAN), double(INFINITY), -double(INFINITY), 1e300, -1e7}) {
    EXPECT_EQ(tool.move({bad, 0, 0}), PALPATE_STEP_BAD_INPUT);
    EXPECT_EQ(tool.raw(), before);
    EXPECT_EQ(tool.contacts->tools[0].flags, PALPATE_STEP_BAD_INPUT);
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
  const auto expect_kept = [&](const palpate_tool* tools, std::int32_t count) {
    EXPECT_EQ(palpate_touch(tool.scene.get(), tools, count, 1e-3, tool.contacts.get()), PALPATE_STEP_BAD_INPUT);
    EXPECT_EQ(tool.raw(), before);
  };
  expect_kept(nullptr, 1);
  expect_kept(nullptr, -3);
  for (const palpate_tool& bad :
       {palpate_tool{nullptr, 1, nullptr, 0, 0}, palpate_tool{p, -1, nullptr, 0, 0}, palpate_tool{p, 1, nullptr, 1, 0},
        palpate_tool{p, 1, &grip, -1, 0}, palpate_tool{p, 1, nullptr, INT32_MIN, 0},
        palpate_tool{nullptr, INT32_MAX, nullptr, 0, 0}})
    expect_kept(&bad, 1);
  std::vector<palpate_grip> bad_grips;
  for (const std::int32_t node : {1 << 30, box().body.surface_nodes})
    bad_grips.push_back(grip_at_node(node, {0, 0, 0}));
  for (const std::int32_t triangle : {-1, INT32_MAX, INT32_MIN, static_cast<std::int32_t>(box().body.triangles.size())})
    bad_grips.push_back(grip_at_place(triangle, {.2, .3, .5}, {0, 0, 0}));
  for (const Eigen::Vector3d& k :
       {Eigen::Vector3d(.5, .5, .5), Eigen::Vector3d(2, -1, 0), Eigen::Vector3d(NAN, .5, .5)})
    bad_grips.push_back(grip_at_place(0, k, {0, 0, 0}));
  bad_grips.push_back(grip_at_node(3, {NAN, 0, 0}));
  bad_grips.push_back(grip_at_node(3, {0, 0, 0}, 0));
  bad_grips.push_back(grip_at_node(3, {0, 0, 0}, 8));
  for (const palpate_grip& bad : bad_grips) {
    const palpate_tool with = {nullptr, 0, &bad, 1, 0};
    expect_kept(&with, 1);
  }
  EXPECT_EQ(palpate_touch(nullptr, nullptr, 0, 1e-3, tool.contacts.get()), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_touch(tool.scene.get(), nullptr, 0, 1e-3, nullptr), PALPATE_STEP_BAD_INPUT);
}

TEST(Device, IsNotSentAForceAboveTheLimitNorAJump) {
  palpate_scene_def def = palpate_default_scene_def();
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

TEST(Device, FeelsNothingWhenTheToolIsGone) {
  Pressed tool(unlimited_def());
  EXPECT_EQ(palpate_touch(tool.scene.get(), nullptr, 0, 1e-3, tool.contacts.get()), 0u);
  EXPECT_EQ(tool.contacts->node_count, 0);
  EXPECT_EQ(tool.force().norm(), 0);
  tool.move(tool.place - 0.001 * tool.out);  // back, inside: nothing until it has been outside
  EXPECT_EQ(tool.contacts->tools[0].contact_count, 0);
}

TEST(Shape, TrustsNothingInTheContactsItIsGiven) {
  Pressed tool(unlimited_def());
  const std::int32_t nodes = box().body.surface_nodes;
  const auto good = displacements(tool.scene.get(), tool.contacts.get(), nodes);
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
  EXPECT_EQ(with([](palpate_contacts&, Node& n) { n.tool = -1; }), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(with([](palpate_contacts&, Node& n) { n.tool = 99; }), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(with([](palpate_contacts&, Node& n) { n.modified_displacement[1] = NAN; }), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(displacements(tool.scene.get(), tool.contacts.get(), nodes), good);

  palpate_step_flags flags = 0;
  for (const float x : displacements(tool.scene.get(), nullptr, nodes, &flags)) EXPECT_EQ(x, 0);
  EXPECT_EQ(flags, PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(palpate_shape(nullptr, tool.contacts.get(), nullptr), PALPATE_STEP_BAD_INPUT);
  float u[6] = {9, 9, 9, 9, 9, 9};
  palpate_shape_out out = {u, nullptr, -5, 77};
  EXPECT_EQ(palpate_shape(tool.scene.get(), tool.contacts.get(), &out), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(out.node_count, 0);
  out.node_capacity = 1;  // a short array is filled as far as it goes
  EXPECT_EQ(palpate_shape(tool.scene.get(), tool.contacts.get(), &out), 0u);
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
  const ScenePointer scene = bad.scene(unlimited_def());
  Contacts contacts(scene.get());
  const std::vector<palpate_grip> grips = {grip_at_node(bad.touchable[3], {0, 0, .001}),
                                           grip_at_node(bad.touchable[9], {0, 0, .001})};
  const palpate_tool tool = tool_of(grips);
  EXPECT_EQ(palpate_touch(scene.get(), &tool, 1, 1e-3, contacts.get()), PALPATE_STEP_UNSOLVED);
  EXPECT_EQ(Eigen::Vector3d(contacts->tools[0].force).norm(), 0);
}

}  // namespace
}  // namespace palpate::tests
