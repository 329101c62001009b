// A scene pays for the effects it names and for no others: in mapped sections, passes, bits and memory.

#include <atomic>
#include <set>
#include <sstream>
#include <thread>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/played_box.h"
#include "tests/support/fine_body.h"
#include "tests/support/packed_bundle.h"
#include "tests/support/relaxation.h"

namespace palpate::tests {
namespace {

using formats::SectionId;

const TouchedBox& box() {
  static const TouchedBox shared({}, add_everything);
  return shared;
}

// Two vertices beside the box.
const palpate_render_mesh& vertices() {
  static const float positions[6] = {0.02f, 0.02f, 0.041f, 0.061f, 0.03f, 0.02f}, normals[6] = {0, 0, 1, 1, 0, 0};
  static const palpate_render_mesh mesh = render_mesh(positions, normals, 2);
  return mesh;
}

// The box's surface with finer triangles.
const palpate_fine_surface& fine_surface() {
  static const FineHost host = fine_of(box().body, 1, 0.0003);
  static const palpate_fine_surface view = host.view();
  return view;
}

TEST(Scene, TakesAllItsMemoryFromTheHostAndGivesItBack) {
  struct Host {
    long taken = 0, given = 0, limit = 1000;
  } host;
  SceneDef def = with(SceneDef(), vertices(), fine_surface());
  def.allocator.user = &host;
  def.allocator.allocate = [](void* user, std::size_t bytes, std::size_t alignment) -> void* {
    Host& h = *static_cast<Host*>(user);
    if (h.taken == h.limit) return nullptr;
    ++h.taken;
    return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  };
  def.allocator.release = [](void* user, void* memory) {
    ++static_cast<Host*>(user)->given;
    std::free(memory);
  };
  long needed = 0;
  for (long limit = 0;; ++limit) {  // refused at every single request in turn
    host = {0, 0, limit};
    palpate_scene* scene = nullptr;
    palpate_error error = {};
    const palpate_status status = palpate_scene_create(box().bundle(), &def, &scene, &error);
    if (status == PALPATE_OK) {
      needed = host.taken;
      palpate_scene_destroy(scene);
    } else {
      EXPECT_EQ(status, PALPATE_ERROR_MEMORY);
      EXPECT_EQ(scene, nullptr);
      EXPECT_STRNE(error.text, "");
    }
    EXPECT_EQ(host.taken, host.given);
    if (status == PALPATE_OK) break;
  }
  EXPECT_GT(needed, 10);
}

TEST(Scene, TakesMemoryForLettingContactsGoOnlyWhereItFollowsTheSurface) {
  const auto bytes = [](palpate_collision collision, std::int32_t points) {
    SceneDef def;
    def.collision = collision, def.max_points = points;
    return bytes_of(def, box());
  };
  const auto growth = [&](palpate_collision collision) { return bytes(collision, 64) - bytes(collision, 32); };
  // The field has one vector per surface node. Predicting a contact's end takes up to nine rows of the solver's size.
  EXPECT_GE(growth(PALPATE_COLLISION_DEFORMED) - growth(PALPATE_COLLISION_REST), sizeof(double) * 9 * 3 * 32);
}

// The compliance between nodes takes 72 bytes for each pair of nodes, of which there are at most S.
TEST(Scene, TakesMemoryForAsManyContactNodesAsTheBundleHasColumns) {
  SceneDef usual = SceneDef(), many = usual;
  usual.max_contact_nodes = 192, many.max_contact_nodes = 3000;
  const std::size_t columns = box().touchable.size();
  ASSERT_LT(columns, 192u);
  EXPECT_LT(bytes_of(many, box()) - bytes_of(usual, box()), 3000 * std::size_t{1000});  // no square
}

// All output bytes of a scene in a played run. forces: include the forces of tools and nodes.
std::string played(const SceneDef& def, const std::function<void(palpate_scene*)>& before = {},
                   const TouchedBox& on = box(), bool forces = true, double radius = 0.004) {
  TouchedScene scene(on, def);
  if (before) before(scene.get());
  std::vector<float> u(3 * on.body.surface_nodes), x(u.size());
  palpate_shape_out out = shape_out(u.data(), x.data(), on.body.surface_nodes);
  std::string bytes;
  const auto add = [&](const auto* numbers, std::size_t count) {
    bytes.append(reinterpret_cast<const char*>(numbers), count * sizeof *numbers);
  };
  play(
      on, scene.get(), scene.contacts, 150,
      [&](palpate_step_flags) {
        palpate_scene_shape(scene.get(), scene.contacts.get(), &out);
        scene.contacts->bundle = 0;  // which is another one
        if (forces) add(reinterpret_cast<const char*>(scene.contacts.get()), scene.contacts->used_bytes);
        for (int n = 0; n < scene.contacts->node_count; ++n) {
          add(&scene.contacts.nodes()[n].node, 4);
          add(scene.contacts.nodes()[n].modified_displacement, 3);
        }
        add(u.data(), u.size());
        add(x.data(), x.size());
      },
      radius);
  return bytes;
}

TEST(Scene, IsBitIdenticalWhenAnEffectThatDoesNothingIsAddedOrLeftOut) {
  const SceneDef plain;
  const std::string reference = played(plain);
  SceneDef volume = plain;  // the same surface first
  volume.shape = PALPATE_SHAPE_VOLUME;
  volume.inside.inside = PALPATE_INSIDE_ON;
  EXPECT_EQ(played(volume), reference);
  SceneDef bigger = plain;
  bigger.max_tools = 8, bigger.max_points = 100;
  bigger.max_contact_nodes = 512;  // as for 64 points: the contacts name it
  EXPECT_EQ(played(bigger), reference);
  SceneDef drawn = with(plain, vertices());
  EXPECT_EQ(played(drawn), reference);
  drawn.report.report = PALPATE_REPORT_CONTACTS, drawn.dent.dent = PALPATE_DENT_DISCS;
  EXPECT_EQ(played(drawn), reference);
}

TEST(Scene, FeelsAndDrawsOnTwoThreadsAsItDoesOnOne) {
  SceneDef def = with(SceneDef(), PALPATE_COLLISION_DEFORMED, PALPATE_RADIAL_RESPONSE);
  const ScenePointer scene = box().scene(def), reference = box().scene(def);
  constexpr int kSteps = 400;
  Contacts alone(reference.get());
  std::vector<std::vector<std::uint64_t>> felt, felt_alone;
  std::vector<std::vector<float>> drawn_alone, drawn(kSteps);
  play(box(), reference.get(), alone, kSteps, [&](palpate_step_flags) {
    felt_alone.push_back(alone.memory);
    drawn_alone.push_back(displacements(reference.get(), alone.get(), box().body.surface_nodes));
  });

  // The render thread computes shapes from recorded contacts again and again while the haptic thread runs.
  std::atomic<bool> done{false};
  std::thread render([&] {
    Contacts mine(scene.get());
    for (int round = 0; round < 2 || !done; ++round)
      for (int s = 0; s < kSteps; ++s) {
        mine.memory = felt_alone[s];
        drawn[s] = displacements(scene.get(), mine.get(), box().body.surface_nodes);
      }
  });
  Contacts contacts(scene.get());
  for (int round = 0; round < 20; ++round) {
    felt.clear();
    palpate_scene_reset(scene.get());
    play(box(), scene.get(), contacts, kSteps, [&](palpate_step_flags) { felt.push_back(contacts.memory); });
  }
  done = true;
  render.join();
  EXPECT_EQ(drawn, drawn_alone);
  for (int s = 0; s < kSteps; ++s)
    ASSERT_EQ(std::memcmp(felt[s].data(), felt_alone[s].data(),
                          reinterpret_cast<const palpate_contacts*>(felt[s].data())->used_bytes),
              0);
}

// ---- plan and maps -----------------------------------------------------------------------------------------------------

TEST(Plan, ListsThePassesThatTheEffectsNeedAndNoOthers) {
  SceneDef def;
  EXPECT_EQ(plan_text(box().scene(def).get()),
            "create rest surface in buckets [mesh/nodes mesh/triangles]\n"
            "create tissue under a patch [material/young material/poisson provenance]\n"
            "touch input []\n"
            "touch collision: rest []\n"
            "touch contact: patch []\n"
            "touch solve: sticking [tensors/nodes tensors/force tensors/displacement_surface]\n"
            "touch force: linear []\n"
            "touch output []\n"
            "shape superposition: surface [tensors/displacement_surface]\n"
            "shape positions [mesh/nodes]\n");
  def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_NODE, def.shape = PALPATE_SHAPE_OFF;
  def.force = PALPATE_FORCE_OFF;
  EXPECT_EQ(plan_text(box().scene(def).get()),
            "touch input []\n"
            "touch contact: node []\n"
            "touch solve: sticking [tensors/nodes tensors/force tensors/displacement_surface]\n"
            "touch output []\n");
}

TEST(Plan, HasAFineSurfaceOnlyWhereTheSceneHasOne) {
  SceneDef def;
  const std::string without = plan_text(box().scene(def).get());
  const std::size_t bytes = bytes_of(def, box());
  def.fine_surface = fine_surface();
  std::string with = plan_text(box().scene(def).get());
  const std::string pass = "create fine surface on the mesh [mesh/nodes mesh/triangles]\n";
  ASSERT_NE(with.find(pass), std::string::npos);
  EXPECT_EQ(with.erase(with.find(pass), pass.size()), without);
  EXPECT_GT(bytes_of(def, box()), bytes + 20000);
  // It leaves nothing behind.
  def.fine_surface = palpate_default_fine_surface();
  EXPECT_EQ(bytes_of(def, box()), bytes);
}

// Every combination of effects, with half of the laws, because the other laws map the same sections.
template <class Each>
void for_every_scene(Each each) {
  for (const auto collision : {PALPATE_COLLISION_OFF, PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED})
    for (const auto contact : kEveryContact)
      for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_COULOMB})
        for (const auto force : {PALPATE_FORCE_OFF, PALPATE_FORCE_LINEAR, PALPATE_FORCE_RESPONSE})
          for (const auto shape : {PALPATE_SHAPE_OFF, PALPATE_SHAPE_SURFACE, PALPATE_SHAPE_VOLUME})
            for (const auto radial : {PALPATE_RADIAL_OFF, PALPATE_RADIAL_RESPONSE})
              for (const auto preload : {PALPATE_PRELOAD_OFF, PALPATE_PRELOAD_ON})
                for (const int relaxation : {0, 1}) {
                  if ((radial && !shape) || (relaxation && !force)) continue;
                  SceneDef def = with(SceneDef(), collision, contact, law, force, shape, radial, preload);
                  if (relaxation) def.relaxation = relaxation_of({{0.5, 1}});
                  each(def);
                  if (!shape || radial) continue;
                  def.render_mesh = vertices();
                  each(def);
                }
}

