// A scene pays for the effects it names and no others: sections, passes, bits, memory.

#include <atomic>
#include <regex>
#include <thread>

#include "tests/runtime/touched_box.h"

// Every allocation of the process is counted while a step runs, from malloc as well as from operator new. Sanitizers
// bring their own malloc; then nothing is counted and the test is skipped.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kCounts = false;
#else
constexpr bool kCounts = true;
#endif
namespace {
thread_local bool counting = false;
thread_local long allocations = 0;
}  // namespace
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void* malloc(std::size_t bytes) {
  allocations += counting;
  return __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  allocations += counting;
  return __libc_calloc(count, bytes);
}
void* realloc(void* memory, std::size_t bytes) {
  allocations += counting;
  return __libc_realloc(memory, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  allocations += counting;
  return __libc_memalign(alignment, bytes);
}
}
#endif

namespace palpate::tests {
namespace {

using formats::SectionId;

void add_everything(BundleParts& parts) {
  const auto nodes = parts.get<double>(SectionId::nodes);
  std::vector<double> preload(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) preload[i] = i % 3 == 2 ? -0.001 * nodes[i - 2] : 0;
  parts.set(SectionId::preload_displacement, {nodes.size() / 3, 3}, preload);
  parts.set(SectionId::response_radial, {2}, std::vector<double>{0.5, 0.5});
  parts.set(SectionId::response_force, {2}, std::vector<double>{0.5, 0.5});
  parts.set(SectionId::response_range, {2}, std::vector<double>{1, 1});
}
const TouchedBox& box() {
  static const TouchedBox shared({}, add_everything);
  return shared;
}

// A tool that comes down on the far face, slides a little and goes out again, and a grip beside it.
template <class Each>
void play(palpate_scene* scene, Contacts& contacts, int steps, Each each) {
  const std::int32_t triangle = box().far_triangle(5);
  const Eigen::Vector3d place = box().place(triangle, {.3, .3, .4}), out = box().outward(triangle);
  for (int s = 0; s < steps; ++s) {
    const Eigen::Vector3d p =
        place + (0.002 * std::cos(0.05 * s)) * out + Eigen::Vector3d(0, 0.0005 * std::sin(0.03 * s), 0);
    const palpate_grip grip = grip_at_node(box().touchable[4], {0, 0, 0.001 * std::sin(0.02 * s)});
    const palpate_tool tools[2] = {{p.data(), 1, nullptr, 0, 0}, {nullptr, 0, &grip, 1, 0}};
    each(palpate_touch(scene, tools, 2, 1e-3, contacts.get()));
  }
}

TEST(Step, AllocatesNothing) {
  if (!kCounts) GTEST_SKIP() << "a sanitizer's malloc is not counted";
  for (const auto collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED})
    for (const auto contact : {PALPATE_CONTACT_NODE, PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_POINT}) {
      palpate_scene_def def = palpate_default_scene_def();
      def.collision = collision, def.contact = contact;
      def.shape = PALPATE_SHAPE_VOLUME, def.radial = PALPATE_RADIAL_RESPONSE, def.force = PALPATE_FORCE_RESPONSE;
      const ScenePointer scene = box().scene(def);
      Contacts contacts(scene.get());
      std::vector<float> u(static_cast<std::size_t>(box().dofs()));
      palpate_shape_out out = {u.data(), nullptr, static_cast<std::int32_t>(box().dofs() / 3), 0};
      allocations = 0;
      counting = true;
      int contact_steps = 0;
      play(scene.get(), contacts, 200, [&](palpate_step_flags) {
        palpate_shape(scene.get(), contacts.get(), &out);
        contact_steps += contacts->tools[0].contact_count;
      });
      counting = false;
      EXPECT_EQ(allocations, 0);
      EXPECT_GT(contact_steps, 20);
    }
  counting = true;
  std::free(std::malloc(1));
  counting = false;
  EXPECT_EQ(allocations, 1) << "the counter does not count";
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
            "touch collision: rest []\n"
            "touch contact: point [tensors/nodes tensors/force tensors/displacement_surface]\n"
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
  EXPECT_EQ(mapped([](auto&) {}), with({"mesh/nodes", "mesh/triangles"}));
  EXPECT_EQ(mapped([](auto& d) { d.shape = PALPATE_SHAPE_VOLUME; }),
            with({"mesh/nodes", "mesh/triangles", "tensors/displacement_interior"}));
  EXPECT_EQ(mapped([](auto& d) { d.force = PALPATE_FORCE_RESPONSE; }),
            with({"mesh/nodes", "mesh/triangles", "material/response/force", "material/response/range"}));
  EXPECT_EQ(mapped([](auto& d) { d.preload = PALPATE_PRELOAD_ON; }),
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
  const palpate_tool tool_above = {above, 1, nullptr, 0, 0}, tool_below = {below, 1, nullptr, 0, 0};
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
