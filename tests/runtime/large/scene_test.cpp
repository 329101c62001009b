// Large deformation as an effect of a scene: through the C API, with every contact model.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "runtime/base/step_work.h"
#include "tests/runtime/large/large_scene.h"
#include "tests/runtime/large/soft_supports.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::HasSubstr;
using testing::Not;

std::string refusal(const TouchedBody& body, const SceneDef& def) {
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  if (palpate_scene_create(body.bundle(), &def, &scene, &error) == PALPATE_OK) {
    palpate_scene_destroy(scene);
    return "";
  }
  EXPECT_EQ(scene, nullptr);
  return error.text;
}

TEST(LargeScene, ASmallPushIsTheLinearOneForEachContactModel) {
  const TouchedBox box({}, with_large(false));
  for (const auto contact :
       {PALPATE_CONTACT_NODE, PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH}) {
    SceneDef def = large_def(contact);
    std::vector<palpate_grip> grips;
    const Vector3d way(-2e-6, 1e-6, 3e-6);
    if (contact == PALPATE_CONTACT_NODE)
      grips = {grip_at_node(box.touchable.back(), way)};
    else
      grips = {grip_at_place(box.far_triangle(), {0.5, 0.3, 0.2}, way)};
    palpate_tool tool = tool_of(grips);
    tool.disc_radius = 0.008;
    Vector3d force[2];
    std::vector<float> field[2];
    for (int large = 0; large < 2; ++large) {
      def.large.deformation = static_cast<palpate_deformation_model>(large);
      const ScenePointer scene = box.scene(def);
      Contacts contacts(scene.get());
      palpate_step_flags flags = 0;
      for (int tick = 0; tick < 5; ++tick)
        flags = palpate_scene_touch(scene.get(), &tool, 1, 0.001, contacts.get(), contacts.bytes());
      EXPECT_EQ(flags, 0u);
      force[large] = Eigen::Map<const Vector3d>(palpate_contacts_tool(contacts.get(), 0)->force_raw);
      field[large] = displacements(scene.get(), contacts, box.body.surface_nodes);
    }
    EXPECT_GT(force[0].norm(), 0);
    // The strain is 1e-4, and the difference of the second order.
    EXPECT_LE((force[0] - force[1]).norm(), 1e-3 * force[0].norm()) << contact;
    const Eigen::Map<Eigen::VectorXf> linear(field[0].data(), static_cast<Eigen::Index>(field[0].size())),
        large(field[1].data(), static_cast<Eigen::Index>(field[1].size()));
    EXPECT_LE((linear - large).norm(), 2e-3f * linear.norm()) << contact;
  }
}

TEST(LargeScene, ADeepPushIsTheConvergedSolution) {
  for (const bool nodal : {false, true})
    for (const LawForm& form : {LawForm(), LawForm(1.5), LawForm::yeoh(-300, 400), LawForm::ogden(4.5)}) {
      const TouchedBox box({}, with_large(nodal, form));
      SceneDef def = large_def(PALPATE_CONTACT_NODE);
      def.shape = PALPATE_SHAPE_VOLUME;
      const ScenePointer scene = box.scene(def);
      Contacts contacts(scene.get());
      const std::int32_t node = box.touchable.back();
      for (int tick = 1; tick <= 160; ++tick) {
        const std::vector<palpate_grip> grips = {grip_at_node(node, {-1e-4 * tick, 0.2e-4 * tick, 0.3e-4 * tick})};
        const palpate_tool tool = tool_of(grips);
        EXPECT_EQ(palpate_scene_touch(scene.get(), &tool, 1, 0.001, contacts.get(), contacts.bytes()), 0u) << tick;
      }
      EXPECT_LT(contacts->least_volume, 0.9) << "not a large strain";
      const auto count = static_cast<std::int32_t>(box.body.mesh.nodes.size());
      const std::vector<float> field = displacements(scene.get(), contacts, count);
      const Seen seen(box, nodal, form);
      const LargeReference reference(seen.body);
      Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3, reference.dofs());
      for (int i = 0; i < 3; ++i) rows(i, 3 * node + i) = 1;
      VectorXd u = Eigen::Map<const Eigen::VectorXf>(field.data(), reference.dofs()).cast<double>();
      const VectorXd found = u;
      const VectorXd force = reference.solve(rows, Vector3d(-0.016, 0.0032, 0.0048), &u);
      const Vector3d on_tool(palpate_contacts_tool(contacts.get(), 0)->force_raw);
      EXPECT_LE((found - u).norm(), 0.01 * u.norm()) << nodal << words_of(form);
      EXPECT_LE((on_tool + force).norm(), 0.02 * force.norm()) << nodal << words_of(form);
    }
}

