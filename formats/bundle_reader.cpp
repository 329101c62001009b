#include "formats/bundle_reader.h"

#include <bit>
#include <cinttypes>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <initializer_list>

#include "formats/checksum.h"
#include "formats/compliance_blocks.h"
#include "formats/element_layout.h"

namespace palpate::formats {

namespace {

static_assert(std::endian::native == std::endian::little, "the index is read as it lies in the file: little-endian");

enum class Presence { optional, always };

// The types column of the list: one name, or several joined by |.
namespace type_bits {
constexpr std::uint32_t bit(ElementType type) {
  return 1u << static_cast<std::uint32_t>(type);
}
constexpr std::uint32_t f64 = bit(ElementType::f64), f32 = bit(ElementType::f32), f16 = bit(ElementType::f16),
                        i32 = bit(ElementType::i32), u8 = bit(ElementType::u8), text = bit(ElementType::text);
}  // namespace type_bits
using namespace type_bits;

constexpr SectionDescription kSections[] = {
#define PALPATE_SECTION(identifier, id, path, types, rank, shape, unit, presence, meaning) \
  {SectionId::identifier, path, types, rank, #shape, unit, Presence::presence == Presence::always, meaning},
#include "formats/bundle_sections.def"
#undef PALPATE_SECTION
};
constexpr std::size_t kSectionKinds = sizeof kSections / sizeof *kSections;

// Every count is used as a 32-bit index by the bundle itself and by the runtime.
constexpr std::uint64_t kMaxCount = INT32_MAX;

#if defined(__GNUC__)
__attribute__((format(printf, 4, 5)))
#endif
BundleStatus
refuse(BundleError* error, BundleStatus status, std::uint64_t byte_offset, const char* format, ...) {
  if (error == nullptr) return status;
  error->status = status;
  error->byte_offset = byte_offset;
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(error->text, sizeof error->text, format, arguments);
  va_end(arguments);
  return status;
}

// offset and bytes come from the file: never add them before comparing.
bool range_is_inside(std::uint64_t offset, std::uint64_t bytes, std::uint64_t file_bytes) {
  return offset <= file_bytes && bytes <= file_bytes - offset;
}

bool multiply(std::uint64_t a, std::uint64_t b, std::uint64_t* product) {
  if (a != 0 && b > UINT64_MAX / a) return false;
  *product = a * b;
  return true;
}

std::uint64_t entry_offset(std::uint32_t position) {
  return sizeof(BundleHeader) + std::uint64_t{position} * sizeof(SectionEntry);
}

// ---- header ---------------------------------------------------------------------------------------------------------

BundleStatus check_magic(const unsigned char* head, std::uint64_t file_bytes, BundleError* error) {
  const std::size_t seen =
      file_bytes < sizeof kBundleMagic ? static_cast<std::size_t>(file_bytes) : sizeof kBundleMagic;
  if (seen > 0 && std::memcmp(head, kBundleMagic, seen) != 0) {
    constexpr unsigned char kHdf5[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    bool zero = true;
    for (std::size_t i = 0; i < seen; ++i) zero = zero && head[i] == 0;
    if (zero)
      return refuse(error, BundleStatus::magic, 0,
                    "expected \"PALPATE\" in the first 8 bytes, found zeros: the bundle was not finished; run "
                    "palpate-precompute again");
    if (std::memcmp(head, kHdf5, seen) == 0)
      return refuse(
          error, BundleStatus::magic, 0,
          "expected \"PALPATE\" in the first 8 bytes, found HDF5 without the index of a bundle; use the file that "
          "palpate-precompute wrote");
    return refuse(error, BundleStatus::magic, 0,
                  "expected \"PALPATE\" in the first 8 bytes, found something else: this is not a tensor bundle");
  }
  if (file_bytes < kUserBlockBytes)
    return refuse(error, BundleStatus::truncated, file_bytes,
                  "a bundle begins with an index of %" PRIu64 " bytes but only %" PRIu64 " are there; copy it again",
                  kUserBlockBytes, file_bytes);
  return BundleStatus::ok;
}

BundleStatus check_header(const unsigned char* head, std::uint64_t file_bytes, BundleHeader* header,
                          BundleError* error) {
  std::memcpy(header, head, sizeof *header);
  if (!reader_knows_layout(header->layout_version))
    return refuse(error, BundleStatus::version, offsetof(BundleHeader, layout_version),
                  "this reader knows the bundle layouts %" PRIu32 " and %" PRIu32 ", found %" PRIu32
                  "; use a matching version of Palpate",
                  kLayoutVersion, kNewestLayout, header->layout_version);
  if (header->section_count > kMaxSections)
    return refuse(error, BundleStatus::section, offsetof(BundleHeader, section_count),
                  "expected at most %" PRIu32 " sections, found %" PRIu32 "; copy the bundle again or rebuild it",
                  kMaxSections, header->section_count);

  // The checksum is compared first: no other number of the index is used before.
  Xxh64 checksum;
  BundleHeader blank = *header;
  blank.index_checksum = 0;
  checksum.update(&blank, sizeof blank);
  checksum.update(head + sizeof blank, header->section_count * sizeof(SectionEntry));
  if (checksum.digest() != header->index_checksum)
    return refuse(error, BundleStatus::checksum, offsetof(BundleHeader, index_checksum),
                  "the index has checksum %016" PRIx64 " but %016" PRIx64
                  " was written; copy the bundle again or rebuild it",
                  checksum.digest(), header->index_checksum);

  if (header->file_bytes != file_bytes)
    return refuse(error, BundleStatus::truncated, file_bytes,
                  "the bundle was written with %" PRIu64 " bytes but %" PRIu64 " are there; copy it again",
                  header->file_bytes, file_bytes);
  if (header->user_block_bytes != kUserBlockBytes)
    return refuse(error, BundleStatus::section, offsetof(BundleHeader, user_block_bytes),
                  "expected a user block of %" PRIu64 " bytes, found %" PRIu64 "; rebuild the bundle", kUserBlockBytes,
                  header->user_block_bytes);
  for (const std::uint64_t word : header->reserved)
    if (word != 0)
      return refuse(error, BundleStatus::section, offsetof(BundleHeader, reserved),
                    "expected zeros in the header's reserved bytes; rebuild the bundle");
  for (std::uint64_t at = entry_offset(header->section_count); at < kUserBlockBytes; ++at)
    if (head[at] != 0)
      return refuse(error, BundleStatus::section, at,
                    "expected zeros between the index and the first section; copy the bundle again or rebuild it");
  return BundleStatus::ok;
}

// ---- one entry ------------------------------------------------------------------------------------------------------

// Checks the range of the section's bytes, also for sections that this reader does not know.
BundleStatus check_range(const SectionEntry& entry, std::uint64_t at, std::uint64_t file_bytes, BundleError* error) {
  if (entry.bytes == 0)
    return refuse(error, BundleStatus::section, at + offsetof(SectionEntry, bytes),
                  "section %" PRIu32 " has no bytes; rebuild the bundle", entry.id);
  if (entry.offset < kUserBlockBytes || entry.offset % kSectionAlignment != 0)
    return refuse(error, BundleStatus::section, at + offsetof(SectionEntry, offset),
                  "section %" PRIu32 " begins at byte %" PRIu64 ", expected a multiple of %" PRIu64
                  " after the index; rebuild the bundle",
                  entry.id, entry.offset, kSectionAlignment);
  if (!range_is_inside(entry.offset, entry.bytes, file_bytes))
    return refuse(error, BundleStatus::section, at + offsetof(SectionEntry, offset),
                  "section %" PRIu32 " has %" PRIu64 " bytes at byte %" PRIu64 " but the bundle ends at byte %" PRIu64
                  "; copy it again or rebuild it",
                  entry.id, entry.bytes, entry.offset, file_bytes);
  return BundleStatus::ok;
}

// Checks type, rank, shape and length of a section that bundle_sections.def lists.
BundleStatus check_form(const SectionEntry& entry, const SectionDescription& section, std::uint64_t at,
                        BundleError* error) {
  if (!may_have(section, entry.type) || entry.rank != section.rank)
    return refuse(error, BundleStatus::section, at + offsetof(SectionEntry, type),
                  "%s: found element type %" PRIu32 " and rank %" PRIu32 ", expected rank %" PRIu32
                  " and a type that formats/BUNDLE.md lists; rebuild the bundle",
                  section.path, entry.type, entry.rank, section.rank);
  if (entry.reserved != 0)
    return refuse(error, BundleStatus::section, at + offsetof(SectionEntry, reserved),
                  "%s: expected 0 in the entry's reserved word, found %" PRIu32 "; rebuild the bundle", section.path,
                  entry.reserved);
  std::uint64_t product = element_bytes(static_cast<ElementType>(entry.type));
  bool fits = true;
  for (std::uint32_t d = 0; d < kMaxRank; ++d) {
    const bool in_range = entry.shape[d] >= 1 && entry.shape[d] <= kMaxCount;
    fits = fits && in_range && (d < entry.rank || entry.shape[d] == 1) && multiply(product, entry.shape[d], &product);
  }
  if (!fits || product != entry.bytes)
    return refuse(error, BundleStatus::section, at + offsetof(SectionEntry, shape),
                  "%s: %" PRIu64 " bytes do not hold the shape (%" PRIu64 ", %" PRIu64 ", %" PRIu64 ", %" PRIu64
                  "); rebuild the bundle",
                  section.path, entry.bytes, entry.shape[0], entry.shape[1], entry.shape[2], entry.shape[3]);
  return BundleStatus::ok;
}

bool overlap(const SectionEntry& a, const SectionEntry& b) {
  // Both ranges are inside the file, so the sums cannot overflow.
  return a.offset < b.offset + b.bytes && b.offset < a.offset + a.bytes;
}

BundleStatus check_pairs(const BundleIndex& index, std::uint32_t position, BundleError* error) {
  const SectionEntry& entry = index.entries[position];
  for (std::uint32_t other = 0; other < position; ++other) {
    if (index.entries[other].id == entry.id)
      return refuse(error, BundleStatus::section, entry_offset(position),
                    "section %" PRIu32 " is listed twice; rebuild the bundle", entry.id);
    if (overlap(index.entries[other], entry))
      return refuse(error, BundleStatus::section, entry_offset(position) + offsetof(SectionEntry, offset),
                    "sections %" PRIu32 " and %" PRIu32 " share bytes; rebuild the bundle", index.entries[other].id,
                    entry.id);
  }
  return BundleStatus::ok;
}

// ---- entries against one another ------------------------------------------------------------------------------------

// How many of the sections the bundle has.
std::uint32_t count_of(const BundleIndex& index, std::initializer_list<SectionId> ids) {
  std::uint32_t found = 0;
  for (const SectionId id : ids) found += find_section(index, id) != nullptr;
  return found;
}

BundleStatus check_presence(const BundleIndex& index, BundleError* error) {
  for (const SectionDescription& section : kSections)
    if (section.always && find_section(index, section.id) == nullptr)
      return refuse(error, BundleStatus::section, sizeof(BundleHeader), "section %s is missing; rebuild the bundle",
                    section.path);
  return BundleStatus::ok;
}

// A bundle has either the surface's displacements as rows, or all five sections of the compliance in blocks.
BundleStatus check_one_store(const BundleIndex& index, BundleError* error) {
  const std::uint32_t blocks =
      count_of(index, {SectionId::compliance_nodes, SectionId::compliance_clusters, SectionId::compliance_blocks,
                       SectionId::compliance_values, SectionId::compliance_scale});
  const bool rows = find_section(index, SectionId::displacement_surface) != nullptr;
  if (rows ? blocks != 0 : blocks != 5)
    return refuse(
        error, BundleStatus::section, sizeof(BundleHeader),
        "expected either tensors/displacement_surface or the five sections tensors/compliance/*, found %s and "
        "%" PRIu32 " of them; rebuild the bundle",
        rows ? "the first" : "not the first", blocks);
  return BundleStatus::ok;
}

BundleCounts take_counts(const BundleIndex& index) {
  // Every section named here is present: check_presence came first.
  const auto dimension = [&](SectionId id, int d) { return find_section(index, id)->shape[d]; };
  BundleCounts counts{};
  counts.nodes = dimension(SectionId::nodes, 0);
  counts.surface_nodes = find_section(index, SectionId::displacement_surface)
                             ? dimension(SectionId::displacement_surface, 2)
                             : dimension(SectionId::compliance_nodes, 0);
  counts.tetrahedra = dimension(SectionId::tetrahedra, 0);
  counts.triangles = dimension(SectionId::triangles, 0);
  counts.regions = dimension(SectionId::young, 0);
  counts.touchable = dimension(SectionId::touchable, 0);
  counts.motions = find_section(index, SectionId::motion_kinds) ? dimension(SectionId::motion_kinds, 0) : 0;
  counts.corridor = find_section(index, SectionId::corridor_nodes) ? dimension(SectionId::corridor_nodes, 0) : 0;
  counts.cut = find_section(index, SectionId::cut_nodes) ? dimension(SectionId::cut_nodes, 0) : 0;
  return counts;
}

// One symbol of a shape in bundle_sections.def, [begin, end): its value; 0 means any.
std::uint64_t symbol_value(const char* begin, const char* end, const BundleCounts& counts) {
  const struct {
    const char* name;
    std::uint64_t value;
  } symbols[] = {{"N", counts.nodes},
                 {"Ns", counts.surface_nodes},
                 {"N-Ns", counts.nodes - counts.surface_nodes},
                 {"E", counts.tetrahedra},
                 {"F", counts.triangles},
                 {"R", counts.regions},
                 {"S", counts.touchable},
                 {"M", counts.motions},
                 {"K", counts.corridor},
                 {"C", counts.cut},
                 {"*", 0}};
  const auto length = static_cast<std::size_t>(end - begin);
  for (const auto& symbol : symbols)
    if (std::strlen(symbol.name) == length && std::memcmp(symbol.name, begin, length) == 0) return symbol.value;
  std::uint64_t number = 0;
  for (; begin != end; ++begin) number = 10 * number + static_cast<std::uint64_t>(*begin - '0');
  return number;
}

// The next symbol of "(S, 3, Ns, 3)" at or after *cursor; false at the end.
bool next_symbol(const char** cursor, const char** begin, const char** end) {
  const auto separates = [](char c) { return c == '(' || c == ')' || c == ',' || c == ' '; };
  while (**cursor != '\0' && separates(**cursor)) ++*cursor;
  *begin = *cursor;
  while (**cursor != '\0' && !separates(**cursor)) ++*cursor;
  *end = *cursor;
  return *begin != *end;
}

BundleStatus check_shape(const BundleIndex& index, std::uint32_t position, BundleError* error) {
  const SectionEntry& entry = index.entries[position];
  const SectionDescription* section = describe_section(static_cast<SectionId>(entry.id));
  if (section == nullptr) return BundleStatus::ok;
  const char *cursor = section->shape, *begin = nullptr, *end = nullptr;
  for (std::uint32_t d = 0; d < entry.rank && next_symbol(&cursor, &begin, &end); ++d) {
    if (end - begin == 1 && *begin == '*') continue;
    const std::uint64_t expected = symbol_value(begin, end, index.counts);
    if (entry.shape[d] != expected)
      return refuse(error, BundleStatus::section, entry_offset(position) + offsetof(SectionEntry, shape) + 8 * d,
                    "%s: expected shape %s, where dimension %" PRIu32 " is %" PRIu64 ", found %" PRIu64
                    "; rebuild the bundle",
                    section->path, section->shape, d, expected, entry.shape[d]);
  }
  return BundleStatus::ok;
}

// f16 numbers need their scales.
BundleStatus check_scale(const BundleIndex& index, BundleError* error) {
  for (const SectionId id : {SectionId::displacement_surface, SectionId::displacement_interior}) {
    const SectionEntry* entry = find_section(index, id);
    if (entry && entry->type == static_cast<std::uint32_t>(ElementType::f16) &&
        !find_section(index, SectionId::displacement_scale))
      return refuse(error, BundleStatus::section, sizeof(BundleHeader),
                    "%s has element type f16, but section %s is missing; rebuild the bundle",
                    describe_section(id)->path, describe_section(SectionId::displacement_scale)->path);
  }
  return BundleStatus::ok;
}

BundleStatus check_block_count(const BundleIndex& index, BundleError* error) {
  const SectionEntry* blocks = find_section(index, SectionId::compliance_blocks);
  if (!blocks || blocks->shape[0] == find_section(index, SectionId::compliance_scale)->shape[0])
    return BundleStatus::ok;
  return refuse(error, BundleStatus::section, sizeof(BundleHeader),
                "tensors/compliance/blocks lists %" PRIu64 " blocks, tensors/compliance/scale %" PRIu64
                "; rebuild the bundle",
                blocks->shape[0], find_section(index, SectionId::compliance_scale)->shape[0]);
}

// Motions have all their sections but those of the interior and of pressures, or none of them.
BundleStatus check_motions(const BundleIndex& index, BundleError* error) {
  const std::uint32_t found = count_of(
      index, {SectionId::motion_names, SectionId::motion_kinds, SectionId::motion_surface, SectionId::motion_residual});
  const bool more = find_section(index, SectionId::motion_interior) || find_section(index, SectionId::motion_volume) ||
                    find_section(index, SectionId::motion_pressed);
  if (found != (more || found > 0 ? 4u : 0u))
    return refuse(error, BundleStatus::section, sizeof(BundleHeader),
                  "expected motion/names, kinds, displacement_surface and residual together, found %" PRIu32
                  " of them; rebuild the bundle",
                  found);
  if (index.counts.motions > static_cast<std::uint64_t>(kMostMotions))
    return refuse(error, BundleStatus::section, sizeof(BundleHeader),
                  "expected at most %" PRId32 " motions, found %" PRIu64 "; rebuild the bundle", kMostMotions,
                  index.counts.motions);
  return BundleStatus::ok;
}

// Corridors have all their sections but that of the interior, or none of them.
BundleStatus check_corridor(const BundleIndex& index, BundleError* error) {
  const std::uint32_t found = count_of(index, {SectionId::corridor_nodes, SectionId::corridor_compliance,
                                               SectionId::corridor_surface, SectionId::corridor_residual});
  const bool more = find_section(index, SectionId::corridor_interior) != nullptr;
  if (found != (more || found > 0 ? 4u : 0u))
    return refuse(error, BundleStatus::section, sizeof(BundleHeader),
                  "expected corridor/nodes, compliance, displacement_surface and residual together, found %" PRIu32
                  " of them; rebuild the bundle",
                  found);
  const std::uint64_t inside = index.counts.nodes - index.counts.surface_nodes;
  const std::uint64_t limit = kMostCorridorNodes + index.counts.cut, most = inside < limit ? inside : limit;
  if (index.counts.corridor > most)
    return refuse(error, BundleStatus::section, sizeof(BundleHeader),
                  "expected at most %" PRIu64 " corridor nodes, found %" PRIu64 "; rebuild the bundle", most,
                  index.counts.corridor);
  return BundleStatus::ok;
}

// The region of a cut has all its sections or none of them, and a block for each pair of its nodes.
BundleStatus check_cut(const BundleIndex& index, BundleError* error) {
  const std::uint32_t found = count_of(
      index, {SectionId::cut_nodes, SectionId::cut_compliance, SectionId::cut_residual, SectionId::cut_reserve});
  if (found == 0) return BundleStatus::ok;
  if (found != 4)
    return refuse(error, BundleStatus::section, sizeof(BundleHeader),
                  "expected cut/nodes, compliance, residual and reserve together, found %" PRIu32
                  " of them; rebuild the bundle",
                  found);
  const std::uint64_t count = index.counts.cut,
                      most = index.counts.nodes < kMostCutNodes ? index.counts.nodes : kMostCutNodes;
  if (count > most)
    return refuse(error, BundleStatus::section, sizeof(BundleHeader),
                  "expected at most %" PRIu64 " nodes in the region of the cut, found %" PRIu64 "; rebuild the bundle",
                  most, count);
  const std::uint64_t pairs = count * (count + 1) / 2,
                      stored = find_section(index, SectionId::cut_compliance)->shape[0];
  if (stored != pairs)
    return refuse(error, BundleStatus::section, sizeof(BundleHeader),
                  "cut/compliance: expected %" PRIu64 " pairs of %" PRIu64 " nodes, found %" PRIu64
                  "; rebuild the bundle",
                  pairs, count, stored);
  return BundleStatus::ok;
}

BundleStatus check_counts(const BundleIndex& index, BundleError* error) {
  const BundleCounts& counts = index.counts;
  if (counts.surface_nodes > counts.nodes || counts.touchable > counts.surface_nodes)
    return refuse(error, BundleStatus::section, sizeof(BundleHeader),
                  "expected touchable nodes <= surface nodes <= nodes, found %" PRIu64 ", %" PRIu64 " and %" PRIu64
                  "; rebuild the bundle",
                  counts.touchable, counts.surface_nodes, counts.nodes);
  return BundleStatus::ok;
}

// ---- integers that are used as indices ------------------------------------------------------------------------------

std::uint64_t stored_at(const BundleIndex& index, SectionId id, std::uint64_t element) {
  const SectionEntry* entry = find_section(index, id);
  return entry->offset + element * element_bytes(static_cast<ElementType>(entry->type));
}

// Node, region and other indices: least <= value < limit.
struct StoredIndices {
  SectionId id;
  const std::int32_t* values;  // nullptr: not checked
  std::uint64_t count, limit;
  std::uint64_t least = 0;
  bool ascending = false;
};
BundleStatus check_range_of(const BundleIndex& index, const StoredIndices& s, BundleError* error) {
  for (std::uint64_t i = 0; s.values && i < s.count; ++i) {
    const std::int32_t value = s.values[i];
    if (value < 0 || static_cast<std::uint64_t>(value) < s.least || static_cast<std::uint64_t>(value) >= s.limit)
      return refuse(error, BundleStatus::content, stored_at(index, s.id, i),
                    "%s: expected indices from %" PRIu64 " to %" PRIu64 ", element %" PRIu64 " is %" PRId32
                    "; copy the bundle again or rebuild it",
                    describe_section(s.id)->path, s.least, s.limit - 1, i, value);
    if (s.ascending && i > 0 && value <= s.values[i - 1])
      return refuse(error, BundleStatus::content, stored_at(index, s.id, i),
                    "%s: expected ascending node indices, element %" PRIu64 " is %" PRId32 " after %" PRId32
                    "; copy the bundle again or rebuild it",
                    describe_section(s.id)->path, i, value, s.values[i - 1]);
  }
  return BundleStatus::ok;
}

BundleStatus check_zero_or_one(const BundleIndex& index, SectionId id, const std::uint8_t* values, std::uint64_t count,
                               BundleError* error) {
  for (std::uint64_t i = 0; i < count; ++i)
    if (values[i] > 1)
      return refuse(error, BundleStatus::content, stored_at(index, id, i),
                    "%s: expected 0 or 1, element %" PRIu64 " is %u; copy the bundle again or rebuild it",
                    describe_section(id)->path, i, static_cast<unsigned>(values[i]));
  return BundleStatus::ok;
}

BundleStatus check_kinds(const BundleIndex& index, const std::int32_t* values, BundleError* error) {
  constexpr auto least = static_cast<std::int32_t>(MotionKind::piston),
                 most = static_cast<std::int32_t>(MotionKind::gravity);
  for (std::uint64_t i = 0; i < index.counts.motions; ++i)
    if (values[i] < least || values[i] > most)
      return refuse(error, BundleStatus::content, stored_at(index, SectionId::motion_kinds, i),
                    "motion/kinds: expected %" PRId32 " to %" PRId32 ", element %" PRIu64 " is %" PRId32
                    "; copy the bundle again or rebuild it",
                    least, most, i, values[i]);
  return BundleStatus::ok;
}

// Below 2^100, so that no product with a displacement overflows.
BundleStatus check_scales(const BundleIndex& index, SectionId id, const float* values, std::uint64_t count,
                          BundleError* error) {
  for (std::uint64_t i = 0; i < count; ++i)
    if (!(values[i] > 0 && values[i] < 0x1p100f))
      return refuse(error, BundleStatus::content, stored_at(index, id, i),
                    "%s: expected scales above 0, element %" PRIu64 " is %g; copy the bundle again or rebuild it",
                    describe_section(id)->path, i, static_cast<double>(values[i]));
  return BundleStatus::ok;
}

// The clusters are runs of places that cover 0 .. Ns - 1. No cluster holds both touchable and other places.
BundleStatus check_clusters(const BundleIndex& index, const std::int32_t* ends, BundleError* error) {
  constexpr SectionId id = SectionId::compliance_clusters;
  const std::uint64_t count = find_section(index, id)->shape[0];
  std::int64_t previous = 0;
  bool parted = false;
  if (count > kMaxClusters)
    return refuse(error, BundleStatus::content, stored_at(index, id, 0),
                  "%s: expected at most %" PRIu64 " clusters, found %" PRIu64 "; rebuild the bundle",
                  describe_section(id)->path, kMaxClusters, count);
  for (std::uint64_t i = 0; i < count; ++i) {
    if (ends[i] <= previous || static_cast<std::uint64_t>(ends[i]) > index.counts.surface_nodes)
      return refuse(error, BundleStatus::content, stored_at(index, id, i),
                    "%s: expected ascending ends up to %" PRIu64 ", element %" PRIu64 " is %" PRId32
                    "; copy the bundle again or rebuild it",
                    describe_section(id)->path, index.counts.surface_nodes, i, ends[i]);
    parted = parted || static_cast<std::uint64_t>(ends[i]) == index.counts.touchable;
    previous = ends[i];
  }
  if (!parted || static_cast<std::uint64_t>(previous) != index.counts.surface_nodes)
    return refuse(error, BundleStatus::content, stored_at(index, id, count - 1),
                  "%s: expected one cluster to end at %" PRIu64 " and the last at %" PRIu64 "; rebuild the bundle",
                  describe_section(id)->path, index.counts.touchable, index.counts.surface_nodes);
  return BundleStatus::ok;
}

// Checks of each block that its clusters exist, that its rank is possible, that its numbers are inside the values, and that
// either all of its rows are touchable or none.
BundleStatus check_blocks(const BundleIndex& index, const std::int32_t* ends, const std::int32_t* stored,
                          BundleError* error) {
  constexpr SectionId id = SectionId::compliance_blocks;
  const auto clusters = static_cast<std::int32_t>(find_section(index, SectionId::compliance_clusters)->shape[0]);
  std::int32_t touchable = 0;
  while (static_cast<std::uint64_t>(cluster_begin(ends, touchable)) < index.counts.touchable) ++touchable;
  const std::uint64_t count = find_section(index, id)->shape[0],
                      values = find_section(index, SectionId::compliance_values)->shape[0];
  std::uint64_t used = 0;
  for (std::uint64_t b = 0; b < count; ++b) {
    StoredBlock s;
    std::memcpy(&s, stored + 5 * b, sizeof s);
    const bool in_range = 0 <= s.row_begin && s.row_begin < s.row_end && s.row_end <= clusters && 0 <= s.column_begin &&
                          s.column_begin < s.column_end && s.column_end <= touchable &&
                          (s.row_end <= touchable || s.row_begin >= touchable) && s.rank >= 0;
    bool fits = in_range;
    if (in_range) {
      // Divided, not multiplied: rows, columns and rank come from the file.
      const ComplianceBlock block = placed_block(s, ends, used, 1);
      const auto rows = static_cast<std::uint64_t>(block.rows), columns = static_cast<std::uint64_t>(block.columns);
      const auto rank = static_cast<std::uint64_t>(block.rank);
      fits = rank == 0
                 ? rows * columns <= (values - used) / 9
                 : rank <= 3 * (rows < columns ? rows : columns) && rank <= (values - used) / (3 * (rows + columns));
      if (fits) used += block.numbers();
    }
    if (!fits)
      return refuse(error, BundleStatus::content, stored_at(index, id, 5 * b),
                    "%s: block %" PRIu64 " (%" PRId32 " %" PRId32 " %" PRId32 " %" PRId32 " %" PRId32
                    ") does not fit the clusters and the values; copy the bundle again or rebuild it",
                    describe_section(id)->path, b, s.row_begin, s.row_end, s.column_begin, s.column_end, s.rank);
  }
  if (used == values) return BundleStatus::ok;
  return refuse(error, BundleStatus::content, stored_at(index, id, 0),
                "tensors/compliance/values has %" PRIu64 " numbers where the blocks take %" PRIu64
                "; copy the bundle again or rebuild it",
                values, used);
}

}  // namespace

BundleStatus read_bundle_index(const void* head, std::uint64_t file_bytes, BundleIndex* index, BundleError* error) {
  const auto* bytes = static_cast<const unsigned char*>(head);
  BundleStatus status = check_magic(bytes, file_bytes, error);
  if (status == BundleStatus::ok) status = check_header(bytes, file_bytes, &index->header, error);
  if (status != BundleStatus::ok) return status;

  // Checks a copy: another process may change the bytes afterwards.
  std::memcpy(index->entries, bytes + sizeof(BundleHeader), index->header.section_count * sizeof(SectionEntry));
  for (std::uint32_t i = 0; i < index->header.section_count; ++i) {
    const SectionEntry& entry = index->entries[i];
    const SectionDescription* section = describe_section(static_cast<SectionId>(entry.id));
    status = check_range(entry, entry_offset(i), file_bytes, error);
    if (status == BundleStatus::ok && section) status = check_form(entry, *section, entry_offset(i), error);
    if (status == BundleStatus::ok) status = check_pairs(*index, i, error);
    if (status != BundleStatus::ok) return status;
  }

  status = check_presence(*index, error);
  if (status == BundleStatus::ok) status = check_one_store(*index, error);
  if (status != BundleStatus::ok) return status;
  index->counts = take_counts(*index);
  for (const auto check : {check_counts, check_scale, check_block_count, check_motions, check_cut, check_corridor})
    if (status == BundleStatus::ok) status = check(*index, error);
  for (std::uint32_t i = 0; i < index->header.section_count && status == BundleStatus::ok; ++i)
    status = check_shape(*index, i, error);
  if (status == BundleStatus::ok && error) *error = BundleError{};
  return status;
}

const SectionEntry* find_section(const BundleIndex& index, SectionId id) {
  for (std::uint32_t i = 0; i < index.header.section_count; ++i)
    if (index.entries[i].id == static_cast<std::uint32_t>(id)) return &index.entries[i];
  return nullptr;
}

BundleStatus check_stored_indices(const BundleIndex& index, const IndexedSections& sections, BundleError* error) {
  const BundleCounts& n = index.counts;
  BundleStatus status = BundleStatus::ok;
  const auto ok = [&] { return status == BundleStatus::ok; };
  const auto rows = [&](SectionId id) {
    const SectionEntry* entry = find_section(index, id);
    return entry ? entry->shape[0] : 0;
  };
  using Id = SectionId;
  const StoredIndices indices[] = {
      {Id::tetrahedra, sections.tetrahedra, 4 * n.tetrahedra, n.nodes},
      {Id::region, sections.region, n.tetrahedra, n.regions},
      {Id::triangles, sections.triangles, 3 * n.triangles, n.surface_nodes},
      {Id::touchable, sections.touchable, n.touchable, n.surface_nodes, 0, true},
      {Id::compliance_nodes, sections.compliance_nodes, n.surface_nodes, n.surface_nodes},
      {Id::large_order, sections.large_order, rows(Id::large_order), n.nodes},
      {Id::large_support_nodes, sections.large_support_nodes, 2 * rows(Id::large_support_nodes), n.nodes},
      {Id::corridor_nodes, sections.corridor_nodes, n.corridor, n.nodes, n.surface_nodes, true},
      {Id::cut_nodes, sections.cut_nodes, n.cut, n.nodes, 0, true},
  };
  for (const StoredIndices& one : indices)
    if (ok()) status = check_range_of(index, one, error);
  if (ok() && sections.fixed) status = check_zero_or_one(index, SectionId::fixed, sections.fixed, 3 * n.nodes, error);
  if (ok() && sections.displacement_scale)
    status = check_scales(index, SectionId::displacement_scale, sections.displacement_scale, 3 * n.touchable, error);
  if (ok() && sections.compliance_clusters) status = check_clusters(index, sections.compliance_clusters, error);
  if (ok() && sections.compliance_clusters && sections.compliance_blocks)
    status = check_blocks(index, sections.compliance_clusters, sections.compliance_blocks, error);
  if (ok() && sections.compliance_scale)
    status =
        check_scales(index, SectionId::compliance_scale, sections.compliance_scale, rows(Id::compliance_scale), error);
  if (ok() && sections.motion_kinds) status = check_kinds(index, sections.motion_kinds, error);
  if (ok() && sections.motion_pressed)
    status =
        check_zero_or_one(index, SectionId::motion_pressed, sections.motion_pressed, n.motions * n.triangles, error);
  if (ok() && error) *error = BundleError{};
  return status;
}

const SectionDescription* describe_section(SectionId id) {
  for (const SectionDescription& section : kSections)
    if (section.id == id) return &section;
  return nullptr;
}

const SectionDescription* section_descriptions(std::size_t* count) {
  *count = kSectionKinds;
  return kSections;
}

}  // namespace palpate::formats
