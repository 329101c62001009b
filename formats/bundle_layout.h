// The fixed bytes at the start of a tensor bundle: the runtime reads them instead of using HDF5.
//
// A bundle is an HDF5 file whose user block holds this index. Every dataset is contiguous, uncompressed and aligned,
// so a section is a plain range of bytes. All integers are little-endian. formats/BUNDLE.md is the byte map.
#pragma once

#include <cstddef>
#include <cstdint>

namespace palpate::formats {

inline constexpr char kBundleMagic[8] = {'P', 'A', 'L', 'P', 'A', 'T', 'E', '\n'};
inline constexpr std::uint32_t kLayoutVersion = 2;
inline constexpr std::uint64_t kUserBlockBytes = 4096;    // HDF5 asks for a power of two >= 512
inline constexpr std::uint64_t kSectionAlignment = 4096;  // a page, so that one section can be mapped alone
inline constexpr std::uint32_t kMaxRank = 4;

enum class ElementType : std::uint32_t { f64 = 1, f32 = 2, i32 = 3, u8 = 4, text = 5, f16 = 6 };

struct BundleHeader {
  char magic[8];                   // offset 0
  std::uint32_t layout_version;    // 8
  std::uint32_t section_count;     // 12
  std::uint64_t file_bytes;        // 16 the whole file, user block included
  std::uint64_t user_block_bytes;  // 24
  std::uint64_t index_checksum;    // 32 XXH64, seed 0, of header and entries with this field zero
  std::uint64_t reserved[3];       // 40 zero
};

struct SectionEntry {
  std::uint32_t id;               // 0  from bundle_sections.def
  std::uint32_t type;             // 4  ElementType
  std::uint32_t rank;             // 8  1 .. kMaxRank
  std::uint32_t reserved;         // 12 zero
  std::uint64_t shape[kMaxRank];  // 16 unused dimensions are 1
  std::uint64_t offset;           // 48 from the start of the file
  std::uint64_t bytes;            // 56 product of shape and the element's size
  std::uint64_t checksum;         // 64 XXH64, seed 0, of the section's bytes
};

static_assert(sizeof(BundleHeader) == 64 && offsetof(BundleHeader, index_checksum) == 32);
static_assert(sizeof(SectionEntry) == 72 && offsetof(SectionEntry, offset) == 48);

inline constexpr std::uint32_t kMaxSections = (kUserBlockBytes - sizeof(BundleHeader)) / sizeof(SectionEntry);

// The section ids by name: SectionId::nodes == 10 and so on.
enum class SectionId : std::uint32_t {
#define PALPATE_SECTION(identifier, id, path, types, rank, shape, unit, presence, meaning) identifier = id,
#include "formats/bundle_sections.def"
#undef PALPATE_SECTION
};

// What a unit of a motion is (the section motion/kinds).
enum class MotionKind : std::int32_t { piston = 1, rotation = 2, field = 3, pressure = 4, gravity = 5 };
inline constexpr std::int32_t kMostMotions = 32;

// Of all [[corridor]] tables together; the section corridor/nodes may have the nodes of a cut's region beside them.
inline constexpr std::int32_t kMostCorridorNodes = 2000;
// Of the section cut/nodes: a whole organ of 5,000 vertices, and a little more. 1.3 GB of compliance.
inline constexpr std::int32_t kMostCutNodes = 6000;

constexpr std::uint64_t element_bytes(ElementType type) {
  switch (type) {
    case ElementType::f64:
      return 8;
    case ElementType::f32:
      return 4;
    case ElementType::i32:
      return 4;
    case ElementType::u8:
      return 1;
    case ElementType::text:
      return 1;
    case ElementType::f16:
      return 2;
  }
  return 0;
}

}  // namespace palpate::formats