// The names of the passes that a scene's effects ask for.
std::string wanted(const SceneDef& d) {
  static const char* const words[][4] = {{"", "collision: rest", "collision: deformed", ""},
                                         {"contact: node", "contact: triangle", "contact: point", "contact: patch"},
                                         {"solve: sticking", "solve: sliding", "solve: unilateral", "solve: coulomb"},
                                         {"", "force: linear", "force: response", ""},
                                         {"", "superposition: surface", "superposition: volume", ""}};
  std::string text = "input";
  const auto add = [&](const std::string& word) { text += word.empty() ? "" : ", " + word; };
  add(words[0][d.collision]), add(words[1][d.contact]), add(words[2][d.law]), add(words[3][d.force]);
  if (d.relaxation.terms) add("relaxation: prony");
  add("output"), add(words[4][d.shape]);
  if (d.radial) add("radial: response");
  if (d.shape) add("positions");
  if (d.render_mesh.positions) add("skin: render mesh");
  return text;
}

TEST(Plan, HasAPassForEveryEffectThatIsOnAndNoneForOneThatIsOff) {
  int scenes = 0;
  for_every_scene([&](const SceneDef& def) {
    const ScenePointer scene = box().scene(def);
    std::string found;
    for (const palpate_plan_pass& pass : plan_of(scene.get()))
      if (std::string(pass.half) != "create") found += (found.empty() ? "" : ", ") + std::string(pass.name);
    EXPECT_EQ(found, wanted(def));
    ++scenes;
  });
  EXPECT_EQ(scenes, 1680);
}

