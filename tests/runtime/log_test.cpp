// The host's log: what opening and creating tell it, and that a step tells it nothing.
#include "formats/bundle_reader.h"
#include "tests/runtime/played_box.h"
#include "tests/support/packed_bundle.h"
#include "tests/support/sealed_index.h"

namespace palpate::tests {
namespace {

struct Lines {
  std::vector<std::string> notes, warnings;
  static void write(void* user, palpate_log_level level, const char* text) {
    auto& lines = *static_cast<Lines*>(user);
    (level == PALPATE_LOG_WARNING ? lines.warnings : lines.notes).push_back(text);
  }
};

// A bundle in memory whose log goes to `lines`.
class Logged {
 public:
  explicit Logged(const std::string& bytes) : bytes_(bytes) {
    palpate_bundle_options options = palpate_default_bundle_options();
    options.log = Lines::write, options.log_user = &lines;
    palpate_bundle* opened = nullptr;
    EXPECT_EQ(palpate_bundle_open(bytes_.data(), bytes_.size(), &options, &opened, nullptr), PALPATE_OK);
    bundle_.reset(opened);
  }
  ScenePointer scene(const SceneDef& def) {
    palpate_scene* scene = nullptr;
    EXPECT_EQ(palpate_scene_create(bundle_.get(), &def, &scene, nullptr), PALPATE_OK);
    return ScenePointer(scene);
  }
  palpate_bundle* bundle() { return bundle_.get(); }
  Lines lines;

 private:
  AlignedBytes bytes_;
  BundlePointer bundle_;
};

TEST(Log, TellsWhatWasOpenedAndCreatedInOneLineEach) {
  Logged logged(bundle_bytes(tiny_bundle()));
  ASSERT_EQ(logged.lines.notes.size(), 1u);
  EXPECT_THAT(logged.lines.notes[0], testing::HasSubstr("64 nodes"));
  logged.scene(SceneDef());
  ASSERT_EQ(logged.lines.notes.size(), 2u);
  EXPECT_THAT(logged.lines.notes[1], testing::HasSubstr("passes"));
  for (const std::string& line : logged.lines.notes) EXPECT_EQ(line.find('\n'), std::string::npos);
  EXPECT_TRUE(logged.lines.warnings.empty());
}

TEST(Log, IsNotCalledInAStep) {
  const TouchedBox box({}, add_everything);
  BundleParts parts = tiny_bundle();
  add_everything(parts);
  Logged logged(bundle_bytes(parts));
  SceneDef def = with(SceneDef(), PALPATE_COLLISION_DEFORMED, PALPATE_LAW_COULOMB, PALPATE_FORCE_RESPONSE,
                      PALPATE_RADIAL_RESPONSE);
  const ScenePointer scene = logged.scene(def);
  const std::size_t notes = logged.lines.notes.size(), warnings = logged.lines.warnings.size();
  Contacts contacts(scene.get());
  std::vector<float> u(3 * box.body.surface_nodes);
  palpate_shape_out out = shape_out(u.data(), nullptr, box.body.surface_nodes);
  palpate_step_flags flags = 0;
  play(box, scene.get(), contacts, 100,
       [&](palpate_step_flags raised) { flags |= raised | palpate_scene_shape(scene.get(), contacts, &out); });
  palpate_tool tool = point_tool(nullptr);  // bad input
  flags |= palpate_scene_touch(scene.get(), &tool, 1, NAN, contacts.get(), contacts.bytes());
  flags |= palpate_scene_shape(scene.get(), nullptr, &out);
  EXPECT_TRUE(flags & PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(logged.lines.notes.size(), notes);
  EXPECT_EQ(logged.lines.warnings.size(), warnings);
}

// What a scene is warned of, and what of the same bundle and nearly the same scene it is not.
TEST(Log, WarnsOfAPreloadThatIsLeftOffOfHalfPrecisionAndOfMuchMemory) {
  struct Warning {
    const char* words;
    void (*store)(BundleParts&);
    SceneDef silent, told;
  };
  SceneDef half, much;
  half.max_points = 1000;
  much.max_points = much.max_contact_nodes = 1500;  // 4,500 rows: two squares of 162 MB
  const Warning warnings[] = {
      {"preload is OFF", add_everything, with(SceneDef(), PALPATE_PRELOAD_ON), SceneDef()},
      {"half precision", store_as_f16, SceneDef(), half},
      {"max_contact_nodes (now 1500)", [](BundleParts&) {}, SceneDef(), much},
  };
  for (const Warning& of : warnings) {
    BundleParts parts = tiny_bundle();
    of.store(parts);
    Logged logged(bundle_bytes(parts));
    logged.scene(of.silent);
    EXPECT_TRUE(logged.lines.warnings.empty()) << of.words;
    logged.scene(of.told);
    EXPECT_THAT(logged.lines.warnings, testing::ElementsAre(testing::HasSubstr(of.words)));
  }
}

TEST(Log, WarnsOfMorePointsThanThereAreContactNodes) {
  Logged logged(bundle_bytes(tiny_bundle()));
  SceneDef def;
  def.max_points = 1024;
  logged.scene(def);
  EXPECT_TRUE(logged.lines.warnings.empty());
  def.max_points = 1025;
  logged.scene(def);
  ASSERT_EQ(logged.lines.warnings.size(), 1u);
  EXPECT_THAT(logged.lines.warnings[0], testing::HasSubstr("max_points 1025"));
  def.max_contact_nodes = 1025;
  logged.scene(def);
  EXPECT_EQ(logged.lines.warnings.size(), 1u);
  def.contact = PALPATE_CONTACT_TRIANGLE, def.max_points = 342, def.max_contact_nodes = 0;
  logged.scene(def);
  ASSERT_EQ(logged.lines.warnings.size(), 2u);
  EXPECT_THAT(logged.lines.warnings[1], testing::HasSubstr("max_points 342"));
}

TEST(Log, WarnsOfSectionsOfALaterVersion) {
  std::string bytes = bundle_bytes(tiny_bundle());
  formats::BundleIndex index;
  ASSERT_EQ(formats::read_bundle_index(bytes.data(), bytes.size(), &index, nullptr), formats::BundleStatus::ok);
  for (std::uint32_t e = 0; e < index.header.section_count; ++e)
    if (index.entries[e].id == static_cast<std::uint32_t>(formats::SectionId::displacement_interior)) {
      const std::uint32_t later = 9999;
      std::memcpy(bytes.data() + sizeof(formats::BundleHeader) + e * sizeof(formats::SectionEntry), &later, 4);
    }
  seal_checksum(bytes.data());
  Logged logged(bytes);
  ASSERT_EQ(logged.lines.warnings.size(), 1u);
  EXPECT_THAT(logged.lines.warnings[0], testing::HasSubstr("1 sections"));
}

TEST(Version, IsThatOfTheHeader) {
  std::int32_t numbers[4] = {-1, -1, -1, -1};
  const std::string text = palpate_version(numbers);
  EXPECT_EQ(numbers[0], PALPATE_API_VERSION);
  EXPECT_EQ(numbers[1], PALPATE_VERSION_MAJOR);
  EXPECT_EQ(numbers[2], PALPATE_VERSION_MINOR);
  EXPECT_EQ(numbers[3], PALPATE_VERSION_PATCH);
  EXPECT_EQ(text, PALPATE_VERSION) << "the project's version";
  EXPECT_EQ(palpate_version(nullptr), text);
}

}  // namespace
}  // namespace palpate::tests