TEST(LargeScene, AToolPointThatPressesTheSurfaceIsPushedBack) {
  const TouchedBox box({}, with_large(true));
  SceneDef def = large_def(PALPATE_CONTACT_PATCH);
  def.collision = PALPATE_COLLISION_REST;
  const ScenePointer scene = box.scene(def);
  Contacts contacts(scene.get());
  double before = 0;
  for (int tick = 0; tick <= 100; ++tick) {
    const double point[3] = {0.0605 - 1e-4 * tick, 0.025, 0.02};
    palpate_tool tool = palpate_default_tool();
    tool.points = point, tool.point_count = 1, tool.disc_radius = 0.008;
    EXPECT_EQ(palpate_scene_touch(scene.get(), &tool, 1, 0.001, contacts.get(), contacts.bytes()), 0u);
    const double push = palpate_contacts_tool(contacts.get(), 0)->force_raw[0];
    if (tick > 10) {
      EXPECT_GT(push, before);
    }
    before = push;
  }
  EXPECT_GT(before, 0.05);
}

TEST(LargeScene, AJumpRaisesTheFlagUntilTheBodyHasFollowed) {
  const TouchedBox box({}, with_large(false));
  SceneDef def = large_def(PALPATE_CONTACT_NODE);
  def.collision = PALPATE_COLLISION_OFF, def.max_points = 1;
  def.max_operations = StepWork::kOfPoint + 1;  // one step of the method a tick
  const ScenePointer scene = box.scene(def);
  Contacts contacts(scene.get());
  const std::vector<palpate_grip> grips = {grip_at_node(box.touchable.back(), {-0.012, 0.01, 0})};
  const palpate_tool tool = tool_of(grips);
  palpate_step_flags flags = palpate_scene_touch(scene.get(), &tool, 1, 0.001, contacts.get(), contacts.bytes());
  EXPECT_EQ(flags, PALPATE_STEP_DEFORMATION_BEHIND);
  EXPECT_EQ(palpate_contacts_tool(contacts.get(), 0)->flags, PALPATE_STEP_DEFORMATION_BEHIND);
  for (int tick = 0; tick < 40 && flags; ++tick)
    flags = palpate_scene_touch(scene.get(), &tool, 1, 0.001, contacts.get(), contacts.bytes());
  EXPECT_EQ(flags, 0u);
}

TEST(LargeScene, ARestoredStateGoesOnWithTheSameBits) {
  const TouchedBox box({}, with_large(true));
  const SceneDef def = large_def(PALPATE_CONTACT_NODE);
  const ScenePointer scene = box.scene(def), other = box.scene(def);
  Contacts contacts(scene.get()), restored(other.get());
  std::vector<std::uint64_t> state;
  const auto play = [&](palpate_scene* played, Contacts& into, int from, int to) {
    for (int tick = from; tick < to; ++tick) {
      const std::vector<palpate_grip> grips = {
          grip_at_node(box.touchable.back(), {-1e-4 * tick, 0, 1e-4 * tick}),
          grip_at_node(box.touchable[box.touchable.size() / 2], {0, 5e-5 * tick, 0})};
      palpate_tool tool = tool_of(grips);
      if (tick % 15 < 5) tool.grip_count = 1;
      palpate_scene_touch(played, &tool, 1, 0.001, into.get(), into.bytes());
    }
  };
  play(scene.get(), contacts, 0, 40);
  state.resize(palpate_scene_state_bytes(scene.get()) / 8 + 1);
  palpate_error error = {};
  ASSERT_EQ(palpate_scene_save(scene.get(), state.data(), 8 * state.size(), &error), PALPATE_OK) << error.text;
  ASSERT_EQ(palpate_scene_restore(other.get(), state.data(), 8 * state.size(), &error), PALPATE_OK) << error.text;
  play(scene.get(), contacts, 40, 90), play(other.get(), restored, 40, 90);
  EXPECT_EQ(0, std::memcmp(contacts.get(), restored.get(), contacts->used_bytes));
}

