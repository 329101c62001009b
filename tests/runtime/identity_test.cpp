// What the host names and the library must not guess: which tool is which, what a grip holds, whose contacts a shape gets.
#include "tests/runtime/played_box.h"
#include "tests/support/relaxation.h"

namespace palpate::tests {
namespace {

// ---- tools --------------------------------------------------------------------------------------------------------------

// Everything that follows a tool from step to step: contacts that slip, a force that slews, forces that relax.
SceneDef remembering_def() {
  SceneDef def = with(SceneDef(), PALPATE_COLLISION_DEFORMED, PALPATE_LAW_COULOMB);
  def.relaxation = relaxation_of({{0.5, 0.02}}), def.force_slew = 20;
  return def;
}

// Three tools that touch at different places and times: two discs with friction and a grip.
class Three : public TouchedScene {
 public:
  static constexpr std::int32_t kIds[3] = {70, 3, 11};

  explicit Three(const SceneDef& def = remembering_def()) : TouchedScene(tiny_box(), def) {}

  // order: which tool comes first, second, ...; a tool that is not in it is not sent.
  palpate_step_flags step(int s, const std::vector<int>& order, bool with_ids = true) {
    palpate_tool all[3];
    for (int t = 0; t < 2; ++t) {
      const std::int32_t triangle = tiny_box().far_triangle(t == 0 ? 2 : 9);
      points_[t] = tiny_box().place(triangle, {.3, .3, .4}) +
                   (0.002 * std::cos(0.15 * s + t)) * tiny_box().outward(triangle) + Eigen::Vector3d(0, 2e-4 * s, 0);
      all[t] = point_tool(points_[t].data(), 1, 0.003, 0.2);
    }
    grip_ = grip_at_node(tiny_box().touchable[4], {0, 0, 0.001 * std::sin(0.1 * s)});
    all[2] = grip_tool(&grip_);
    std::vector<palpate_tool> tools;
    for (const int t : order) {
      tools.push_back(all[t]);
      if (with_ids) tools.back().id = kIds[t];
    }
    return touch(tools);
  }

  // The state of tool t of the last step, found by its id; a tool that was not sent has none.
  std::optional<palpate_tool_state> state(int t) {
    for (std::int32_t i = 0; i < contacts->tool_count; ++i)
      if (tool(i).id == kIds[t]) return tool(i);
    return std::nullopt;
  }
  std::vector<palpate_contact_node> nodes_of(int t) {
    std::vector<palpate_contact_node> nodes;
    for (std::int32_t n = 0; n < contacts->node_count; ++n)
      if (const auto& node = contacts.nodes()[n]; tool(node.index).id == kIds[t]) {
        nodes.push_back(node);
        nodes.back().index = 0;  // its index may differ
      }
    return nodes;
  }

