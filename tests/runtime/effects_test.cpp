// A scene pays for the effects it names and no others: sections, passes, bits, memory.

#include <atomic>
#include <regex>
#include <thread>

#include "tests/runtime/played_box.h"

namespace palpate::tests {
namespace {

using formats::SectionId;

const TouchedBox& box() {
  static const TouchedBox shared({}, add_everything);
  return shared;
}

template <class Each>
void play(palpate_scene* scene, Contacts& contacts, int steps, Each each) {
  play(box(), scene, contacts, steps, each);
}

TEST(Scene, TakesAllItsMemoryFromTheHostAndGivesItBack) {
  struct Host {
    long taken = 0, given = 0, limit = 1000;
  } host;
  palpate_scene_def def = palpate_default_scene_def();
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

// All bytes that a scene shows for a played run.
std::string played(const palpate_scene_def& def, const std::function<void(palpate_scene*)>& before = {}) {
  const ScenePointer scene = box().scene(def);
  Contacts contacts(scene.get());
  if (before) before(scene.get());
  std::vector<float> u(3 * static_cast<std::size_t>(box().body.surface_nodes)), x(u.size());
  palpate_shape_out out = {u.data(), x.data(), box().body.surface_nodes, 0};
  std::string bytes;
  play(scene.get(), contacts, 150, [&](palpate_step_flags) {
    palpate_shape(scene.get(), contacts.get(), &out);
    bytes.append(reinterpret_cast<const char*>(contacts.get()), contacts->used_bytes);
    bytes.append(reinterpret_cast<const char*>(u.data()), 4 * u.size());
    bytes.append(reinterpret_cast<const char*>(x.data()), 4 * x.size());
  });
  return bytes;
}

TEST(Scene, IsBitIdenticalWhenAnEffectThatDoesNothingIsAddedOrLeftOut) {
  const palpate_scene_def plain = palpate_default_scene_def();
  const std::string reference = played(plain);
  palpate_scene_def volume = plain;  // the same surface first
  volume.shape = PALPATE_SHAPE_VOLUME;
  EXPECT_EQ(played(volume), reference);
  palpate_scene_def bigger = plain;
  bigger.max_tools = 8, bigger.max_points = 100;
  EXPECT_EQ(played(bigger), reference);
  palpate_scene_def response = plain;
  response.force = PALPATE_FORCE_RESPONSE;
  EXPECT_NE(played(response), "");
}

TEST(Scene, ReplaysBitForBitAfterReset) {
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.radial = PALPATE_RADIAL_RESPONSE;
  const std::string fresh = played(def);
  const std::string again = played(def, [](palpate_scene* scene) {
    Contacts contacts(scene);
    play(scene, contacts, 77, [](palpate_step_flags) {});
    palpate_reset(scene);
  });
  EXPECT_EQ(fresh, again);
}

TEST(Scene, FeelsAndDrawsOnTwoThreadsAsItDoesOnOne) {
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.radial = PALPATE_RADIAL_RESPONSE;
  const ScenePointer scene = box().scene(def), reference = box().scene(def);
  constexpr int kSteps = 400;
  Contacts alone(reference.get());
  std::vector<std::vector<std::uint64_t>> felt, felt_alone;
  std::vector<std::vector<float>> drawn_alone, drawn(kSteps);
  play(reference.get(), alone, kSteps, [&](palpate_step_flags) {
    felt_alone.push_back(alone.memory);
    drawn_alone.push_back(displacements(reference.get(), alone.get(), box().body.surface_nodes));
  });

  // The render thread draws recorded contacts over and over while the haptic thread feels.
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
    palpate_reset(scene.get());
    play(scene.get(), contacts, kSteps, [&](palpate_step_flags) { felt.push_back(contacts.memory); });
  }
  done = true;
  render.join();
  EXPECT_EQ(drawn, drawn_alone);
  for (int s = 0; s < kSteps; ++s)
    ASSERT_EQ(std::memcmp(felt[s].data(), felt_alone[s].data(),
                          reinterpret_cast<const palpate_contacts*>(felt[s].data())->used_bytes),
              0);
}

// ---- plan and maps
// ------------------------------------------------------------------------------------------------------

std::string plan_of(const palpate_scene* scene) {
  int32_t count = 0;
  const palpate_plan_pass* pass = palpate_scene_plan(scene, &count);
  std::string text;
  for (int32_t i = 0; i < count; ++i)
    text += std::string(pass[i].half) + " " + pass[i].name + " [" + pass[i].sections + "]\n";
  return text;
}

TEST(Plan, ListsThePassesThatTheEffectsNeedAndNoOthers) {
  palpate_scene_def def = palpate_default_scene_def();
  EXPECT_EQ(plan_of(box().scene(def).get()),
            "create rest surface in buckets [mesh/nodes mesh/triangles]\n"
            "create tissue under a patch [material/young material/poisson provenance]\n"
            "touch collision: rest []\n"
            "touch contact: patch [tensors/nodes tensors/force tensors/displacement_surface]\n"
            "touch force: linear []\n"
            "shape superposition: surface [tensors/displacement_surface]\n"
            "shape positions [mesh/nodes]\n");
  def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_NODE, def.shape = PALPATE_SHAPE_OFF;
  def.force = PALPATE_FORCE_OFF;
  EXPECT_EQ(plan_of(box().scene(def).get()),
            "touch contact: node [tensors/nodes tensors/force tensors/displacement_surface]\n");
}

TEST(Plan, RefusesAnEffectWhoseSectionIsNotThere) {
  const TouchedBox bare({.interior = false});
  const auto status = [&](auto change) {
    palpate_scene_def def = palpate_default_scene_def();
    change(def);
    palpate_scene* scene = nullptr;
    palpate_error error = {};
    const palpate_status result = palpate_scene_create(bare.bundle(), &def, &scene, &error);
    EXPECT_EQ(scene, nullptr);
    EXPECT_NE(std::string(error.text), "");
    return result;
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

TEST(Plan, MapsTheSectionsThatTheEffectsNeedAndNoOthers) {
  BundleParts parts = tiny_bundle();
  add_everything(parts);
  const auto file = scratch_file("maps.h5");
  write_bundle(file, parts);
  const std::string bytes = file_bytes(file);
  formats::BundleIndex index;
  ASSERT_EQ(formats::read_bundle_index(bytes.data(), bytes.size(), &index, nullptr), formats::BundleStatus::ok);
  const auto mapped = [&](auto change) {
    palpate_bundle* opened = nullptr;
    palpate_error error = {};
    EXPECT_EQ(palpate_bundle_open_file(file.c_str(), &opened, &error), PALPATE_OK) << error.text;
    const BundlePointer bundle(opened);
    palpate_bundle_describe(bundle.get());
    EXPECT_EQ(mapped_sections(file, index), std::vector<std::string>{});
    palpate_scene_def def = palpate_default_scene_def();
    change(def);
    palpate_scene* scene = nullptr;
    EXPECT_EQ(palpate_scene_create(bundle.get(), &def, &scene, &error), PALPATE_OK) << error.text;
    const auto sections = mapped_sections(file, index);
    palpate_scene_destroy(scene);
    return sections;
  };
  using Names = std::vector<std::string>;
  const Names touch = {"tensors/displacement_surface", "tensors/force", "tensors/nodes"};
  const auto with = [&](Names more) {
    more.insert(more.end(), touch.begin(), touch.end());
    std::sort(more.begin(), more.end());
    return more;
  };
  EXPECT_EQ(mapped([](auto& d) {
              d.collision = PALPATE_COLLISION_OFF, d.contact = PALPATE_CONTACT_NODE, d.shape = PALPATE_SHAPE_OFF;
            }),
            touch);
  EXPECT_EQ(mapped([](auto&) {}),
            with({"mesh/nodes", "mesh/triangles", "material/young", "material/poisson", "provenance"}));
  EXPECT_EQ(mapped([](auto& d) { d.contact = PALPATE_CONTACT_POINT; }), with({"mesh/nodes", "mesh/triangles"}));
  EXPECT_EQ(mapped([](auto& d) { d.contact = PALPATE_CONTACT_POINT, d.shape = PALPATE_SHAPE_VOLUME; }),
            with({"mesh/nodes", "mesh/triangles", "tensors/displacement_interior"}));
  EXPECT_EQ(mapped([](auto& d) { d.contact = PALPATE_CONTACT_POINT, d.force = PALPATE_FORCE_RESPONSE; }),
            with({"mesh/nodes", "mesh/triangles", "material/response/force", "material/response/range"}));
  EXPECT_EQ(mapped([](auto& d) { d.contact = PALPATE_CONTACT_POINT, d.preload = PALPATE_PRELOAD_ON; }),
            with({"mesh/nodes", "mesh/triangles", "preload/displacement"}));
  std::filesystem::remove(file);
}

TEST(Preload, MovesTheRestShapeThatToolsMeetAndPositionsStartFrom) {
  palpate_scene_def def = unlimited_def();
  def.preload = PALPATE_PRELOAD_ON;
  const ScenePointer scene = box().scene(def);
  Contacts contacts(scene.get());
  // At x = 40 mm the top has gone down by 0.04 mm.
  double above[3] = {0.04, 0.024, 0.03998}, below[3] = {0.04, 0.024, 0.03994};
  const palpate_tool tool_above = {above, 1, nullptr, 0, 0, 0, 0}, tool_below = {below, 1, nullptr, 0, 0, 0, 0};
  palpate_touch(scene.get(), &tool_above, 1, 1e-3, contacts.get());
  EXPECT_EQ(contacts->tools[0].contact_count, 0);
  palpate_touch(scene.get(), &tool_below, 1, 1e-3, contacts.get());
  EXPECT_EQ(contacts->tools[0].contact_count, 1);
  palpate_reset(scene.get());
  palpate_touch(scene.get(), nullptr, 0, 1e-3, contacts.get());
  std::vector<float> x(3 * static_cast<std::size_t>(box().body.surface_nodes));
  palpate_shape_out out = {nullptr, x.data(), box().body.surface_nodes, 0};
  EXPECT_EQ(palpate_shape(scene.get(), contacts.get(), &out), 0u);
  for (int n = 0; n < box().body.surface_nodes; ++n)
    EXPECT_NEAR(x[3 * n + 2], box().node(n)[2] - 0.001 * box().node(n)[0], 1e-8);  // f32 at 4 cm
}

}  // namespace
}  // namespace palpate::tests