TEST(LargeScene, AfterAResetTheOrganIsAtRest) {
  const TouchedBox box({}, with_large(true));
  const ScenePointer scene = box.scene(large_def(PALPATE_CONTACT_NODE));
  Contacts contacts(scene.get());
  const std::vector<palpate_grip> grips = {grip_at_node(box.touchable.back(), {-0.005, 0, 0})};
  const palpate_tool tool = tool_of(grips);
  palpate_scene_touch(scene.get(), &tool, 1, 0.001, contacts.get(), contacts.bytes());
  palpate_scene_reset(scene.get());
  palpate_scene_touch(scene.get(), nullptr, 0, 0.001, contacts.get(), contacts.bytes());
  for (const float x : displacements(scene.get(), contacts, box.body.surface_nodes)) EXPECT_EQ(x, 0);
}

// The box of DenseBody on a foundation alone, in the tensors and, where `told`, in what large deformation reads.
TouchedBody on_a_foundation(bool told) {
  DenseBody dense = dense_box({});
  dense.fixed.assign(dense.fixed.size(), 0);
  ElasticBody elastic;
  for (const auto& n : dense.body.mesh.nodes) elastic.nodes.push_back(n);
  elastic.triangles = dense.body.triangles;
  add_foundation(elastic, 3e5, 1e5, [](const auto& p) { return p[0] == 0; });
  const SupportStiffness supports = support_stiffness(elastic);
  dense.stiffness = dense_stiffness(dense.body.mesh, dense.young, dense.poisson);
  for (std::size_t p = 0; p < supports.nodes.size(); ++p)
    for (int i = 0; i < 9; ++i) {
      const Eigen::Index row = 3 * supports.nodes[p][0] + i / 3, column = 3 * supports.nodes[p][1] + i % 3;
      dense.stiffness(row, column) += supports.block[p][static_cast<std::size_t>(i)];
      if (supports.nodes[p][0] != supports.nodes[p][1])
        dense.stiffness(column, row) += supports.block[p][static_cast<std::size_t>(i)];
    }
  return TouchedBody(dense, [&](BundleParts& parts) {
    add_large_deformation(parts);
    if (!told) return;
    const std::size_t pairs = supports.nodes.size();
    std::vector<std::int32_t> nodes;
    std::vector<double> stiffness;
    for (std::size_t p = 0; p < pairs; ++p) {
      nodes.insert(nodes.end(), supports.nodes[p].begin(), supports.nodes[p].end());
      stiffness.insert(stiffness.end(), supports.block[p].begin(), supports.block[p].end());
    }
    parts.set(formats::SectionId::large_support_nodes, {pairs, 2}, nodes);
    parts.set(formats::SectionId::large_support_stiffness, {pairs, 3, 3}, stiffness);
  });
}

TEST(LargeScene, ASmallPushOnASoftSupportIsThatOfLinearElasticity) {
  const TouchedBody box = on_a_foundation(true);
  const std::vector<palpate_grip> grips = {grip_at_node(box.touchable.back(), {-1e-5, 0.4e-5, 0.2e-5})};
  const palpate_tool tool = tool_of(grips);
  Eigen::Vector3d force[2];
  std::vector<float> field[2];
  for (const bool large : {false, true}) {
    SceneDef def = large_def(PALPATE_CONTACT_NODE);
    if (!large) def.large.deformation = PALPATE_DEFORMATION_LINEAR;
    const ScenePointer scene = box.scene(def);
    Contacts contacts(scene.get());
    EXPECT_EQ(palpate_scene_touch(scene.get(), &tool, 1, 0.001, contacts.get(), contacts.bytes()), 0u);
    force[large] = Eigen::Vector3d(palpate_contacts_tool(contacts, 0)->force_raw);
    field[large] = displacements(scene.get(), contacts, box.body.surface_nodes);
  }
  EXPECT_GT(force[0].norm(), 1e-4);
  // Of second order in a strain of 1e-4 beside the contact, and the step's tolerance.
  EXPECT_LE((force[1] - force[0]).norm(), 2e-3 * force[0].norm());
  for (std::size_t i = 0; i < field[0].size(); ++i) EXPECT_NEAR(field[1][i], field[0][i], 2e-8);
}