// All but the scene object itself, whose size is the same for every scene.
TEST(Plan, StatesAllMemoryOfAScene) {
  std::set<std::uint64_t> unplanned;
  for_every_scene([&](const SceneDef& def) {
    std::uint64_t planned = 0;
    unplanned.insert(bytes_of(def, box(), &planned) - planned);
  });
  for (const int collision : {1, 2}) {
    SceneDef def = with(SceneDef(), static_cast<palpate_collision>(collision), fine_surface());
    std::uint64_t planned = 0;
    unplanned.insert(bytes_of(def, box(), &planned) - planned);
  }
  EXPECT_EQ(unplanned.size(), 1u);
  EXPECT_LT(*unplanned.begin(), 100000u);
}

// A watched step reports exactly the passes of its plan, and watching changes no result.
TEST(Plan, IsWhatAStepRunsThroughInOrder) {
  for (const int all : {0, 1}) {
    SceneDef def;
    if (all) {
      def.collision = PALPATE_COLLISION_DEFORMED, def.law = PALPATE_LAW_COULOMB, def.force = PALPATE_FORCE_RESPONSE;
      def.radial = PALPATE_RADIAL_RESPONSE, def.relaxation = relaxation_of({{0.5, 1}});
      def.render_mesh = vertices();
      def.report.report = PALPATE_REPORT_CONTACTS, def.dent.dent = PALPATE_DENT_DISCS;
    }
    TouchedScene scene(box(), def), plain(box(), def);
    const std::vector<palpate_plan_pass> plan = plan_of(scene.get());
    std::vector<std::string> planned, passed;
    for (const palpate_plan_pass& pass : plan)
      if (std::string(pass.half) != "create") planned.push_back(pass.name);
    struct Watch {
      const palpate_plan_pass* pass;
      std::vector<std::string>* passed;
    } watch = {plan.data(), &passed};
    palpate_watch_passes(
        scene.get(),
        [](void* user, int32_t p) {
          auto& [passes, names] = *static_cast<Watch*>(user);
          if (names->empty() || names->back() != passes[p].name) names->push_back(passes[p].name);
        },
        &watch);
    std::vector<float> x(3 * box().body.surface_nodes), y(x.size()), u(x.size());
    palpate_shape_out out = shape_out(u.data(), x.data(), box().body.surface_nodes),
                      other = shape_out(nullptr, y.data(), out.node_capacity);
    std::vector<std::string> of_plain;
    play(box(), plain.get(), plain.contacts, 40, [](palpate_step_flags) {});
    palpate_scene_shape(plain.get(), plain.contacts.get(), &other);
    play(box(), scene.get(), scene.contacts, 40, [&](palpate_step_flags) { of_plain.swap(passed), passed.clear(); });
    passed = of_plain;  // of one touch, the last but one
    palpate_scene_shape(scene.get(), scene.contacts.get(), &out);
    float moved[6];
    palpate_skin_out skin = skin_out(moved, nullptr, 2);
    skin.report = palpate_scene_report(scene.get());
    EXPECT_EQ(palpate_scene_skin(scene.get(), &out, &skin) == 0, all == 1);
    // The two tools are corrected one after the other, so the pass `radial` comes twice.
    passed.erase(std::unique(passed.begin(), passed.end()), passed.end());
    std::vector<std::string> distinct;
    for (const std::string& name : passed)
      if (std::find(distinct.begin(), distinct.end(), name) == distinct.end()) distinct.push_back(name);
    EXPECT_EQ(distinct, planned);
    EXPECT_EQ(x, y);
    EXPECT_EQ(std::memcmp(scene.contacts.get(), plain.contacts.get(), scene.contacts->used_bytes), 0);
    passed.clear();
    palpate_watch_passes(scene.get(), nullptr, nullptr);
    palpate_scene_shape(scene.get(), scene.contacts.get(), &out);
    EXPECT_TRUE(passed.empty());
  }
}