 private:
  Eigen::Vector3d points_[2];
  palpate_grip grip_;
};

// All that a host can know of tool t after a step, to the bit.
void expect_same(Three& a, Three& b, int t, int s) {
  const auto one = a.state(t), other = b.state(t);
  ASSERT_TRUE(one && other) << "tool " << t << " step " << s;
  EXPECT_EQ(std::memcmp(&*one, &*other, sizeof *one), 0) << "tool " << t << " step " << s;
  const auto nodes = a.nodes_of(t), others = b.nodes_of(t);
  ASSERT_EQ(nodes.size(), others.size()) << "tool " << t << " step " << s;
  if (nodes.empty()) return;
  EXPECT_EQ(std::memcmp(nodes.data(), others.data(), nodes.size() * sizeof nodes[0]), 0)
      << "tool " << t << " step " << s;
}

TEST(ToolIdentity, StateFollowsTheIdWhenToolsAreReordered) {
  Three kept, shuffled;
  const std::vector<int> orders[] = {{0, 1, 2}, {2, 0, 1}, {1, 2, 0}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}};
  int touching = 0, slipping = 0;
  for (int s = 0; s < 120; ++s) {
    const palpate_step_flags flags = kept.step(s, {0, 1, 2});
    EXPECT_EQ(shuffled.step(s, orders[s % 6]), flags) << s;
    for (int t = 0; t < 3; ++t) expect_same(kept, shuffled, t, s);
    for (int t = 0; t < 2; ++t) touching += kept.state(t)->contact_count > 0, slipping += kept.state(t)->slip_count > 0;
    EXPECT_EQ(palpate_contacts_tool(shuffled.contacts, 0)->id, Three::kIds[orders[s % 6][0]]);
  }
  EXPECT_GT(touching, 50);
  EXPECT_GT(slipping, 5);
}

// The reference still sends the tool that has gone, but without points.
TEST(ToolIdentity, TheOthersKeepTheirStateWhenAToolDisappears) {
  Three all, fewer;
  for (int s = 0; s < 80; ++s) {
    const bool gone = s >= 25 && s < 50;
    fewer.step(s, gone ? std::vector<int>{1, 2} : std::vector<int>{0, 1, 2});
    if (gone) {
      palpate_tool tools[3] = {palpate_default_tool(), palpate_default_tool(), palpate_default_tool()};
      tools[0].id = Three::kIds[0];
      // As Three::step, with an empty first tool.
      Eigen::Vector3d point = tiny_box().place(tiny_box().far_triangle(9), {.3, .3, .4}) +
                              (0.002 * std::cos(0.15 * s + 1)) * tiny_box().outward(tiny_box().far_triangle(9)) +
                              Eigen::Vector3d(0, 2e-4 * s, 0);
      const palpate_grip grip = grip_at_node(tiny_box().touchable[4], {0, 0, 0.001 * std::sin(0.1 * s)});
      tools[1] = point_tool(point.data(), 1, 0.003, 0.2), tools[1].id = Three::kIds[1];
      tools[2] = grip_tool(&grip), tools[2].id = Three::kIds[2];
      all.touch(tools);
    } else {
      all.step(s, {0, 1, 2});
    }
    expect_same(all, fewer, 1, s);
    expect_same(all, fewer, 2, s);
    EXPECT_EQ(fewer.state(0).has_value(), !gone);
  }
}

TEST(ToolIdentity, AToolThatIsReplacedByAnotherLeavesItNothing) {
  SceneDef def = remembering_def();
  def.max_tools = 1;
  Three one(def), fresh(def);
  for (int s = 0; s < 10; ++s) one.step(s, {2});
  EXPECT_GT(Eigen::Vector3d(one.state(2)->force).norm(), 0.01);
  one.step(10, {0}), fresh.step(10, {0});
  EXPECT_FALSE(one.state(2).has_value());
  const auto found = one.state(0), expected = fresh.state(0);
  EXPECT_EQ(std::memcmp(&*found, &*expected, sizeof *found), 0);
}

TEST(ToolIdentity, WithoutIdsAToolIsKnownByItsIndex) {
  Three with, without;
  for (int s = 0; s < 60; ++s) {
    with.step(s, {0, 1, 2}), without.step(s, {0, 1, 2}, false);
    for (int t = 0; t < 3; ++t) {
      palpate_tool_state state = *palpate_contacts_tool(without.contacts, t);
      EXPECT_EQ(state.id, t);
      state.id = Three::kIds[t];
      const auto expected = with.state(t);
      EXPECT_EQ(std::memcmp(&state, &*expected, sizeof state), 0) << s;
    }
  }
}

TEST(ToolIdentity, DuplicateAndImpossibleIdsAreBadInput) {
  Three three;
  for (int s = 0; s < 30; ++s) three.step(s, {0, 1, 2});
  const Eigen::Vector3d p(1, 1, 1);
  const auto send = [&](std::int32_t a, std::int32_t b, std::int32_t c) {
    palpate_tool tools[3] = {point_tool(p.data()), point_tool(p.data()), point_tool(p.data())};
    tools[0].id = a, tools[1].id = b, tools[2].id = c;
    return three.touch(tools) & PALPATE_STEP_BAD_INPUT;
  };
  for (const auto& [a, b, c] :
       {std::tuple{5, 5, 6}, {5, 6, 5}, {1, -1, 7}, {-1, -1, 0}, {5, -2, 6}, {INT32_MIN, 1, 2}}) {
    EXPECT_TRUE(send(a, b, c)) << a << " " << b << " " << c;
    for (int t = 0; t < 3; ++t) {  // all tools kept their last good input
      ASSERT_TRUE(three.state(t)) << t;
      EXPECT_TRUE(three.state(t)->flags & PALPATE_STEP_BAD_INPUT);
    }
    EXPECT_EQ(three.state(2)->contact_count, 1);
  }
  EXPECT_FALSE(send(5, INT32_MAX, 0));
  EXPECT_TRUE(send(2, 0, -1)) << "the last tool's index is 2, and so is the first one's id";
  EXPECT_FALSE(send(1, 0, -1));
}

TEST(ToolIdentity, ResetOfOneToolLeavesTheOthersAlone) {
  Three reset, kept;
  for (int s = 0; s < 12; ++s) reset.step(s, {0, 1, 2}), kept.step(s, {0, 1, 2});
  palpate_scene_reset_tool(reset.get(), 12345);  // nobody's
  palpate_scene_reset_tool(reset.get(), -1);
  palpate_scene_reset_tool(nullptr, 3);
  reset.step(12, {0, 1, 2}), kept.step(12, {0, 1, 2});
  for (int t = 0; t < 3; ++t) expect_same(reset, kept, t, 12);
  ASSERT_GT(kept.state(1)->contact_count, 0);

  palpate_scene_reset_tool(reset.get(), Three::kIds[1]);
  reset.step(13, {0, 1, 2}), kept.step(13, {0, 1, 2});
  ASSERT_GT(kept.state(1)->contact_count, 0);
  EXPECT_EQ(reset.state(1)->contact_count, 0) << "a point that is inside when it is first seen touches nothing";
  EXPECT_EQ(Eigen::Vector3d(reset.state(1)->force).norm(), 0);
  EXPECT_EQ(reset.state(2)->contact_count, kept.state(2)->contact_count);
  EXPECT_GT(Eigen::Vector3d(reset.state(2)->force).norm(), 0);
}

TEST(ToolIdentity, ResetForgetsTheLastGoodInput) {
  Three three;
  for (int s = 0; s < 30; ++s) three.step(s, {0, 1, 2});
  palpate_scene_reset_tool(three.get(), Three::kIds[2]);
  palpate_tool tools[2] = {point_tool(nullptr), palpate_default_tool()};  // a point that is NULL
  tools[0].id = tools[1].id = 3;                                          // and a list that is no list
  EXPECT_TRUE(three.touch(tools) & PALPATE_STEP_BAD_INPUT);
  ASSERT_TRUE(three.state(2));
  EXPECT_EQ(three.state(2)->contact_count, 0);
}

// ---- grips --------------------------------------------------------------------------------------------------------------

TEST(GripKind, MustBeSaid) {
  TouchedScene scene(tiny_box());
  const auto made = [&](const palpate_grip& grip) {
    const palpate_step_flags flags = scene.touch({grip_tool(&grip)});
    EXPECT_EQ(flags == PALPATE_STEP_BAD_INPUT, scene.contacts->node_count == 0);
    return scene.contacts->node_count;
  };
  palpate_grip grip = {};
  EXPECT_EQ(made(grip), 0) << "all zero";
  grip.struct_bytes = sizeof grip, grip.axes = 7, grip.triangle = 3;
  grip.barycentric[0] = grip.barycentric[1] = 0.25, grip.barycentric[2] = 0.5;
  EXPECT_EQ(made(grip), 0) << "a triangle, and node 0 by accident";
  EXPECT_EQ(made(palpate_default_grip()), 0);
  for (const int kind : {3, -1, 1 << 20}) {
    std::memcpy(&grip.kind, &kind, sizeof kind);
    EXPECT_EQ(made(grip), 0) << kind;
  }
  grip.kind = PALPATE_GRIP_SURFACE_POINT;
  grip.triangle = tiny_box().far_triangle(3);
  EXPECT_GT(made(grip), 1);
  grip.kind = PALPATE_GRIP_NODE, grip.node = tiny_box().touchable[3], grip.triangle = -5;
  EXPECT_EQ(made(grip), 1);
  EXPECT_EQ(scene.contacts.nodes()[0].node, tiny_box().touchable[3]);
}

// ---- bundles ------------------------------------------------------------------------------------------------------------

TEST(BundleIdentity, ContactsOfAnotherBundleGiveTheShapeAtRestAndAFlag) {
  TinyBox stiffer;
  stiffer.young *= 2;
  const TouchedBox other(stiffer), again;
  EXPECT_EQ(palpate_bundle_describe(again.bundle()).identity, palpate_bundle_describe(tiny_box().bundle()).identity);
  EXPECT_NE(palpate_bundle_describe(other.bundle()).identity, palpate_bundle_describe(tiny_box().bundle()).identity);
  const ScenePointer touching = tiny_box().scene(unlimited_def()), drawing = again.scene(unlimited_def()),
                     foreign = other.scene(unlimited_def());
  Contacts contacts(touching.get());
  play(tiny_box(), touching.get(), contacts, 40, [](palpate_step_flags) {});
  ASSERT_GT(contacts->node_count, 0);
  EXPECT_EQ(contacts->bundle, palpate_bundle_describe(tiny_box().bundle()).identity);
  palpate_step_flags flags = 0;
  const auto drawn = displacements(drawing.get(), contacts, tiny_box().body.surface_nodes, &flags);
  EXPECT_EQ(flags, 0u);
  EXPECT_EQ(drawn, displacements(touching.get(), contacts, tiny_box().body.surface_nodes));
  EXPECT_NE(drawn, std::vector<float>(drawn.size(), 0));
  EXPECT_EQ(displacements(foreign.get(), contacts, tiny_box().body.surface_nodes, &flags),
            std::vector<float>(drawn.size(), 0));
  EXPECT_EQ(flags, PALPATE_STEP_OTHER_BUNDLE);
}

}  // namespace
}  // namespace palpate::tests
