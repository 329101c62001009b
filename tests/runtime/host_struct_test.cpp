// Structs of a host that was compiled with an earlier or a later header, and the size of the buffer that a touch fills.
#include "tests/runtime/asked_scene.h"
#include "tests/runtime/played_box.h"

namespace palpate::tests {
namespace {

template <class Struct>
std::uint32_t& size_of(Struct& of) {
  if constexpr (requires { of.part; })
    return of.part.struct_bytes;
  else
    return of.struct_bytes;
}

// A struct as a later header declares it: with one field more, which this library does not know.
template <class Struct>
struct Later {
  Struct known;
  std::uint64_t added = 0;

  explicit Later(Struct from) : known(from) { size_of(known) = sizeof *this; }
};
static_assert(sizeof(Later<palpate_tool>) == sizeof(palpate_tool) + 8);

// A struct as an earlier header declares it: it ends `bytes` bytes after its begin. The rest is what happens to lie behind it.
template <class Struct>
Struct earlier(Struct from, std::size_t bytes) {
  std::memset(reinterpret_cast<unsigned char*>(&from) + bytes, 0xa5, sizeof from - bytes);
  size_of(from) = static_cast<std::uint32_t>(bytes);
  return from;
}

palpate_error refusal_of(const palpate_scene_def& def) {
  return refusal_of(tiny_box(), def);
}

TEST(HostStruct, SceneDefOfAnEarlierHeaderGetsTheDefaultsOfTheFieldsItLacks) {
  palpate_scene_def def = palpate_default_scene_def();
  def.max_contact_nodes = 70, def.force_limit = 1e-3;
  TouchedScene whole(tiny_box(), def);
  TouchedScene without_limit(tiny_box(), earlier(def, offsetof(palpate_scene_def, force_limit)));
  const ScenePointer without_nodes = tiny_box().scene(earlier(def, offsetof(palpate_scene_def, max_tools)));
  EXPECT_EQ(palpate_contacts_bytes(without_limit.get()), palpate_contacts_bytes(whole.get()));
  EXPECT_GT(palpate_contacts_bytes(without_nodes.get()),
            palpate_contacts_bytes(whole.get()));  // 192 nodes, the default
  for (TouchedScene* each : {&whole, &without_limit})
    play(tiny_box(), each->get(), each->contacts, 40, [](palpate_step_flags) {});
  EXPECT_LE(Eigen::Vector3d(whole.tool().force).norm(), 1e-3 * (1 + 1e-12));
  EXPECT_GT(Eigen::Vector3d(without_limit.tool().force).norm(), 1e-2);
}

TEST(HostStruct, SceneDefOfALaterHeaderIsTakenUnlessItSetsAFieldThatTheLibraryDoesNotKnow) {
  Later<palpate_scene_def> def(palpate_default_scene_def());
  EXPECT_EQ(refusal_of(def.known).status, PALPATE_OK);
  def.added = 1;
  const palpate_error error = refusal_of(def.known);
  EXPECT_EQ(error.status, PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, testing::HasSubstr("palpate_scene_def: struct_bytes is " + std::to_string(sizeof def) +
                                             ", this library knows " + std::to_string(sizeof def.known)));
}

TEST(HostStruct, SceneDefWithoutItsSizeIsRefusedWithASentence) {
  palpate_scene_def def = palpate_default_scene_def();
  for (const std::uint32_t bytes :
       {0u, 1u, 4u, 24u, static_cast<std::uint32_t>(sizeof def) - 1, 1032u, 0xcccccccc, 0xffffffff}) {
    def.struct_bytes = bytes;
    const palpate_error error = refusal_of(def);
    EXPECT_EQ(error.status, PALPATE_ERROR_ARGUMENT) << bytes;
    EXPECT_THAT(error.text, testing::HasSubstr("start from palpate_default_scene_def()"));
  }
}

// Bits of a run of two tools of which one holds two grips, passed as `Tool` and `Grip`.
template <class Tool, class Grip>
std::vector<std::uint64_t> touched_with(std::size_t tool_bytes, std::size_t grip_bytes) {
  TouchedScene scene(tiny_box(), unlimited_def(PALPATE_LAW_SLIDING));
  const std::int32_t triangle = tiny_box().far_triangle(5);
  std::vector<unsigned char> grip_memory(2 * grip_bytes), tool_memory(2 * tool_bytes);
  for (int g = 0; g < 2; ++g) {
    Grip grip(grip_at_node(tiny_box().touchable[4 + g], {0, 0, 1e-3}));
    std::memcpy(grip_memory.data() + g * grip_bytes, &grip, grip_bytes);
  }
  for (int s = 0; s < 8; ++s) {
    const Eigen::Vector3d p =
        tiny_box().place(triangle, {.3, .3, .4}) + (0.001 - 5e-4 * s) * tiny_box().outward(triangle);
    Tool first(grip_tool(reinterpret_cast<palpate_grip*>(grip_memory.data()), 2)), second(point_tool(p.data()));
    std::memcpy(tool_memory.data(), &first, tool_bytes);
    std::memcpy(tool_memory.data() + tool_bytes, &second, tool_bytes);
    EXPECT_EQ(scene.touch(reinterpret_cast<palpate_tool*>(tool_memory.data()), 2), 0u);
  }
  EXPECT_EQ(scene.tool().contact_count, 2);
  EXPECT_EQ(scene.tool(1).contact_count, 1);
  return scene.contacts.memory;
}

// A tool without disc radius, friction and hold, which a still earlier header did not have.
struct EarlierTool : palpate_tool {
  static constexpr std::size_t kBytes = offsetof(palpate_tool, disc_radius);
  explicit EarlierTool(palpate_tool from) : palpate_tool(from) { struct_bytes = kBytes; }
};

TEST(HostStruct, ToolsAndGripsAreReadOverTheirOwnSize) {
  const auto expected = touched_with<palpate_tool, palpate_grip>(sizeof(palpate_tool), sizeof(palpate_grip));
  EXPECT_EQ((touched_with<EarlierTool, palpate_grip>(EarlierTool::kBytes, sizeof(palpate_grip))), expected);
  EXPECT_EQ((touched_with<Later<palpate_tool>, Later<palpate_grip>>(sizeof(Later<palpate_tool>),
                                                                    sizeof(Later<palpate_grip>))),
            expected);
}

// A tool point pressed into the far face, and what a touch answers to other structs for it.
class Pressed : public TouchedScene {
 public:
  Pressed() : TouchedScene(tiny_box()) {
    const std::int32_t triangle = tiny_box().far_triangle(5);
    inside_ = tiny_box().place(triangle, {.3, .3, .4}) - 0.001 * tiny_box().outward(triangle);
    const Eigen::Vector3d outside = inside_ + 0.002 * tiny_box().outward(triangle);
    good_ = point_tool(outside.data());
    touch({good_});
    good_.points = inside_.data();
    EXPECT_EQ(touch({good_}), 0u);
    before_ = force();
    EXPECT_GT(before_.norm(), 0);
  }
  void expect_kept(const palpate_tool* tools, std::int32_t count, const std::string& why) {
    EXPECT_EQ(touch(tools, count), PALPATE_STEP_BAD_INPUT) << why;
    ASSERT_EQ(contacts->tool_count, 1) << why;
    EXPECT_EQ(force(), before_) << why;
    EXPECT_EQ(tool().flags, PALPATE_STEP_BAD_INPUT) << why;
  }
  const palpate_tool& good() const { return good_; }

