// Bundles of every form, damaged at every position in turn, with a fitting checksum of the index. The runtime must refuse them
// with a sentence, or open them and step with finite output.
#include <gtest/gtest.h>

#include "tests/support/bundle_forms.h"
#include "tests/support/hostile_play.h"
#include "tests/support/sealed_index.h"
#include "tests/support/test_files.h"

namespace palpate::tests {
namespace {

using formats::ElementType;
using formats::SectionId;

const std::vector<BundleForm>& forms() {
  static const std::vector<BundleForm> all = bundle_forms(testing::TempDir());
  return all;
}

formats::BundleIndex index_of(const BundleForm& form) {
  formats::BundleIndex index;
  EXPECT_EQ(formats::read_bundle_index(form.bytes.data(), form.bytes.size(), &index, nullptr),
            formats::BundleStatus::ok);
  return index;
}

// Small limits, so that creating a scene is fast.
SceneDef small_def() {
  SceneDef def;
  def.max_tools = 2, def.max_points = 4, def.max_contact_nodes = 24;
  return def;
}

// Definitions that together read every section. A bundle without a section refuses the effects that need it.
std::vector<SceneDef> all_defs() {
  SceneDef volume = small_def(), laws = small_def(), nodes = small_def(), inside = small_def();
  volume.collision = PALPATE_COLLISION_DEFORMED;
  volume.shape = PALPATE_SHAPE_VOLUME, volume.radial = PALPATE_RADIAL_RESPONSE;
  volume.force = PALPATE_FORCE_RESPONSE, volume.preload = PALPATE_PRELOAD_ON;
  laws.collision = PALPATE_COLLISION_DEFORMED, laws.law = PALPATE_LAW_COULOMB;
  nodes.contact = PALPATE_CONTACT_TRIANGLE, nodes.collision = PALPATE_COLLISION_OFF;
  inside.contact = PALPATE_CONTACT_NODE, inside.collision = PALPATE_COLLISION_OFF;
  inside.shape = PALPATE_SHAPE_VOLUME, inside.inside.inside = PALPATE_INSIDE_ON, inside.preload = PALPATE_PRELOAD_ON;
  return {small_def(), volume, laws, nodes, inside};
}

Played play(const std::string& bytes, const SceneDef& def, int steps = 12) {
  AlignedBytes exact(bytes);
  return play_bytes(exact, def, steps);
}

// A bundle whose index is changed in place and put back: under the sanitizers a copy for each change takes most of the time.
class ChangedIndex {
 public:
  explicit ChangedIndex(const BundleForm& form) : whole_(form.bytes), bytes_(form.bytes) {}
  char* data() { return reinterpret_cast<char*>(bytes_.data()); }
  void restore() { std::memcpy(bytes_.data(), whole_.data(), formats::kUserBlockBytes); }
  Played play(int steps) { return play_bytes(bytes_, small_def(), steps); }