TEST(Plan, RefusesAnEffectWhoseSectionIsNotThere) {
  const TouchedBox bare({.interior = false});
  const auto status = [&](auto change) {
    SceneDef def;
    change(def);
    return refusal_of(bare, def).status;
  };
  EXPECT_EQ(status([](auto& def) { def.shape = PALPATE_SHAPE_VOLUME; }), PALPATE_ERROR_EFFECT);
  EXPECT_EQ(status([](auto& def) { def.radial = PALPATE_RADIAL_RESPONSE; }), PALPATE_ERROR_EFFECT);
  EXPECT_EQ(status([](auto& def) { def.force = PALPATE_FORCE_RESPONSE; }), PALPATE_ERROR_EFFECT);
  EXPECT_EQ(status([](auto& def) { def.preload = PALPATE_PRELOAD_ON; }), PALPATE_ERROR_EFFECT);
  EXPECT_EQ(status([](auto& def) { def.max_tools = 0; }), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(status([](auto& def) { def.max_points = -1; }), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(status([](auto& def) { def.force_limit = NAN; }), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(status([](auto& def) { def.collision = static_cast<palpate_collision>(17); }), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(status([](auto& def) { def.shape = PALPATE_SHAPE_OFF, def.radial = PALPATE_RADIAL_RESPONSE; }),
            PALPATE_ERROR_ARGUMENT);
}

// ---- limits that cannot meet -------------------------------------------------------------------------------------------

// The sentence with which a scene on box() is refused; empty where it is created.
std::string refusal_of(const SceneDef& def) {
  return refusal_of(box(), def).text;
}

SceneDef limits_of(palpate_contact_model contact, std::int32_t points, std::int32_t nodes) {
  SceneDef def;
  def.contact = contact, def.max_points = points, def.max_contact_nodes = nodes;
  return def;
}

TEST(Limits, ThatCannotMeetAreRefused) {
  EXPECT_THAT(refusal_of(limits_of(PALPATE_CONTACT_PATCH, 64, 60)),
              testing::HasSubstr("max_contact_nodes is 60, expected 0 or at least 64"));
  for (const auto contact : kEveryContact) {
    const std::int32_t fewest = contact == PALPATE_CONTACT_TRIANGLE ? 192 : 64;
    EXPECT_NE(refusal_of(limits_of(contact, 64, fewest - 1)), "") << contact;
    EXPECT_EQ(refusal_of(limits_of(contact, 64, fewest)), "") << contact;
    EXPECT_EQ(refusal_of(limits_of(contact, 64, 0)), "") << contact;
  }
}

TEST(Limits, CountALinkAndAGraspAsANodeEach) {
  SceneDef def = limits_of(PALPATE_CONTACT_PATCH, 8, 13);
  def.links.max_links = 3, def.max_tools = 2, def.grasps.grasps = 1;
  EXPECT_EQ(refusal_of(def), "");
  def.max_contact_nodes = 12;
  EXPECT_THAT(refusal_of(def), testing::HasSubstr("at least 13"));
}

// Points that are sent need not all touch, and 3000 nodes are the most.
TEST(Limits, OfMorePointsThanThereMayBeNodesAreTakenWithAllNodes) {
  EXPECT_EQ(refusal_of(limits_of(PALPATE_CONTACT_PATCH, 5000, 3000)), "");
  EXPECT_EQ(refusal_of(limits_of(PALPATE_CONTACT_PATCH, 5000, 0)), "");
  EXPECT_THAT(refusal_of(limits_of(PALPATE_CONTACT_PATCH, 5000, 2999)), testing::HasSubstr("at least 3000"));
}

// What the condition promises: with the fewest nodes that are taken, no contact is dropped.
TEST(Limits, ThatAreTakenHoldEveryContact) {
  for (const auto contact : kEveryContact) {
    constexpr int count = 12;
    SceneDef def = limits_of(contact, count, contact == PALPATE_CONTACT_TRIANGLE ? 3 * count : count);
    def.max_operations = INT64_MAX;
    TouchedScene scene(box(), def);
    std::vector<palpate_grip> grips;
    for (int g = 0; g < count; ++g)
      grips.push_back(grip_at_place(box().far_triangle(g % 6), {0.2 + 0.02 * g, 0.3, 0.5 - 0.02 * g}, {-1e-4, 0, 0}));
    palpate_tool tool = tool_of(grips);
    tool.disc_radius = 0.004;
    const palpate_step_flags flags = scene.touch({tool});
    EXPECT_EQ(flags & PALPATE_STEP_CONTACTS_DROPPED, 0u) << contact;
    EXPECT_EQ(scene.tool().contact_count, count) << contact;
  }
}

// The sections of a file that this process has mapped, by the offsets in /proc/self/maps.
std::vector<std::string> mapped_sections(const std::filesystem::path& file, const formats::BundleIndex& index) {
  std::ifstream maps("/proc/self/maps");
  std::vector<std::string> found;
  for (std::string line; std::getline(maps, line);) {
    if (line.find(file.filename().string()) == std::string::npos) continue;
    std::istringstream words(line);
    std::string range, rights, offset;
    words >> range >> rights >> offset;
    EXPECT_EQ(rights, "r--s");
    for (std::uint32_t e = 0; e < index.header.section_count; ++e)
      if (index.entries[e].offset == std::stoull(offset, nullptr, 16))
        found.push_back(formats::describe_section(static_cast<SectionId>(index.entries[e].id))->path);
  }
  std::sort(found.begin(), found.end());
  return found;
}

// The plan says which sections it maps, and the process maps those and no others, of every form of a bundle. After steps:
// nothing is mapped later.
TEST(Plan, NamesTheSectionsThatTheProcessMapsInEveryScene) {
  std::vector<std::pair<const char*, std::function<void(BundleParts&)>>> forms = {{"f32 rows", [](BundleParts&) {}}};
  forms.insert(forms.end(), std::begin(kPackedForms), std::end(kPackedForms));
  std::set<std::string> ever;
  for (const auto& [name, store] : forms) {
    BundleParts parts = tiny_bundle();
    add_everything(parts);
    store(parts);
    const auto file = scratch_file("maps.h5");
    write_bundle(file, parts);
    const std::string bytes = file_bytes(file);
    formats::BundleIndex index;
    ASSERT_EQ(formats::read_bundle_index(bytes.data(), bytes.size(), &index, nullptr), formats::BundleStatus::ok);
    for_every_scene([&, name = name](const SceneDef& def) {
      // Laws and relaxation do not read the sections in which the forms differ.
      if (name != forms[0].first && (def.law != PALPATE_LAW_STICKING || def.relaxation.terms)) return;
      palpate_bundle* opened = nullptr;
      palpate_error error = {};
      ASSERT_EQ(palpate_bundle_open_file(file.c_str(), nullptr, &opened, &error), PALPATE_OK) << error.text;
      const BundlePointer bundle(opened);
      ASSERT_TRUE(mapped_sections(file, index).empty()) << "opening maps no section";
      palpate_scene* made = nullptr;
      ASSERT_EQ(palpate_scene_create(bundle.get(), &def, &made, &error), PALPATE_OK) << error.text;
      const ScenePointer scene(made);
      Contacts contacts(made);
      play(box(), made, contacts, 2, [&](palpate_step_flags) {
        if (def.shape != PALPATE_SHAPE_OFF) displacements(made, contacts.get(), box().body.surface_nodes);
      });
      std::set<std::string> planned;
      std::uint64_t bytes_of_plan = 0, bytes_of_sections = 0;
      for (const palpate_plan_pass& pass : plan_of(made)) {
        bytes_of_plan += pass.mapped_bytes;
        std::istringstream words(pass.sections);
        for (std::string section; words >> section;) {
          planned.insert(section);
          for (std::uint32_t e = 0; e < index.header.section_count; ++e)
            if (formats::describe_section(static_cast<SectionId>(index.entries[e].id))->path == section)
              bytes_of_sections += index.entries[e].bytes;
        }
      }
      const auto mapped = mapped_sections(file, index);
      EXPECT_EQ(std::set<std::string>(mapped.begin(), mapped.end()), planned) << name << ": " << wanted(def);
      EXPECT_EQ(bytes_of_plan, bytes_of_sections) << name << ": " << wanted(def);
      ever.insert(mapped.begin(), mapped.end());
    });
    std::filesystem::remove(file);
  }
  // Some scene needed each section that the runtime can use.
  for (const char* section :
       {"mesh/nodes", "mesh/triangles", "material/young", "material/poisson", "material/response/force",
        "material/response/radial", "material/response/range", "preload/displacement", "tensors/nodes", "tensors/force",
        "tensors/displacement_surface", "tensors/displacement_interior", "tensors/displacement_scale",
        "tensors/compliance/values", "provenance"})
    EXPECT_TRUE(ever.count(section)) << section;
}

// ---- bits -----------------------------------------------------------------------------------------------------------

// A bundle without the data of an effect gives the same bytes when the effect is off: the effect read nothing.
TEST(Scene, IsBitIdenticalOnABundleThatHasNothingForTheEffectsThatAreOff) {
  const TouchedBox bare({.interior = false});
  int scenes = 0;
  for_every_scene([&](const SceneDef& def) {
    if (def.force == PALPATE_FORCE_RESPONSE || def.shape == PALPATE_SHAPE_VOLUME || def.radial || def.preload) return;
    EXPECT_TRUE(played(def, {}, bare) == played(def)) << wanted(def);
    ++scenes;
  });
  EXPECT_EQ(scenes, 3 * 4 * 2 * 3 * 3);  // no shape, one, one with a render mesh
}

// Results that an effect does not act on have the same bytes with the effect on and off, with any other effects.
TEST(Scene, IsBitIdenticalInWhatAnEffectDoesNotActOn) {
  const auto without_forces = [](const SceneDef& def) {
    return played(
        def, [](palpate_scene*) {}, box(), false);
  };
  for (const auto collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED})
    for (const auto contact : {PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH})
      for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_COULOMB}) {
        SceneDef plain = with(SceneDef(), collision, contact, law);
        SceneDef volume = plain, relaxing = plain, none = plain, response = plain;
        volume.shape = PALPATE_SHAPE_VOLUME;  // the same surface first
        relaxing.relaxation = relaxation_of({{0.5, 0.1}});
        none.force = PALPATE_FORCE_OFF, response.force = PALPATE_FORCE_RESPONSE;
        EXPECT_TRUE(played(volume) == played(plain)) << wanted(plain);
        const std::string fields = without_forces(plain);
        for (const auto& other : {relaxing, none, response}) {
          EXPECT_TRUE(without_forces(other) == fields) << wanted(other);
          // The effect acts on the forces, but this bundle's response is the identity.
          EXPECT_EQ(played(other) == played(plain), other.force == PALPATE_FORCE_RESPONSE) << wanted(other);
        }
      }
}

// A disc of radius 0 is a point: a tool without a disc_radius gets the same result under PATCH as under POINT.
TEST(Scene, IsBitIdenticalUnderPatchAndPointWhereNoToolHasARadius) {
  SceneDef patch = SceneDef(), point = patch;
  patch.law = point.law = PALPATE_LAW_COULOMB, point.contact = PALPATE_CONTACT_POINT;
  EXPECT_TRUE(played(patch, {}, box(), true, 0) == played(point, {}, box(), true, 0));
  EXPECT_FALSE(played(patch) == played(point));
}

TEST(Preload, MovesTheRestShapeThatToolsMeetAndPositionsStartFrom) {
  TouchedScene scene(box(), unlimited_def(PALPATE_PRELOAD_ON));
  // At x = 40 mm the top has gone down by 0.04 mm.
  double above[3] = {0.04, 0.024, 0.03998}, below[3] = {0.04, 0.024, 0.03994};
  const palpate_tool tool_above = point_tool(above), tool_below = point_tool(below);
  scene.touch({tool_above});
  EXPECT_EQ(scene.tool().contact_count, 0);
  scene.touch({tool_below});
  EXPECT_EQ(scene.tool().contact_count, 1);
  scene.reset();
  scene.touch();
  std::vector<float> x(3 * box().body.surface_nodes);
  palpate_shape_out out = shape_out(nullptr, x.data(), box().body.surface_nodes);
  EXPECT_EQ(palpate_scene_shape(scene.get(), scene.contacts.get(), &out), 0u);
  for (int n = 0; n < box().body.surface_nodes; ++n)
    EXPECT_NEAR(x[3 * n + 2], box().node(n)[2] - 0.001 * box().node(n)[0], 1e-8);  // f32 at 4 cm
}

}  // namespace
}  // namespace palpate::tests
