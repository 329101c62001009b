// Bundles as files and as bytes: cut anywhere, changed anywhere, shortened under the map.
#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/runtime/touched_box.h"

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

TEST(BundleBytes, CutAtAnyByteAreRefused) {
  const std::string whole = bundle_bytes(small_box());
  EXPECT_EQ(status_of(whole), PALPATE_OK);
  AlignedBytes copy(whole);
  for (std::size_t n = 0; n < whole.size(); ++n) {
    palpate_bundle* bundle = nullptr;
    palpate_error error = {};
    ASSERT_NE(palpate_bundle_open(copy.data(), n, nullptr, &bundle, &error), PALPATE_OK) << n;
    ASSERT_EQ(bundle, nullptr);
    ASSERT_STRNE(error.text, "");
  }
  EXPECT_NE(status_of(whole + '\0'), PALPATE_OK);
}

TEST(BundleBytes, WithAnyIndexByteChangedAreRefused) {
  const std::string whole = bundle_bytes(small_box());
  for (std::size_t n = 0; n < formats::kUserBlockBytes; ++n) {
    std::string changed = whole;
    changed[n] = static_cast<char>(changed[n] ^ 0x40);
    ASSERT_NE(status_of(changed), PALPATE_OK) << n;
  }
}

TEST(BundleBytes, WithAnIndexOutOfRangeAreRefused) {
  for (const auto id : {formats::SectionId::tetrahedra, formats::SectionId::triangles, formats::SectionId::touchable,
                        formats::SectionId::region})
    for (const std::int32_t bad : {-1, 1 << 30}) {
      BundleParts parts = small_box();
      auto numbers = parts.get<std::int32_t>(id);
      numbers.back() = bad;
      parts.set(id, parts.sections[id].shape, numbers);
      EXPECT_EQ(status_of(bundle_bytes(parts)), PALPATE_ERROR_CONTENT);
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
    const palpate_scene_def def = palpate_default_scene_def();
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

TEST(BundleBytes, AreComparedWithTheirChecksumsOnRequest) {
  const std::string whole = bundle_bytes(small_box());
  std::string changed = whole;
  formats::BundleIndex index;
  ASSERT_EQ(formats::read_bundle_index(whole.data(), whole.size(), &index, nullptr), formats::BundleStatus::ok);
  changed[formats::find_section(index, formats::SectionId::displacement_surface)->offset + 100] ^= 1;
  for (const auto& [bytes, expected] : {std::pair(whole, PALPATE_OK), std::pair(changed, PALPATE_ERROR_CHECKSUM)}) {
    AlignedBytes copy(bytes);
    palpate_bundle* opened = nullptr;
    ASSERT_EQ(palpate_bundle_open(copy.data(), copy.size(), nullptr, &opened, nullptr), PALPATE_OK);
    const BundlePointer bundle(opened);
    palpate_error error = {};
    EXPECT_EQ(palpate_bundle_check(bundle.get(), &error), expected) << error.text;
  }
}

// ---- files
// --------------------------------------------------------------------------------------------------------------

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

int other_faults = 0;
void count_other_fault(int, siginfo_t* info, void*) {
  ++other_faults;
  // Maps the page again; otherwise the faulting instruction would repeat for ever.
  void* page = reinterpret_cast<void*>(reinterpret_cast<std::uintptr_t>(info->si_addr) / 4096 * 4096);
  mmap(page, 4096, PROT_READ, MAP_PRIVATE | MAP_FIXED | MAP_ANONYMOUS, -1, 0);
}

TEST(BundleFile, ThatShrinksUnderTheMapRaisesAFlagAndNothingElse) {
  // The host has its own handler, which must still get the faults of other maps.
  struct sigaction host = {}, before = {};
  host.sa_sigaction = count_other_fault, host.sa_flags = SA_SIGINFO;
  sigaction(SIGBUS, &host, &before);

  const auto file = scratch_file("shrinks.h5");
  write_bundle(file, tiny_bundle());
  palpate_bundle* opened = nullptr;
  palpate_error error = {};
  ASSERT_EQ(palpate_bundle_open_file(file.c_str(), nullptr, &opened, &error), PALPATE_OK) << error.text;
  const BundlePointer bundle(opened);
  const palpate_scene_def def = palpate_default_scene_def();
  palpate_scene* created = nullptr;
  ASSERT_EQ(palpate_scene_create(bundle.get(), &def, &created, &error), PALPATE_OK) << error.text;
  const ScenePointer scene(created);
  Contacts contacts(scene.get());
  const auto step = [&] {
    const std::vector<palpate_grip> grips = {grip_at_node(palpate_bundle_touchable(bundle.get())[9], {0, 0, .001}),
                                             grip_at_node(palpate_bundle_touchable(bundle.get())[2], {0, 0, .002})};
    const palpate_tool tool = tool_of(grips);
    palpate_step_flags flags = palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes());
    palpate_step_flags shape_flags = 0;
    displacements(scene.get(), contacts.get(), palpate_bundle_describe(bundle.get()).surface_node_count, &shape_flags);
    return flags | shape_flags;
  };
  EXPECT_EQ(step(), 0u);
  ASSERT_EQ(truncate(file.c_str(), formats::kUserBlockBytes), 0);
  palpate_scene_reset(scene.get());
  EXPECT_TRUE(step() & PALPATE_STEP_BUNDLE_LOST);
  EXPECT_TRUE(step() & PALPATE_STEP_BUNDLE_LOST);
  EXPECT_TRUE(std::isfinite(palpate_contacts_tool(contacts, 0)->force[0]));
  EXPECT_EQ(palpate_bundle_check(bundle.get(), &error), PALPATE_ERROR_TRUNCATED);
  EXPECT_EQ(other_faults, 0);

  // A fault in the host's own map reaches the host's handler.
  const auto theirs = scratch_file("theirs");
  std::ofstream(theirs) << std::string(8192, 'x');
  const int descriptor = open(theirs.c_str(), O_RDONLY);
  const auto* map = static_cast<const volatile char*>(mmap(nullptr, 8192, PROT_READ, MAP_SHARED, descriptor, 0));
  ASSERT_EQ(truncate(theirs.c_str(), 0), 0);
  EXPECT_EQ(map[5000], 0);
  EXPECT_EQ(other_faults, 1);
  munmap(const_cast<char*>(map), 8192);
  close(descriptor);
  sigaction(SIGBUS, &before, nullptr);
  std::filesystem::remove(file);
  std::filesystem::remove(theirs);
}

TEST(BundleFile, GivesTheSameStepsAsItsBytes) {
  const TouchedBox box;
  const auto file = scratch_file("same.h5");
  write_bundle(file, tiny_bundle());
  palpate_bundle* opened = nullptr;
  ASSERT_EQ(palpate_bundle_open_file(file.c_str(), nullptr, &opened, nullptr), PALPATE_OK);
  const BundlePointer bundle(opened);
  const palpate_scene_def def = palpate_default_scene_def();
  palpate_scene* created = nullptr;
  ASSERT_EQ(palpate_scene_create(bundle.get(), &def, &created, nullptr), PALPATE_OK);
  const ScenePointer mapped(created), read = box.scene(def);
  Contacts a(mapped.get()), b(read.get());
  const std::vector<palpate_grip> grips = {grip_at_place(box.far_triangle(), {.2, .3, .5}, {-.002, .001, 0})};
  const palpate_tool tool = tool_of(grips);
  palpate_scene_touch(mapped.get(), &tool, 1, 1e-3, a.get(), a.bytes());
  palpate_scene_touch(read.get(), &tool, 1, 1e-3, b.get(), b.bytes());
  EXPECT_EQ(a.memory, b.memory);
  EXPECT_EQ(displacements(mapped.get(), a.get(), box.body.surface_nodes),
            displacements(read.get(), b.get(), box.body.surface_nodes));
  EXPECT_EQ(palpate_bundle_check(bundle.get(), nullptr), PALPATE_OK);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace palpate::tests