 private:
  const std::string& whole_;
  AlignedBytes bytes_;
};

TEST(HostileScene, OfAWholeBundleIsPlayedInEveryForm) {
  for (const BundleForm& form : forms()) {
    const Played played = play(form.bytes, small_def(), 60);
    EXPECT_EQ(played.broken, "") << form.name;
    EXPECT_EQ(played.opened, PALPATE_OK) << form.name;
    EXPECT_EQ(played.created, PALPATE_OK) << form.name;
    EXPECT_FALSE(played.flags & (PALPATE_STEP_UNSOLVED | PALPATE_STEP_BAD_INPUT)) << form.name;
  }
  // Each form has the storage of its name.
  const BundleForm& blocks = forms()[5];
  const formats::BundleIndex index = index_of(blocks);
  const formats::SectionEntry& entry = *formats::find_section(index, SectionId::compliance_blocks);
  int low_rank = 0;
  for (std::uint64_t b = 0; b < entry.shape[0]; ++b) {
    formats::StoredBlock block;
    std::memcpy(&block, blocks.bytes.data() + entry.offset + b * sizeof block, sizeof block);
    low_rank += block.rank > 0;
  }
  EXPECT_GT(low_rank, 0);
}

TEST(HostileScene, OfAnyFormCutAtAnyByteIsRefused) {
  for (const BundleForm& form : forms()) {
    AlignedBytes bytes(form.bytes);
    for (std::size_t n = 0; n < form.bytes.size(); ++n) {
      palpate_bundle* bundle = nullptr;
      palpate_error error = {};
      const palpate_status status = palpate_bundle_open(bytes.data(), n, nullptr, &bundle, &error);
      ASSERT_NE(status, PALPATE_OK) << form.name << " " << n;
      ASSERT_EQ(bundle, nullptr);
      ASSERT_EQ(broken_by_error(status, error, form.bytes.size()), "") << form.name << " " << n;
    }
  }
}

// Cut, and the index changed to the shorter file size.
TEST(HostileScene, OfAnyFormCutAndSealedIsRefused) {
  for (const BundleForm& form : forms()) {
    const formats::BundleIndex index = index_of(form);
    std::uint64_t end = 0;
    for (std::uint32_t e = 0; e < index.header.section_count; ++e)
      end = std::max(end, index.entries[e].offset + index.entries[e].bytes);
    for (std::size_t n = formats::kUserBlockBytes; n < end; n += n % 4096 < 4000 ? 251 : n % 4096 < 4080 ? 5 : 1) {
      std::string cut = form.bytes.substr(0, n);
      seal_index(cut.data(), cut.size());
      const Played played = play(cut, small_def(), 1);
      ASSERT_EQ(played.broken, "");
      ASSERT_EQ(played.opened, PALPATE_ERROR_SECTION) << form.name << " " << n;
    }
  }
}

TEST(HostileScene, WithAnyByteOfTheIndexChangedIsRefusedOrPlayed) {
  int taken = 0, refused = 0;
  for (const BundleForm& form : forms()) {
    const std::uint32_t used = 64 + 72 * index_of(form).header.section_count;
    ChangedIndex changed(form);
    for (std::size_t at = 0; at < formats::kUserBlockBytes; at += at < used ? 1 : 37)
      for (const int value : {0x00, 0xff, -1}) {
        changed.restore();
        changed.data()[at] = static_cast<char>(value < 0 ? ~form.bytes[at] : value);
        if (changed.data()[at] == form.bytes[at]) continue;
        ASSERT_NE(changed.play(0).opened, PALPATE_OK) << form.name << " byte " << at << ", not sealed";
        seal_checksum(changed.data());
        const Played played = changed.play(2);
        ASSERT_EQ(played.broken, "") << form.name << " byte " << at << " = " << value;
        // Opening does not check the checksums of sections, and a changed id may turn an optional section into an unknown one.
        ++(played.opened == PALPATE_OK ? taken : refused);
      }
  }
  EXPECT_GT(refused, 10000);
  EXPECT_GT(taken, 0);
}

TEST(HostileScene, WithAnyFieldOfTheIndexAtItsExtremesIsRefusedOrPlayed) {
  for (const BundleForm& form : forms()) {
    const formats::BundleIndex index = index_of(form);
    const std::uint64_t size = form.bytes.size();
    ChangedIndex changed(form);
    const auto change = [&](std::size_t at, std::size_t width, std::uint64_t value) {
      if (std::memcmp(form.bytes.data() + at, &value, width) == 0) return;
      changed.restore();
      std::memcpy(changed.data() + at, &value, width);
      seal_checksum(changed.data());
      const Played played = changed.play(1);
      ASSERT_EQ(played.broken, "") << form.name << " byte " << at << " = " << value;
      if (played.opened != PALPATE_OK) {
        // The error names a byte in the index, or the end of the file.
        ASSERT_TRUE(played.byte_offset < formats::kUserBlockBytes || played.opened == PALPATE_ERROR_TRUNCATED ||
                    played.opened == PALPATE_ERROR_CONTENT)
            << form.name << " byte " << at << " = " << value << ": " << played.byte_offset;
      }
    };
    const auto extremes = [&](std::uint64_t own, std::uint64_t other) {
      return std::vector<std::uint64_t>{
          0,         1,       2,         UINT64_MAX,         INT64_MAX,  UINT32_MAX,
          INT32_MAX, own - 1, own + 1,   own + 64,           own + 4096, own - 4096,
          size - 1,  size,    size + 1,  size / 4096 * 4096, other,      UINT64_MAX - 4095,
          own << 32, own * 2, 1ull << 62};
    };
    for (std::size_t at = 8; at < sizeof(formats::BundleHeader); at += 4) {
      std::uint32_t own = 0;
      std::memcpy(&own, form.bytes.data() + at, 4);
      for (const std::uint64_t value : extremes(own, 56)) change(at, 4, value);
    }
    for (std::uint32_t e = 0; e < index.header.section_count; ++e) {
      const std::size_t begin = sizeof(formats::BundleHeader) + e * sizeof(formats::SectionEntry);
      const formats::SectionEntry& next = index.entries[(e + 1) % index.header.section_count];
      for (std::size_t field = 0; field < sizeof(formats::SectionEntry); field += field < 16 ? 4 : 8) {
        const std::size_t width = field < 16 ? 4 : 8;
        std::uint64_t own = 0, other = 0;
        std::memcpy(&own, form.bytes.data() + begin + field, width);
        std::memcpy(&other, reinterpret_cast<const char*>(&next) + field,
                    width);  // copies the next entry's field: overlaps, equal ids
        for (const std::uint64_t value : extremes(own, other)) change(begin + field, width, value);
      }
    }
  }
}

TEST(HostileScene, WithAnyStoredIndexOutOfRangeIsRefusedThere) {
  for (const BundleForm& form : forms()) {
    const formats::BundleIndex index = index_of(form);
    for (const SectionId id :
         {SectionId::tetrahedra, SectionId::region, SectionId::triangles, SectionId::touchable, SectionId::fixed,
          SectionId::compliance_nodes, SectionId::compliance_clusters, SectionId::compliance_blocks}) {
      const formats::SectionEntry* entry = formats::find_section(index, id);
      if (!entry) continue;
      const bool flags = id == SectionId::fixed;  // bytes, 0 or 1
      const std::uint64_t size = flags ? 1 : 4, count = entry->bytes / size;
      using Numbers = std::vector<std::int32_t>;
      const auto nodes = static_cast<std::int32_t>(index.counts.nodes);
      for (std::uint64_t at = 0; at < count; at += at < 64 || at + 64 > count ? 1 : 29)
        for (const std::int32_t bad : flags ? Numbers{2, 255} : Numbers{-1, INT32_MIN, INT32_MAX, nodes}) {
          std::string bytes = form.bytes;
          std::memcpy(bytes.data() + entry->offset + at * size, &bad, size);
          if (bytes == form.bytes) continue;  // equals the valid end of the last cluster
          const Played played = play(bytes, small_def(), 1);
          ASSERT_EQ(played.broken, "") << form.name << " " << formats::describe_section(id)->path << " " << at;
          ASSERT_EQ(played.opened, PALPATE_ERROR_CONTENT)
              << form.name << " " << formats::describe_section(id)->path << " " << at << " = " << bad;
          // The error names a block by its first number, and clusters that end too early by the last.
          ASSERT_GE(played.byte_offset + (id == SectionId::compliance_blocks ? 20 : 0), entry->offset + at * size);
          ASSERT_LT(played.byte_offset, entry->offset + entry->bytes);
        }
    }
  }
}

TEST(HostileScene, WithPlacesThatAreNoPermutationOrBlocksThatOverlapIsRefused) {
  const BundleForm& form = forms()[3];
  const formats::BundleIndex index = index_of(form);
  std::string twice = form.bytes, swapped = form.bytes;
  const std::uint64_t nodes = formats::find_section(index, SectionId::compliance_nodes)->offset;
  std::memcpy(twice.data() + nodes, twice.data() + nodes + 4, 4);
  EXPECT_EQ(play(twice, small_def(), 1).created, PALPATE_ERROR_CONTENT);
  // A touchable node's number where untouchable ones should be.
  const std::uint64_t last = nodes + 4 * (index.counts.surface_nodes - 1);
  std::memcpy(swapped.data() + nodes, form.bytes.data() + last, 4);
  std::memcpy(swapped.data() + last, form.bytes.data() + nodes, 4);
  EXPECT_EQ(play(swapped, small_def(), 1).created, PALPATE_ERROR_CONTENT);
}

// Replaces each number of each section, and whole sections, by values that no solver writes.
TEST(HostileScene, WithNumbersThatAreNoneIsRefusedOrFlaggedOrFinite) {
  const double values[] = {NAN, INFINITY, -INFINITY, 0, -1, 5e-324, 1e-310, 1e300, -1e300, 1e38};
  int flagged = 0, refused = 0;
  for (const BundleForm& form : forms()) {
    const formats::BundleIndex index = index_of(form);
    for (std::uint32_t e = 0; e < index.header.section_count; ++e) {
      const formats::SectionEntry& entry = index.entries[e];
      const auto type = static_cast<ElementType>(entry.type);
      if (type != ElementType::f64 && type != ElementType::f32 && type != ElementType::f16) continue;
      const std::uint64_t size = formats::element_bytes(type), count = entry.bytes / size;
      const auto put = [&](std::string& bytes, std::uint64_t at, double value) {
        char* to = bytes.data() + entry.offset + at * size;
        const float narrow = static_cast<float>(value);
        const std::uint16_t half = formats::half_of(narrow);
        std::memcpy(to,
                    type == ElementType::f64   ? static_cast<const void*>(&value)
                    : type == ElementType::f32 ? static_cast<const void*>(&narrow)
                                               : &half,
                    size);
      };
      for (const double value : values) {
        const auto held = [&](const std::string& bytes, const SceneDef& def, std::int64_t at) {
          const Played played = play(bytes, def);
          ASSERT_EQ(played.broken, "") << form.name << " " << formats::describe_section(SectionId(entry.id))->path
                                       << " " << at << " = " << value;
          flagged += (played.flags & PALPATE_STEP_UNSOLVED) != 0;
          refused += played.opened != PALPATE_OK || played.created != PALPATE_OK;
        };
        for (const SceneDef& def : all_defs()) {
          std::string bytes = form.bytes;
          for (std::uint64_t at = 0; at < count; ++at) put(bytes, at, value);
          held(bytes, def, -1);
          for (std::uint64_t at = 0; at < count; at += std::max<std::uint64_t>(1, count / 5)) {
            bytes = form.bytes;
            put(bytes, at, value);
            held(bytes, def, static_cast<std::int64_t>(at));
          }
        }
      }
    }
  }
  EXPECT_GT(flagged, 0);
  EXPECT_GT(refused, 0);
}

TEST(HostileScene, ShowsNoDisplacementWhereTheBundleHasNoNumberAndSaysSo) {
  // Touch does not read this number of the column, so only shape meets the NaN.
  BundleParts parts = tiny_bundle({.cells = {2, 2, 2}});
  auto rows = parts.get<float>(SectionId::displacement_surface);
  const auto shape = parts.sections.at(SectionId::displacement_surface).shape;
  const std::size_t nodes = shape[2];
  rows[3 * (nodes - 1) + 1] = NAN;  // y of the last node for x of the first column
  parts.set(SectionId::displacement_surface, shape, rows);
  const auto file = scratch("no_number.h5");
  write_bundle(file, parts);
  palpate_bundle* opened = nullptr;
  ASSERT_EQ(palpate_bundle_open_file(file.c_str(), nullptr, &opened, nullptr), PALPATE_OK);
  const BundlePointer bundle(opened);
  SceneDef def = small_def();
  palpate_scene* created = nullptr;
  ASSERT_EQ(palpate_scene_create(bundle.get(), &def, &created, nullptr), PALPATE_OK);
  const ScenePointer scene(created);
  HeldPlay held(scene.get(), def, static_cast<std::int32_t>(nodes));
  palpate_grip grip = palpate_default_grip();
  grip.kind = PALPATE_GRIP_NODE, grip.node = palpate_bundle_touchable(bundle.get())[0];
  grip.displacement[0] = 1e-3;
  const palpate_tool tool = grip_tool(&grip);
  EXPECT_EQ(held.touch(&tool, 1, 1e-3), "");
  EXPECT_EQ(held.flags() & PALPATE_STEP_UNSOLVED, 0u);
  EXPECT_EQ(held.shape(held.contacts()), "");
  EXPECT_TRUE(held.flags() & PALPATE_STEP_UNSOLVED);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace palpate::tests