 private:
  Eigen::Vector3d inside_, before_;
  palpate_tool good_;
};

TEST(HostStruct, ToolWithoutItsSizeOrWithAnUnknownFieldKeepsTheLastGoodInput) {
  Pressed pressed;
  for (const std::uint32_t bytes : {0u, 8u, static_cast<std::uint32_t>(sizeof(palpate_tool)) - 4, 2000u, 0xffffffff}) {
    palpate_tool bad = pressed.good();
    bad.struct_bytes = bytes;
    pressed.expect_kept(&bad, 1, std::to_string(bytes));
  }
  Later<palpate_tool> later(pressed.good());
  later.added = 1;
  pressed.expect_kept(&later.known, 1, "an unknown field");
  palpate_tool mixed[2] = {pressed.good(), pressed.good()};
  mixed[1].struct_bytes = EarlierTool::kBytes;
  pressed.expect_kept(mixed, 2, "tools of different sizes");
}

TEST(HostStruct, GripWithoutItsSizeOrWithAnUnknownFieldIsBadInput) {
  Pressed pressed;
  const palpate_grip good = grip_at_node(tiny_box().touchable[4], {0, 0, 1e-3});
  for (const std::uint32_t bytes : {0u, 8u, static_cast<std::uint32_t>(sizeof good) - 8, 2000u}) {
    palpate_grip bad = good;
    bad.struct_bytes = bytes;
    const palpate_tool tool = grip_tool(&bad);
    pressed.expect_kept(&tool, 1, std::to_string(bytes));
  }
  Later<palpate_grip> later(good);
  later.added = 1;
  const palpate_tool tool = grip_tool(&later.known);
  pressed.expect_kept(&tool, 1, "an unknown field");
}

TEST(HostStruct, ShapeAndSkinFillWhatTheHostsStructHas) {
  const SceneDef def = unlimited_def();
  const float vertex[3] = {0.06f, 0.02f, 0.02f}, normal[3] = {1, 0, 0};
  // An earlier render mesh has no normals; a later one is taken as long as its new field is zero.
  const palpate_render_mesh plain = earlier(render_mesh(vertex, normal, 1), offsetof(palpate_render_mesh, normals));
  Later<palpate_render_mesh> later(render_mesh(vertex, normal, 1));
  const auto with = [&](const palpate_render_mesh& mesh) {
    palpate_scene_def with_mesh = def;
    with_mesh.parts = &mesh.part;
    return with_mesh;
  };
  TouchedScene scene(tiny_box(), with(plain));
  tiny_box().scene(with(later.known));
  later.added = 1;
  EXPECT_THAT(refusal_of(with(later.known)).text, testing::HasSubstr("palpate_render_mesh: struct_bytes is"));
  palpate_render_mesh none = palpate_default_render_mesh();
  none.part.struct_bytes = 0;
  EXPECT_THAT(refusal_of(with(none)).text, testing::HasSubstr("start from palpate_default_render_mesh()"));

  play(tiny_box(), scene.get(), scene.contacts, 40, [](palpate_step_flags) {});
  const std::int32_t nodes = tiny_box().body.surface_nodes;
  std::vector<float> u(3 * nodes), x(u), expected = u;
  palpate_shape_out whole = shape_out(expected.data(), nullptr, nodes);
  EXPECT_EQ(palpate_scene_shape(scene.get(), scene.contacts, &whole), 0u);
  palpate_shape_out without_positions =
      earlier(shape_out(u.data(), x.data(), nodes), offsetof(palpate_shape_out, positions));
  EXPECT_EQ(palpate_scene_shape(scene.get(), scene.contacts, &without_positions), 0u);
  EXPECT_EQ(without_positions.node_count, nodes);
  EXPECT_EQ(u, expected);
  Later<palpate_shape_out> later_shape(shape_out(u.data(), x.data(), nodes));
  EXPECT_EQ(palpate_scene_shape(scene.get(), scene.contacts, &later_shape.known), 0u);
  later_shape.added = 1;
  EXPECT_EQ(palpate_scene_shape(scene.get(), scene.contacts, &later_shape.known), PALPATE_STEP_BAD_INPUT);

  float moved[3] = {}, turned[3] = {};
  palpate_skin_out skin = earlier(skin_out(moved, turned, 1), offsetof(palpate_skin_out, normals));
  EXPECT_EQ(palpate_scene_skin(scene.get(), &whole, &skin), 0u);
  EXPECT_EQ(skin.vertex_count, 1);
  Later<palpate_skin_out> later_skin(skin_out(moved, nullptr, 1));
  EXPECT_EQ(palpate_scene_skin(scene.get(), &whole, &later_skin.known), 0u);
  later_skin.added = 1;
  EXPECT_EQ(palpate_scene_skin(scene.get(), &whole, &later_skin.known), PALPATE_STEP_BAD_INPUT);

  for (const std::uint32_t bytes : {0u, 8u, 12u, 0xffffffff}) {
    palpate_shape_out shape = shape_out(u.data(), nullptr, nodes);
    palpate_skin_out out = skin_out(moved, nullptr, 1);
    shape.struct_bytes = out.struct_bytes = bytes;
    EXPECT_EQ(palpate_scene_shape(scene.get(), scene.contacts, &shape), PALPATE_STEP_BAD_INPUT) << bytes;
    EXPECT_EQ(palpate_scene_skin(scene.get(), &whole, &out), PALPATE_STEP_BAD_INPUT) << bytes;
    EXPECT_EQ(palpate_scene_skin(scene.get(), &shape, &skin), PALPATE_STEP_BAD_INPUT) << bytes;
  }
}

TEST(HostStruct, InsideOutIsReadByItsOwnSize) {
  const ScenePointer scene = tiny_box().scene(unlimited_def(PALPATE_SHAPE_VOLUME, PALPATE_INSIDE_ON));
  const auto nodes = static_cast<std::int32_t>(tiny_box().body.mesh.nodes.size());
  std::vector<float> u(3 * nodes), strain(2 * u.size(), NAN), stress = strain;
  palpate_shape_out shape = shape_out(u.data(), nullptr, nodes);
  shape.node_count = nodes;
  palpate_inside_out out = palpate_default_inside_out();
  out.capacity = nodes, out.strains = strain.data(), out.stresses = stress.data();
  palpate_inside_out without_stress = earlier(out, offsetof(palpate_inside_out, stresses));
  EXPECT_EQ(palpate_scene_inside(scene.get(), &shape, &without_stress), 0u);
  EXPECT_EQ(without_stress.count, nodes);
  EXPECT_EQ(strain[0], 0);
  EXPECT_TRUE(std::isnan(stress[0]));
  Later<palpate_inside_out> later(out);
  EXPECT_EQ(palpate_scene_inside(scene.get(), &shape, &later.known), 0u);
  later.added = 1;
  EXPECT_EQ(palpate_scene_inside(scene.get(), &shape, &later.known), PALPATE_STEP_BAD_INPUT);
  for (const std::uint32_t bytes : {0u, 8u, 12u, 0xffffffff}) {
    palpate_inside_out wrong = out;
    wrong.struct_bytes = bytes;
    EXPECT_EQ(palpate_scene_inside(scene.get(), &shape, &wrong), PALPATE_STEP_BAD_INPUT) << bytes;
  }
}

TEST(HostStruct, StepLoadAndBundleInfoHaveTheHostsSize) {
  const ScenePointer scene = tiny_box().scene(unlimited_def());
  palpate_step_load load = palpate_default_step_load();
  load.tools = load.points = load.contacts = 1, load.rows = 3, load.nodes = 12, load.slips = 5;
  const auto steps = [&](const palpate_step_load& of) {
    double sum = 0;
    for (std::size_t p = 0; p < plan_of(scene.get()).size(); ++p)
      sum += palpate_predict_pass(scene.get(), static_cast<std::int32_t>(p), &of).steps;
    return sum;
  };
  palpate_step_load no_slips = load;
  no_slips.slips = 0;
  EXPECT_GT(steps(load), steps(no_slips));
  EXPECT_EQ(steps(earlier(load, offsetof(palpate_step_load, slips))), steps(no_slips));
  EXPECT_EQ(steps(Later<palpate_step_load>(load).known), steps(load));
  load.struct_bytes = 0;
  EXPECT_EQ(steps(load), 0);

  Later<palpate_scene_def> memory(palpate_default_scene_def());  // any memory
  auto* bytes = reinterpret_cast<unsigned char*>(&memory);
  const palpate_bundle_info info = palpate_bundle_describe(tiny_box().bundle());
  EXPECT_NE(info.identity, 0u);
  std::memset(bytes, 0xa5, sizeof memory);
  palpate_bundle_fill_info(tiny_box().bundle(), reinterpret_cast<palpate_bundle_info*>(bytes), 16);
  EXPECT_EQ(std::memcmp(bytes, &info, 16), 0);
  EXPECT_EQ(bytes[16], 0xa5);
  palpate_bundle_fill_info(tiny_box().bundle(), reinterpret_cast<palpate_bundle_info*>(bytes), sizeof info + 8);
  EXPECT_EQ(std::memcmp(bytes, &info, sizeof info), 0);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(bytes[sizeof info + i], 0);
}

TEST(HostStruct, InitWritesTheHostsSizeAndNoByteMore) {
  alignas(8) unsigned char memory[sizeof(palpate_tool) + 16];
  const palpate_tool whole = palpate_default_tool();
  EXPECT_EQ(whole.struct_bytes, sizeof whole);
  for (const std::size_t bytes : {EarlierTool::kBytes, sizeof whole, sizeof whole + 8}) {
    std::memset(memory, 0xa5, sizeof memory);
    palpate_init_tool(reinterpret_cast<palpate_tool*>(memory), bytes);
    palpate_tool expected = whole;
    expected.struct_bytes = static_cast<std::uint32_t>(bytes);
    EXPECT_EQ(std::memcmp(memory, &expected, std::min(bytes, sizeof whole)), 0);
    for (std::size_t i = sizeof whole; i < bytes; ++i) EXPECT_EQ(memory[i], 0);
    EXPECT_EQ(memory[bytes], 0xa5);
  }
}

// ---- the buffer of a touch ----------------------------------------------------------------------------------------------

// The buffer is exactly as large as the host says, so that a sanitizer reports a byte behind it; in other builds the
// bytes behind are compared.
TEST(TouchBuffer, ThatIsTooSmallIsBadInputAndNotWritten) {
  const ScenePointer scene = tiny_box().scene(unlimited_def());
  const std::size_t enough = palpate_contacts_bytes(scene.get());
  std::vector<palpate_grip> grips;
  for (int g = 0; g < 8; ++g) grips.push_back(grip_at_node(tiny_box().touchable[g], {0, 0, 1e-3}));
  const palpate_tool tool = tool_of(grips);
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{8}, sizeof(palpate_contacts),
                                  sizeof(palpate_contacts) + sizeof(palpate_tool_state), enough - 8, enough - 1}) {
    const std::unique_ptr<unsigned char, decltype(&std::free)> memory(
        static_cast<unsigned char*>(std::malloc(std::max<std::size_t>(bytes, 1))), &std::free);
    std::memset(memory.get(), 0x5a, bytes);
    EXPECT_EQ(
        palpate_scene_touch(scene.get(), &tool, 1, 1e-3, reinterpret_cast<palpate_contacts*>(memory.get()), bytes),
        PALPATE_STEP_BAD_INPUT)
        << bytes;
    for (std::size_t i = 0; i < bytes; ++i) ASSERT_EQ(memory.get()[i], 0x5a) << bytes << " " << i;
  }
  // None of these calls was a step. A buffer of exactly the stated size holds the result.
  const std::unique_ptr<void, decltype(&std::free)> memory(std::malloc(enough), &std::free);
  auto* contacts = static_cast<palpate_contacts*>(memory.get());
  EXPECT_EQ(palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts, enough), 0u);
  EXPECT_EQ(contacts->step, 1u);
  EXPECT_EQ(contacts->node_count, 8);
  EXPECT_LE(contacts->used_bytes, enough);
}

