// Reads and checks the index of a bundle, without HDF5, exceptions or allocation; safe on untrusted bytes.
#pragma once

#include "formats/bundle_layout.h"

namespace palpate::formats {

enum class BundleStatus : std::uint32_t {
  ok = 0,
  truncated = 1,  // fewer bytes than an index has, or not as many as the index says
  magic = 2,      // not a bundle, or one that was not finished
  version = 3,    // a layout this reader does not know
  section = 4,    // an entry is missing, out of bounds, misaligned or of the wrong type or shape
  checksum = 5,   // bytes are not those that were written
  content = 6,    // an index stored in a section points outside its target, or a number is not finite
};

struct BundleError {
  BundleStatus status = BundleStatus::ok;
  std::uint64_t byte_offset = 0;
  char text[240] = {};  // what was expected, what was found, what to do
};

// The sizes that bundle_sections.def calls N, Ns, E, F, R, S, M, K and C.
struct BundleCounts {
  std::uint64_t nodes, surface_nodes, tetrahedra, triangles, regions, touchable, motions, corridor, cut;
};

// The checked index. It is a copy, so that bytes that change later cannot undo a check.
struct BundleIndex {
  BundleHeader header;
  SectionEntry entries[kMaxSections];
  BundleCounts counts;
};

// Checks the first kUserBlockBytes of a bundle of file_bytes bytes: magic, version, index checksum, every offset,
// length, alignment, type, rank and shape against bundle_sections.def and against one another, with overflow-safe
// arithmetic. head: at least min(file_bytes, kUserBlockBytes) readable bytes, any alignment. Errors: as BundleStatus;
// *index is then unspecified. Cost: microseconds.
BundleStatus read_bundle_index(const void* head, std::uint64_t file_bytes, BundleIndex* index, BundleError* error);

// The entry of a section, or nullptr where the bundle has none.
const SectionEntry* find_section(const BundleIndex& index, SectionId id);

// Checks every integer of the mapped sections that is used as an index, region and fixed values, and scales. A section
// whose pointer is nullptr is not checked. Cost: one pass over those sections, which are small; tensors are not read.
struct IndexedSections {
  const std::int32_t* tetrahedra = nullptr;
  const std::int32_t* region = nullptr;
  const std::int32_t* triangles = nullptr;
  const std::int32_t* touchable = nullptr;
  const std::uint8_t* fixed = nullptr;
  const float* displacement_scale = nullptr;
  const std::int32_t* compliance_nodes = nullptr;
  const std::int32_t* compliance_clusters = nullptr;
  const std::int32_t* compliance_blocks = nullptr;  // only looked at together with the clusters
  const float* compliance_scale = nullptr;
  const std::int32_t* large_order = nullptr;  // that no node is there twice is checked where it is used (a scene)
  const std::int32_t* large_support_nodes = nullptr;  // their order, too
  const std::int32_t* motion_kinds = nullptr;
  const std::uint8_t* motion_pressed = nullptr;
  const std::int32_t* corridor_nodes = nullptr;
  const std::int32_t* cut_nodes = nullptr;
};
BundleStatus check_stored_indices(const BundleIndex& index, const IndexedSections& sections, BundleError* error);

// Name, types, unit and meaning from bundle_sections.def; nullptr for an id it does not list.
struct SectionDescription {
  SectionId id;
  const char* path;
  std::uint32_t types;  // bit 1 << t for each ElementType t it may have
  std::uint32_t rank;
  const char* shape;  // "(S, 3, Ns, 3)"
  const char* unit;
  bool always;
  const char* meaning;
};
constexpr bool may_have(const SectionDescription& section, std::uint32_t type) {
  return type < 32 && (section.types >> type & 1u) != 0;
}
const SectionDescription* describe_section(SectionId id);
const SectionDescription* section_descriptions(std::size_t* count);

}  // namespace palpate::formats
