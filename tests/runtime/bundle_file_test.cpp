// Bundles as files and as bytes. What is cut, changed or written over under the map: tests/hostile.
#include <sys/stat.h>

#include <set>
#include <sstream>

#include "tests/runtime/touched_box.h"
#include "tests/support/box_corridor.h"
#include "tests/support/bundle_forms.h"

namespace palpate::tests {
namespace {

const BundleParts& small_box() {
  static const BundleParts parts = tiny_bundle({.cells = {2, 2, 1}});
  return parts;
}

palpate_status status_of(const std::string& bytes, palpate_error* error = nullptr) {
  AlignedBytes copy(bytes);
  palpate_bundle* bundle = nullptr;
  const palpate_status status = palpate_bundle_open(copy.data(), copy.size(), nullptr, &bundle, error);
  EXPECT_EQ(bundle == nullptr, status != PALPATE_OK);
  palpate_bundle_close(bundle);
  return status;
}

TEST(BundleBytes, WithACorridorAreOpenedWhereItsNodesAscendInside) {
  const DenseBody dense = dense_box({});
  BundleParts parts = dense_bundle(dense);
  add_corridor(parts, dense, {56, 58, 63});
  EXPECT_EQ(status_of(bundle_bytes(parts)), PALPATE_OK);
  for (const std::vector<std::int32_t>& bad : {std::vector{55, 58, 63}, {56, 58, 64}, {58, 56, 63}}) {
    parts.set(formats::SectionId::corridor_nodes, {3}, bad);
    palpate_error error = {};
    EXPECT_EQ(status_of(bundle_bytes(parts), &error), PALPATE_ERROR_CONTENT);
    EXPECT_THAT(error.text, testing::StartsWith("corridor/nodes: expected "));
  }
}

TEST(BundleBytes, WithUnusableNumbersDoNotBecomeAScene) {
  const auto scene_status = [](auto id, auto change) {
    BundleParts parts = small_box();
    auto numbers = parts.get<double>(id);
    change(numbers);
    parts.set(id, parts.sections[id].shape, numbers);
    AlignedBytes bytes(bundle_bytes(parts));
    palpate_bundle* opened = nullptr;
    EXPECT_EQ(palpate_bundle_open(bytes.data(), bytes.size(), nullptr, &opened, nullptr), PALPATE_OK);
    const BundlePointer bundle(opened);
    const SceneDef def;
    palpate_scene* scene = nullptr;
    const palpate_status status = palpate_scene_create(bundle.get(), &def, &scene, nullptr);
    EXPECT_EQ(scene, nullptr);
    return status;
  };
  using formats::SectionId;
  EXPECT_EQ(scene_status(SectionId::nodes, [](auto& x) { x[7] = NAN; }), PALPATE_ERROR_CONTENT);
  EXPECT_EQ(scene_status(SectionId::nodes, [](auto& x) { x[7] = 1e200; }), PALPATE_ERROR_CONTENT);
  EXPECT_EQ(scene_status(SectionId::force, [](auto& x) { x[9] = INFINITY; }), PALPATE_ERROR_CONTENT);
  EXPECT_EQ(scene_status(SectionId::force, [](auto& x) { x[9] = -x[9]; }), PALPATE_ERROR_CONTENT);
}

TEST(BundleBytes, ThatAreNotAlignedOrNotThereAreRefused) {
  const std::string whole = bundle_bytes(small_box());
  AlignedBytes copy(" " + whole);
  palpate_bundle* bundle = nullptr;
  EXPECT_EQ(palpate_bundle_open(copy.data() + 1, whole.size(), nullptr, &bundle, nullptr), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_bundle_open(nullptr, 100, nullptr, &bundle, nullptr), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_bundle_open(copy.data(), whole.size(), nullptr, nullptr, nullptr), PALPATE_ERROR_ARGUMENT);
  palpate_bundle_close(nullptr);
}

TEST(BundleFile, ThatCannotBeOpenedSaysWhy) {
  const auto text = [](const std::string& path, palpate_status expected) {
    palpate_bundle* bundle = nullptr;
    palpate_error error = {};
    EXPECT_EQ(palpate_bundle_open_file(path.c_str(), nullptr, &bundle, &error), expected);
    EXPECT_EQ(bundle, nullptr);
    return std::string(error.text);
  };
  EXPECT_THAT(text("/nowhere/organ.h5", PALPATE_ERROR_FILE), testing::HasSubstr("does not exist"));
  EXPECT_THAT(text("/", PALPATE_ERROR_FILE), testing::HasSubstr("regular file"));
  const auto empty = scratch_file("empty.h5");
  std::ofstream{empty};
  EXPECT_NE(text(empty, PALPATE_ERROR_TRUNCATED), "");
  std::filesystem::remove(empty);
  const auto pipe = scratch_file("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(text(pipe, PALPATE_ERROR_FILE), testing::HasSubstr("regular file"));  // and it does not wait for a writer
  std::filesystem::remove(pipe);
}

TEST(BundleFile, GivesTheSameStepsAsItsBytesHoweverItIsOpened) {
  const TouchedBox box;
  const auto file = scratch_file("same.h5");
  write_bundle(file, tiny_bundle());
  const SceneDef def;
  const std::vector<palpate_grip> grips = {grip_at_place(box.far_triangle(), {.2, .3, .5}, {-.002, .001, 0})};
  const palpate_tool tool = tool_of(grips);
  TouchedScene of_bytes(box, def);
  of_bytes.touch({tool});
  for (const palpate_file_access access : {PALPATE_FILE_MAP, PALPATE_FILE_MAP_GUARDED, PALPATE_FILE_COPY}) {
    const palpate_bundle_options options = options_for(access);
    palpate_bundle* opened = nullptr;
    ASSERT_EQ(palpate_bundle_open_file(file.c_str(), &options, &opened, nullptr), PALPATE_OK);
    const BundlePointer bundle(opened);
    palpate_scene* created = nullptr;
    ASSERT_EQ(palpate_scene_create(bundle.get(), &def, &created, nullptr), PALPATE_OK);
    const ScenePointer scene(created);
    Contacts contacts(created);
    palpate_scene_touch(created, &tool, 1, 1e-3, contacts.get(), contacts.bytes());
    EXPECT_EQ(contacts.memory, of_bytes.contacts.memory);
    EXPECT_EQ(displacements(created, contacts.get(), box.body.surface_nodes), of_bytes.shape());
    EXPECT_EQ(palpate_bundle_check(bundle.get(), nullptr), PALPATE_OK);
  }
  std::filesystem::remove(file);
}

TEST(BundleFile, IsCopiedSectionBySectionIntoTheBundlesMemory) {
  struct Host {
    std::size_t taken = 0, most = SIZE_MAX;
    int arrays = 0;
  } host;
  const auto file = scratch_file("copied.h5");
  write_bundle(file, tiny_bundle());
  palpate_bundle_options options = options_for(PALPATE_FILE_COPY);
  options.allocator.user = &host;
  options.allocator.allocate = [](void* user, std::size_t bytes, std::size_t alignment) -> void* {
    Host& h = *static_cast<Host*>(user);
    if (h.taken + bytes > h.most) return nullptr;
    h.taken += bytes, ++h.arrays;
    return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  };
  options.allocator.release = [](void* user, void* memory) {
    --static_cast<Host*>(user)->arrays;
    std::free(memory);
  };
  palpate_bundle* opened = nullptr;
  palpate_error error = {};
  ASSERT_EQ(palpate_bundle_open_file(file.c_str(), &options, &opened, &error), PALPATE_OK) << error.text;
  BundlePointer bundle(opened);
  EXPECT_EQ(host.arrays, 1) << "opening keeps no section";
  const std::size_t opening = host.taken;
  const SceneDef def;
  host.most = host.taken + 1000;
  palpate_scene* scene = nullptr;
  EXPECT_EQ(palpate_scene_create(opened, &def, &scene, &error), PALPATE_ERROR_MEMORY);
  EXPECT_THAT(error.text, testing::HasSubstr("PALPATE_FILE_MAP"));
  host.most = SIZE_MAX;
  ASSERT_EQ(palpate_scene_create(opened, &def, &scene, &error), PALPATE_OK) << error.text;
  std::uint64_t planned = 0;
  std::set<std::string> names;
  for (const palpate_plan_pass& pass : plan_of(scene)) {
    std::istringstream words(pass.sections);
    for (std::string name; words >> name;) names.insert(name);
    planned = std::max<std::uint64_t>(planned, pass.mapped_bytes);
  }
  EXPECT_EQ(host.arrays, 1 + static_cast<int>(names.size())) << "one copy for each section that the scene needs";
  EXPECT_GT(host.taken - opening, planned);
  const int arrays = host.arrays;
  palpate_scene* second = nullptr;
  ASSERT_EQ(palpate_scene_create(opened, &def, &second, &error), PALPATE_OK);
  EXPECT_EQ(host.arrays, arrays) << "scenes share the copies";
  palpate_scene_destroy(second);
  palpate_scene_destroy(scene);
  bundle.reset();
  EXPECT_EQ(host.arrays, 0);
  const int none = 7;
  std::memcpy(&options.file_access, &none, sizeof none);
  EXPECT_EQ(palpate_bundle_open_file(file.c_str(), &options, &opened, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, testing::HasSubstr("file_access is 7"));
  std::filesystem::remove(file);
}

// ---- response curves ---------------------------------------------------------------------------------------------------

TEST(BundleBytes, WithAResponseCurveThatCannotBeOneAreRefused) {
  // Coefficients of T_0, T_1, T_2 over a range of 1.
  struct Case {
    const char* what;
    std::vector<double> coefficients;
    const char* sentence;
  };
  const std::vector<Case> cases = {
      {"a millionfold", {5e5, 5e5}, "answers 1e+06 "},
      {"a millionth", {5e-7, 5e-7}, "answers 1e-06 "},
      {"all zero", {0, 0}, "falls to 0"},
      {"decreasing", {-0.5, -0.5}, "falls to -1"},
      {"rising and falling", {0.5, 0.2, -0.3}, "falls"},
      {"not zero at zero", {5.5, 0.5}, "is 5"},
      {"one coefficient", {1}, "has 1 coefficients"},
  };
  for (const auto section : {formats::SectionId::response_radial, formats::SectionId::response_force})
    for (const Case& c : cases) {
      BundleParts parts = tiny_bundle();
      add_everything(parts);
      parts.set(section, {c.coefficients.size()}, c.coefficients);
      palpate_error error = {};
      EXPECT_EQ(status_of(bundle_bytes(parts), &error), PALPATE_ERROR_CONTENT) << c.what;
      EXPECT_THAT(error.text, testing::HasSubstr(c.sentence)) << c.what;
      EXPECT_THAT(error.text, testing::HasSubstr(formats::describe_section(section)->path)) << c.what;
    }
}

// The bytes of a bundle can change after it was opened; palpate_bundle_check reads the curves anew.
TEST(BundleBytes, WhoseResponseCurveWasChangedAfterOpeningAreRefusedByTheCheck) {
  BundleParts parts = tiny_bundle();
  add_everything(parts);
  AlignedBytes bytes(bundle_bytes(parts));
  formats::BundleIndex index;
  ASSERT_EQ(formats::read_bundle_index(bytes.data(), bytes.size(), &index, nullptr), formats::BundleStatus::ok);
  palpate_bundle* opened = nullptr;
  ASSERT_EQ(palpate_bundle_open(bytes.data(), bytes.size(), nullptr, &opened, nullptr), PALPATE_OK);
  const BundlePointer bundle(opened);
  palpate_error error = {};
  EXPECT_EQ(palpate_bundle_check(opened, &error), PALPATE_OK) << error.text;
  auto* force = reinterpret_cast<double*>(const_cast<unsigned char*>(bytes.data()) +
                                          formats::find_section(index, formats::SectionId::response_force)->offset);
  force[1] = -force[1];
  EXPECT_EQ(palpate_bundle_check(opened, &error), PALPATE_ERROR_CHECKSUM);
}

}  // namespace
}  // namespace palpate::tests