TEST(LargeScene, ItsSectionsAreMappedWhereTheEffectIsOnAlone) {
  const TouchedBox box({}, with_large(false)), plain;
  EXPECT_EQ(palpate_bundle_describe(box.bundle()).has_large, 1);
  EXPECT_EQ(palpate_bundle_describe(plain.bundle()).has_large, 0);
  std::string on, off;
  const ScenePointer large = box.scene(large_def(PALPATE_CONTACT_NODE)), linear = box.scene(unlimited_def());
  for (const auto& pass : plan_of(large.get())) on += std::string(pass.name) + " " + pass.sections + " ";
  for (const auto& pass : plan_of(linear.get())) off += std::string(pass.name) + " " + pass.sections + " ";
  EXPECT_THAT(on, HasSubstr("deformation: large"));
  EXPECT_THAT(on, HasSubstr("large/order large/stiffening"));
  EXPECT_THAT(off, Not(HasSubstr("large")));
  EXPECT_THAT(on, Not(HasSubstr("large/support")));
  const TouchedBody soft = on_a_foundation(true);
  const ScenePointer on_soft = soft.scene(large_def(PALPATE_CONTACT_NODE));
  for (const auto& pass : plan_of(on_soft.get()))
    if (std::string(pass.name) == "deformation: large") {
      EXPECT_THAT(pass.sections, HasSubstr("large/support/nodes large/support/stiffness"));
    }
}

// Both kinds hold displacements of the same nodes: those of LARGE are all of the shape, those of LARGE_BESIDE add to superposition.
TEST(LargeScene, ContactsOfTheOtherKindOfLargeDeformationAreBadInputToShapeAndQueries) {
  const TouchedBox box({}, with_large(false));
  const palpate_deformation_model kinds[] = {PALPATE_DEFORMATION_LINEAR, PALPATE_DEFORMATION_LARGE,
                                             PALPATE_DEFORMATION_LARGE_BESIDE, PALPATE_DEFORMATION_LARGE_RENEWED};
  const auto same = [](palpate_deformation_model a, palpate_deformation_model b) {
    return a == b || (a >= PALPATE_DEFORMATION_LARGE_BESIDE && b >= PALPATE_DEFORMATION_LARGE_BESIDE);
  };
  std::vector<ScenePointer> scenes;
  for (const auto kind : kinds) {
    SceneDef def = large_def(PALPATE_CONTACT_NODE);
    def.large.deformation = kind, def.shape = PALPATE_SHAPE_VOLUME, def.queries.queries = PALPATE_QUERIES_ON;
    scenes.push_back(box.scene(def));
  }
  const palpate_grip grip = grip_at_node(box.touchable.back(), {-2e-3, 1e-3, 0});
  const palpate_tool tool = grip_tool(&grip);
  const auto nodes = static_cast<std::int32_t>(box.body.mesh.nodes.size());
  const double far[3] = {1, 1, 1};
  for (std::size_t of = 0; of < std::size(kinds); ++of) {
    Contacts contacts(scenes[of].get());
    palpate_scene_touch(scenes[of].get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes());
    for (std::size_t in = 0; in < std::size(kinds); ++in) {
      palpate_step_flags flags = 0;
      const std::vector<float> u = displacements(scenes[in].get(), contacts, nodes, &flags);
      const bool refused = !same(kinds[of], kinds[in]);
      EXPECT_EQ((flags & PALPATE_STEP_BAD_INPUT) != 0, refused) << of << " in " << in;
      EXPECT_EQ(std::all_of(u.begin(), u.end(), [](float x) { return x == 0; }), refused) << of << " in " << in;
      double distance = 0;
      flags = palpate_scene_signed_distance(scenes[in].get(), contacts, far, &distance);
      EXPECT_EQ((flags & PALPATE_STEP_BAD_INPUT) != 0, refused) << of << " in " << in;
    }
  }
}