TEST(TouchBuffer, HoldsAsManyToolsAndNodesAsTheSceneAllows) {
  SceneDef def = unlimited_def();
  def.max_tools = PALPATE_MAX_TOOLS, def.max_points = def.max_contact_nodes = 16;
  const ScenePointer scene = tiny_box().scene(def);
  std::vector<palpate_grip> grips;
  for (int g = 0; g < 2 * PALPATE_MAX_TOOLS; ++g) grips.push_back(grip_at_node(tiny_box().touchable[g], {0, 0, 1e-3}));
  std::vector<palpate_tool> tools;
  for (int t = 0; t < PALPATE_MAX_TOOLS; ++t) tools.push_back(grip_tool(&grips[2 * t], 2));
  const std::size_t bytes = palpate_contacts_bytes(scene.get());
  const std::unique_ptr<void, decltype(&std::free)> memory(std::malloc(bytes), &std::free);
  auto* contacts = static_cast<palpate_contacts*>(memory.get());
  palpate_scene_touch(scene.get(), tools.data(), PALPATE_MAX_TOOLS, 1e-3, contacts, bytes);
  EXPECT_EQ(contacts->tool_count, PALPATE_MAX_TOOLS);
  EXPECT_EQ(contacts->node_count, 16);
  EXPECT_EQ(contacts->used_bytes, bytes);
}

