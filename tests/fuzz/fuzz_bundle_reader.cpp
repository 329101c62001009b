// libFuzzer driver: reads any bytes as a bundle. It makes the index's checksum fit, so that the later checks are reached.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "formats/bundle_reader.h"
#include "formats/compliance_blocks.h"
#include "tests/support/sealed_index.h"

using namespace palpate::formats;

namespace {

// Every accepted section must lie within the bytes: reads the last byte of each, so that a sanitizer would report it.
void touch_sections(const BundleIndex& index, const std::vector<std::uint8_t>& bytes) {
  volatile std::uint8_t sink = 0;
  for (std::uint32_t i = 0; i < index.header.section_count; ++i)
    sink = bytes.at(index.entries[i].offset + index.entries[i].bytes - 1);
  (void)sink;
}

template <class Number>
const Number* section(const BundleIndex& index, const std::vector<std::uint8_t>& bytes, SectionId id) {
  const SectionEntry* entry = find_section(index, id);
  return entry ? reinterpret_cast<const Number*>(bytes.data() + entry->offset) : nullptr;
}

// Reads the first and the last number of every block of an accepted compliance.
void read_corners(const BundleIndex& index, const std::vector<std::uint8_t>& bytes, const IndexedSections& sections) {
  const SectionEntry* values = find_section(index, SectionId::compliance_values);
  std::uint64_t first = 0;
  double entry[9];
  for (std::uint64_t b = 0; b < find_section(index, SectionId::compliance_blocks)->shape[0]; ++b) {
    StoredBlock stored;
    std::memcpy(&stored, sections.compliance_blocks + 5 * b, sizeof stored);
    const ComplianceBlock block =
        placed_block(stored, sections.compliance_clusters, first, sections.compliance_scale[b]);
    const auto type = static_cast<ElementType>(values->type);
    block.entry(type, bytes.data() + values->offset, 0, 0, entry);
    block.entry(type, bytes.data() + values->offset, block.rows - 1, block.columns - 1, entry);
    first += block.numbers();
  }
}

void read_as_bundle(const std::vector<std::uint8_t>& bytes) {
  BundleIndex index;
  BundleError error;
  if (read_bundle_index(bytes.data(), bytes.size(), &index, &error) != BundleStatus::ok) {
    if (error.text[0] == '\0' || std::memchr(error.text, 0, sizeof error.text) == nullptr) std::abort();
    return;
  }
  touch_sections(index, bytes);
  IndexedSections sections;
  sections.tetrahedra = section<std::int32_t>(index, bytes, SectionId::tetrahedra);
  sections.region = section<std::int32_t>(index, bytes, SectionId::region);
  sections.triangles = section<std::int32_t>(index, bytes, SectionId::triangles);
  sections.touchable = section<std::int32_t>(index, bytes, SectionId::touchable);
  sections.fixed = section<std::uint8_t>(index, bytes, SectionId::fixed);
  sections.displacement_scale = section<float>(index, bytes, SectionId::displacement_scale);
  sections.compliance_nodes = section<std::int32_t>(index, bytes, SectionId::compliance_nodes);
  sections.compliance_clusters = section<std::int32_t>(index, bytes, SectionId::compliance_clusters);
  sections.compliance_blocks = section<std::int32_t>(index, bytes, SectionId::compliance_blocks);
  sections.compliance_scale = section<float>(index, bytes, SectionId::compliance_scale);
  sections.corridor_nodes = section<std::int32_t>(index, bytes, SectionId::corridor_nodes);
  sections.cut_nodes = section<std::int32_t>(index, bytes, SectionId::cut_nodes);
  if (check_stored_indices(index, sections, &error) != BundleStatus::ok || !sections.compliance_blocks) return;
  read_corners(index, bytes, sections);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint8_t> bytes(data, data + size);
  read_as_bundle(bytes);
  if (size < kUserBlockBytes) return 0;

  palpate::tests::seal_index(bytes.data(), size);
  read_as_bundle(bytes);
  return 0;
}