// A host sends used_bytes of it, and compares them.
TEST(LargeScene, WritesEveryByteOfItsContacts) {
  TinyBox form;
  form.cells = {2, 2, 2};
  const TouchedBox box(form, with_large(false));
  ASSERT_EQ(box.body.mesh.nodes.size() % 2, 1u) << "the displacements of an odd number of nodes end within eight bytes";
  for (const auto kind : {PALPATE_DEFORMATION_LINEAR, PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LARGE_BESIDE}) {
    SceneDef def = large_def(PALPATE_CONTACT_NODE);
    def.large.deformation = kind, def.shape = PALPATE_SHAPE_VOLUME;
    const palpate_grip grip = grip_at_node(box.touchable.back(), {-2e-3, 1e-3, 0});
    const palpate_tool tools[2] = {grip_tool(&grip), palpate_default_tool()};
    std::vector<std::uint64_t> written[2];
    for (int fill = 0; fill < 2; ++fill) {
      const ScenePointer scene = box.scene(def);
      Contacts contacts(scene.get());
      std::fill(contacts.memory.begin(), contacts.memory.end(), fill == 0 ? 0 : ~std::uint64_t{0});
      palpate_scene_touch(scene.get(), tools, 2, 1e-3, contacts.get(), contacts.bytes());
      ASSERT_EQ(contacts->used_bytes % 8, 0u);
      contacts.memory.resize(contacts->used_bytes / 8);
      written[fill] = contacts.memory;
    }
    EXPECT_EQ(written[0], written[1]) << kind;
  }
}

TEST(LargeScene, TheLogSaysWhereMaxOperationsHaveNoRoomForTheStepsOfATouch) {
  BundleParts parts = dense_bundle(dense_box({}));
  with_large(false)(parts);
  AlignedBytes bytes(bundle_bytes(parts));
  std::vector<std::string> notes;
  palpate_bundle_options options = palpate_default_bundle_options();
  options.log_user = &notes;
  options.log = [](void* user, palpate_log_level level, const char* text) {
    if (level == PALPATE_LOG_NOTE) static_cast<std::vector<std::string>*>(user)->push_back(text);
  };
  palpate_bundle* opened = nullptr;
  ASSERT_EQ(palpate_bundle_open(bytes.data(), bytes.size(), &options, &opened, nullptr), PALPATE_OK);
  const BundlePointer bundle(opened);
  const auto note = HasSubstr("deformation LARGE takes up to 3 steps in a touch, ");
  SceneDef def = large_def(PALPATE_CONTACT_NODE);
  for (const std::int64_t operations : {std::int64_t{100'000'000}, std::int64_t{2000}}) {
    notes.clear();
    def.max_operations = operations;
    palpate_scene* scene = nullptr;
    ASSERT_EQ(palpate_scene_create(bundle.get(), &def, &scene, nullptr), PALPATE_OK);
    const ScenePointer created(scene);
    if (operations == 2000)
      EXPECT_THAT(notes, testing::Contains(testing::AllOf(note, HasSubstr("though max_operations is 2000: "))));
    else
      EXPECT_THAT(notes, Not(testing::Contains(note)));
  }
}