// ---- allocator of a bundle ----------------------------------------------------------------------------------------------

struct Counted {
  int taken = 0, released = 0;
  bool empty = false;
};
palpate_allocator counting(Counted* counted) {
  palpate_allocator allocator = {};
  allocator.user = counted;
  allocator.allocate = [](void* user, std::size_t bytes, std::size_t alignment) -> void* {
    auto& count = *static_cast<Counted*>(user);
    if (count.empty) return nullptr;
    ++count.taken;
    return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  };
  allocator.release = [](void* user, void* memory) {
    ++static_cast<Counted*>(user)->released;
    std::free(memory);
  };
  return allocator;
}

TEST(BundleOptions, AllocatorGivesTheBundlesMemoryAndGetsItBack) {
  const AlignedBytes bytes(bundle_bytes(tiny_bundle({})));
  const auto file = scratch_file("bundle.h5");
  write_bundle(file, tiny_bundle({}));
  Counted counted;
  Later<palpate_bundle_options> options(palpate_default_bundle_options());
  options.known.allocator = counting(&counted);
  palpate_bundle* bundle = nullptr;
  palpate_error error = {};
  const auto open = [&](bool from_file, std::size_t count) {
    const palpate_status status = from_file ? palpate_bundle_open_file(file.c_str(), &options.known, &bundle, &error)
                                            : palpate_bundle_open(const_cast<AlignedBytes&>(bytes).data(), count,
                                                                  &options.known, &bundle, &error);
    EXPECT_EQ(status == PALPATE_OK, bundle != nullptr);
    return status;
  };
  for (const bool from_file : {false, true}) {
    counted = {};
    ASSERT_EQ(open(from_file, bytes.size()), PALPATE_OK) << error.text;
    EXPECT_GT(counted.taken, 0);
    palpate_bundle_close(bundle);
    EXPECT_EQ(counted.released, counted.taken);
    counted.empty = true;
    EXPECT_EQ(open(from_file, bytes.size()), PALPATE_ERROR_MEMORY);
    counted.empty = false;
  }
  EXPECT_EQ(open(false, bytes.size() / 2), PALPATE_ERROR_TRUNCATED);
  EXPECT_EQ(counted.released, counted.taken);
  options.known.allocator.release = nullptr;
  EXPECT_EQ(open(false, bytes.size()), PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, testing::HasSubstr("both allocate and release"));
  options = Later<palpate_bundle_options>(palpate_default_bundle_options());
  options.added = 1;
  EXPECT_EQ(open(true, 0), PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, testing::HasSubstr("palpate_bundle_options: struct_bytes"));
  options.known.struct_bytes = 0;
  EXPECT_EQ(open(true, 0), PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, testing::HasSubstr("start from palpate_default_bundle_options()"));
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace palpate::tests