TEST(LargeScene, RefusesWhatItCannotDoInASentence) {
  const TouchedBox plain, box({}, with_large(false));
  EXPECT_THAT(refusal(plain, large_def(PALPATE_CONTACT_NODE)), HasSubstr("deformation LARGE"));
  const auto changed = [&](auto change) {
    SceneDef def = large_def(PALPATE_CONTACT_NODE);
    change(def);
    return refusal(box, def);
  };
  EXPECT_EQ(changed([](SceneDef&) {}), "");
  EXPECT_THAT(changed([](SceneDef& def) { def.force = PALPATE_FORCE_RESPONSE; }), HasSubstr("the measured response"));

  const auto damaged = [&](auto damage) {
    return refusal(TouchedBox({}, [&](BundleParts& parts) { add_large_deformation(parts), damage(parts); }),
                   large_def(PALPATE_CONTACT_NODE));
  };
  const auto order_with = [](BundleParts& parts, std::size_t at, std::int32_t node) {
    auto order = parts.get<std::int32_t>(formats::SectionId::large_order);
    order[at] = node;
    parts.set(formats::SectionId::large_order, {order.size()}, order);
  };
  EXPECT_THAT(damaged([&](BundleParts& parts) { order_with(parts, 3, -1); }), HasSubstr("large/order"));
  EXPECT_THAT(damaged([&](BundleParts& parts) { order_with(parts, 3, 1 << 20); }), HasSubstr("large/order"));
  EXPECT_THAT(damaged([&](BundleParts& parts) {
                order_with(parts, 3, parts.get<std::int32_t>(formats::SectionId::large_order)[4]);
              }),
              HasSubstr("each node that is not held once"));
  EXPECT_THAT(damaged([](BundleParts& parts) {
                parts.set(formats::SectionId::large_stiffening, {1}, std::vector<double>{NAN});
              }),
              HasSubstr("large/stiffening"));
  const auto damaged_law = [&](double stiffening, std::vector<double> law) {
    return damaged([&](BundleParts& parts) {
      parts.set(formats::SectionId::large_stiffening, {1}, std::vector<double>{stiffening});
      parts.set(formats::SectionId::large_law, {1, 4}, law);
    });
  };
  EXPECT_THAT(damaged_law(-1, {3, 0, 0, 0}), HasSubstr("large/law: expected a law from 0 to 2, found 3"));
  EXPECT_THAT(damaged_law(-1, {NAN, 0, 0, 0}), HasSubstr("large/law"));
  EXPECT_THAT(damaged_law(-1, {1, -1, 0, 0}), HasSubstr("large/law"));
  EXPECT_THAT(damaged_law(-1, {1, INFINITY, 0, 0}), HasSubstr("large/law"));
  EXPECT_THAT(damaged_law(-1, {2, 1, 0, 2}), HasSubstr("large/law"));
  EXPECT_THAT(damaged_law(-1, {2, 2, 0.5, 1}), HasSubstr("large/law"));
  EXPECT_THAT(damaged_law(0, {2, 2, 0, 2}), HasSubstr("large/stiffening"));
  EXPECT_THAT(damaged_law(-1, {0, 0, 0, 0}), HasSubstr("large/stiffening"));
  // What a reader sees that does not know large/law.
  EXPECT_THAT(damaged([](BundleParts& parts) {
                parts.set(formats::SectionId::large_stiffening, {1}, std::vector<double>{formats::kNoStiffening});
              }),
              HasSubstr("large/stiffening"));
  const auto damaged_support = [&](std::vector<std::int32_t> nodes, std::vector<double> stiffness) {
    return damaged([&](BundleParts& parts) {
      parts.set(formats::SectionId::large_support_nodes, {nodes.size() / 2, 2}, nodes);
      parts.set(formats::SectionId::large_support_stiffness, {stiffness.size() / 9, 3, 3}, stiffness);
    });
  };
  const std::vector<double> one = {5, 1, 0, 1, 6, 0, 0, 0, 7};
  EXPECT_EQ(damaged_support({20, 20}, one), "");
  EXPECT_THAT(damaged_support({20, 1 << 20}, one), HasSubstr("large/support/nodes"));
  EXPECT_THAT(damaged_support({21, 20}, one), HasSubstr("large/support/nodes"));
  EXPECT_THAT(damaged_support({20, 20, 21, 21}, one), HasSubstr("as many pairs of nodes"));
  EXPECT_THAT(damaged_support({20, 20}, {5, 1, 0, 2, 6, 0, 0, 0, 7}), HasSubstr("large/support/stiffness"));
  EXPECT_THAT(damaged_support({20, 20}, {NAN, 1, 0, 1, 6, 0, 0, 0, 7}), HasSubstr("large/support/stiffness"));
  const std::int32_t last = box.touchable.back();
  EXPECT_THAT(damaged_support({last, last}, {-1e9, 0, 0, 0, 6, 0, 0, 0, 7}), HasSubstr("not positive definite"));
  EXPECT_THAT(damaged([](BundleParts& parts) {
                parts.set(formats::SectionId::large_support_nodes, {1, 2}, std::vector<std::int32_t>{20, 20});
              }),
              HasSubstr("as many pairs of nodes"));
  EXPECT_THAT(refusal(TouchedBox({},
                                 [](BundleParts& parts) {
                                   add_large_deformation(parts);
                                   parts.provenance.replace(parts.provenance.find("\"p1\""), 4, "\"p2-p0\"");
                                 }),
                      large_def(PALPATE_CONTACT_NODE)),
              HasSubstr("p1, p1-anp or p1-ang, found p2-p0"));
}

}  // namespace
}  // namespace palpate::tests
