#include "runtime/bundle/bundle.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <new>
#include <type_traits>

#include "formats/checksum.h"
#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"

namespace palpate {
namespace {

using formats::SectionEntry;
using formats::SectionId;

// The host's functions or malloc instead of new, so that a C host needs no C++ runtime library.
palpate_bundle* make_bundle(const palpate_allocator& host) {
  constexpr std::size_t bytes = sizeof(palpate_bundle), alignment = alignof(palpate_bundle);
  static_assert(alignment <= alignof(std::max_align_t));
  void* memory = host.allocate ? host.allocate(host.user, bytes, alignment) : std::malloc(bytes);
  return memory ? new (memory) palpate_bundle(host) : nullptr;
}
void free_bundle(palpate_bundle* bundle) {
  const palpate_allocator host = bundle->allocator;
  bundle->~palpate_bundle();
  if (host.allocate)
    host.release(host.user, bundle);
  else
    std::free(bundle);
}

// options: NULL for the defaults.
palpate_status read_options(const palpate_bundle_options* options, palpate_bundle_options* out, palpate_error* error) {
  *out = palpate_default_bundle_options();
  if (!options) return PALPATE_OK;
  if (const palpate_status status = read_host_struct("bundle_options", options, out, error)) return status;
  if ((out->allocator.allocate == nullptr) == (out->allocator.release == nullptr)) return PALPATE_OK;
  return fail(error, PALPATE_ERROR_ARGUMENT, 0,
              "palpate_bundle_options: the allocator needs both allocate and release, or neither");
}

// Maps one section for the duration of a check.
class SectionLook {
 public:
  SectionLook(palpate_bundle& bundle, const SectionEntry* entry) {
    if (!entry) return;
    if (bundle.bytes)
      data_ = bundle.bytes + entry->offset;
    else if (map_range(bundle.descriptor, entry->offset, entry->bytes, &bundle.lost, &map_))
      data_ = map_.data;
  }
  ~SectionLook() { unmap(&map_); }
  SectionLook(const SectionLook&) = delete;
  SectionLook& operator=(const SectionLook&) = delete;
  const unsigned char* data() const { return data_; }

 private:
  FileMap map_;
  const unsigned char* data_ = nullptr;
};

palpate_status file_was_cut(palpate_error* error) {
  return fail(
      error, PALPATE_ERROR_TRUNCATED, 0,
      "the bundle's file became shorter or was written over after it was opened; wait until it is complete and open "
      "it again");
}

// Checks every integer that is used as an index, one section after the other; none stays mapped.
palpate_status check_indices(palpate_bundle& bundle, palpate_error* error) {
  const auto check = [&](SectionId id, auto member) {
    const SectionEntry* entry = formats::find_section(bundle.index, id);
    if (!entry || entry->bytes == 0) return PALPATE_OK;
    const SectionLook look(bundle, entry);
    if (!look.data()) return fail(error, PALPATE_ERROR_FILE, entry->offset, "a section of the bundle cannot be mapped");
    formats::IndexedSections sections;
    using Member = std::remove_reference_t<decltype(sections.*member)>;
    sections.*member = reinterpret_cast<Member>(look.data());
    formats::BundleError from;
    const formats::BundleStatus status = formats::check_stored_indices(bundle.index, sections, &from);
    if (bundle.is_lost()) return file_was_cut(error);
    return status == formats::BundleStatus::ok ? PALPATE_OK : fail(error, from);
  };
  using Sections = formats::IndexedSections;
  palpate_status status = check(SectionId::tetrahedra, &Sections::tetrahedra);
  if (status == PALPATE_OK) status = check(SectionId::region, &Sections::region);
  if (status == PALPATE_OK) status = check(SectionId::triangles, &Sections::triangles);
  if (status == PALPATE_OK) status = check(SectionId::touchable, &Sections::touchable);
  if (status == PALPATE_OK) status = check(SectionId::fixed, &Sections::fixed);
  if (status == PALPATE_OK) status = check(SectionId::displacement_scale, &Sections::displacement_scale);
  return status;
}

// The table of blocks refers to the table of clusters, so both are checked together.
palpate_status check_compliance(palpate_bundle& bundle, palpate_error* error) {
  const auto entry = [&](SectionId id) { return formats::find_section(bundle.index, id); };
  if (!entry(SectionId::compliance_values)) return PALPATE_OK;
  const SectionLook nodes(bundle, entry(SectionId::compliance_nodes)),
      clusters(bundle, entry(SectionId::compliance_clusters)), blocks(bundle, entry(SectionId::compliance_blocks)),
      scale(bundle, entry(SectionId::compliance_scale));
  if (!nodes.data() || !clusters.data() || !blocks.data() || !scale.data())
    return fail(error, PALPATE_ERROR_FILE, entry(SectionId::compliance_nodes)->offset,
                "a section of the bundle cannot be mapped");
  formats::IndexedSections sections;
  sections.compliance_nodes = reinterpret_cast<const std::int32_t*>(nodes.data());
  sections.compliance_clusters = reinterpret_cast<const std::int32_t*>(clusters.data());
  sections.compliance_blocks = reinterpret_cast<const std::int32_t*>(blocks.data());
  sections.compliance_scale = reinterpret_cast<const float*>(scale.data());
  formats::BundleError from;
  const formats::BundleStatus status = formats::check_stored_indices(bundle.index, sections, &from);
  if (bundle.is_lost()) return file_was_cut(error);
  return status == formats::BundleStatus::ok ? PALPATE_OK : fail(error, from);
}

// palpate_bundle_info gives counts as int32_t.
palpate_status check_counts(const palpate_bundle& bundle, palpate_error* error) {
  const formats::BundleCounts& counts = bundle.index.counts;
  constexpr std::uint64_t most = 0x7fffffff / 4;
  if (counts.nodes <= most && counts.tetrahedra <= most && counts.triangles <= most && counts.touchable <= most)
    return PALPATE_OK;
  return fail(error, PALPATE_ERROR_SECTION, 0, "the bundle has more nodes, tetrahedra, triangles or columns than %llu",
              static_cast<unsigned long long>(most));
}

palpate_status finish_open(palpate_bundle* opened, palpate_bundle** bundle, palpate_error* error) {
  palpate_status status = check_counts(*opened, error);
  if (status == PALPATE_OK) status = check_indices(*opened, error);
  if (status == PALPATE_OK) status = check_compliance(*opened, error);
  if (status != PALPATE_OK) {
    palpate_bundle_close(opened);
    return status;
  }
  *bundle = opened;
  return succeed(error);
}

struct MapLock {
  explicit MapLock(palpate_bundle* bundle) : flag(bundle->mapping) {
    while (flag.test_and_set(std::memory_order_acquire)) {
    }
  }
  ~MapLock() { flag.clear(std::memory_order_release); }
  std::atomic_flag& flag;
};

}  // namespace

const void* section_bytes(palpate_bundle* bundle, SectionId id, palpate_error* error) {
  const SectionEntry* entry = formats::find_section(bundle->index, id);
  if (!entry) return nullptr;
  if (bundle->bytes) return bundle->bytes + entry->offset;
  static const double nothing[1] = {};
  if (entry->bytes == 0) return nothing;
  const MapLock lock(bundle);
  FileMap& map = bundle->maps[entry - bundle->index.entries];
  if (!map.data && !map_range(bundle->descriptor, entry->offset, entry->bytes, &bundle->lost, &map)) {
    fail(error, PALPATE_ERROR_FILE, entry->offset,
         "section %s of %llu bytes cannot be mapped; close other bundles or raise the limit on address space",
         formats::describe_section(id)->path, static_cast<unsigned long long>(entry->bytes));
    return nullptr;
  }
  return map.data;
}

}  // namespace palpate

using palpate::fail;
namespace formats = palpate::formats;

palpate_status palpate_bundle_open(const void* bytes, size_t byte_count, const palpate_bundle_options* options,
                                   palpate_bundle** bundle, palpate_error* error) {
  if (bundle) *bundle = nullptr;
  if (!bundle || !bytes) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "bytes and bundle must not be NULL");
  if (reinterpret_cast<std::uintptr_t>(bytes) % 64 != 0)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "the bundle's bytes must start at a multiple of 64; copy them to such an address");
  palpate_bundle_options wanted;
  if (const palpate_status status = palpate::read_options(options, &wanted, error)) return status;
  palpate_bundle* opened = palpate::make_bundle(wanted.allocator);
  if (!opened) return fail(error, PALPATE_ERROR_MEMORY, 0, "no memory for the bundle's index");
  formats::BundleError from;
  if (formats::read_bundle_index(bytes, byte_count, &opened->index, &from) != formats::BundleStatus::ok) {
    palpate::free_bundle(opened);
    return fail(error, from);
  }
  opened->bytes = static_cast<const unsigned char*>(bytes);
  return palpate::finish_open(opened, bundle, error);
}

palpate_status palpate_bundle_open_file(const char* path, const palpate_bundle_options* options,
                                        palpate_bundle** bundle, palpate_error* error) {
  if (bundle) *bundle = nullptr;
  if (!bundle || !path) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "path and bundle must not be NULL");
  palpate_bundle_options wanted;
  if (const palpate_status status = palpate::read_options(options, &wanted, error)) return status;
  std::uint64_t file_bytes = 0;
  const char* reason = "";
  const int descriptor = palpate::open_for_map(path, &file_bytes, &reason);
  if (descriptor < 0) return fail(error, PALPATE_ERROR_FILE, 0, "\"%.150s\" cannot be opened: %s", path, reason);
  palpate_bundle* opened = palpate::make_bundle(wanted.allocator);
  if (!opened) {
    palpate::close_file(descriptor);
    return fail(error, PALPATE_ERROR_MEMORY, 0, "no memory for the bundle's index");
  }
  opened->descriptor = descriptor;
  alignas(64) unsigned char head[formats::kUserBlockBytes] = {};
  const std::uint64_t head_bytes = file_bytes < sizeof head ? file_bytes : sizeof head;
  if (!palpate::read_head(descriptor, head, static_cast<std::size_t>(head_bytes))) {
    palpate_bundle_close(opened);
    return fail(error, PALPATE_ERROR_FILE, 0, "\"%.150s\" cannot be read", path);
  }
  formats::BundleError from;
  if (formats::read_bundle_index(head, file_bytes, &opened->index, &from) != formats::BundleStatus::ok) {
    palpate_bundle_close(opened);
    return fail(error, from);
  }
  if (!opened->witness.call(descriptor, file_bytes, offsetof(formats::BundleHeader, index_checksum),
                            opened->index.header.index_checksum, &opened->lost)) {
    palpate_bundle_close(opened);
    return fail(error, PALPATE_ERROR_FILE, 0, "\"%.150s\" cannot be mapped; close other bundles", path);
  }
  return palpate::finish_open(opened, bundle, error);
}

palpate_status palpate_bundle_check(const palpate_bundle* bundle, palpate_error* error) {
  if (!bundle) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "bundle must not be NULL");
  palpate_bundle& opened = *const_cast<palpate_bundle*>(bundle);  // the check may only set its `lost` flag
  for (std::uint32_t e = 0; e < opened.index.header.section_count; ++e) {
    const formats::SectionEntry& entry = opened.index.entries[e];
    std::uint64_t sum = formats::xxh64("", 0);
    if (entry.bytes > 0) {
      const palpate::SectionLook look(opened, &entry);
      if (!look.data())
        return fail(error, PALPATE_ERROR_FILE, entry.offset, "a section of the bundle cannot be mapped");
      sum = formats::xxh64(look.data(), static_cast<std::size_t>(entry.bytes));
    }
    if (opened.is_lost()) return palpate::file_was_cut(error);
    if (sum == entry.checksum) continue;
    const formats::SectionDescription* known = formats::describe_section(static_cast<formats::SectionId>(entry.id));
    return fail(error, PALPATE_ERROR_CHECKSUM, entry.offset,
                "section %s has checksum %016llx where %016llx was written; copy the bundle again or rebuild it",
                known ? known->path : "?", static_cast<unsigned long long>(sum),
                static_cast<unsigned long long>(entry.checksum));
  }
  return palpate::succeed(error);
}

palpate_status palpate_bundle_prefault(palpate_bundle* bundle, int32_t lock, palpate_error* error) {
  if (!bundle) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "bundle must not be NULL");
  std::uint64_t limit = 0, refused = 0;
  const auto bring_in = [&](const palpate::FileMap& map) {
    if (!map.data) return;
    palpate::read_pages(map);
    if (lock && !palpate::lock_pages(map, &limit)) refused += map.bytes;
  };
  for (const palpate::FileMap& map : bundle->maps) {
    palpate::FileMap mapped;
    {
      const palpate::MapLock own(bundle);
      mapped = map;
    }
    bring_in(mapped);
  }
  bring_in(bundle->witness.stamp_map());
  bring_in(bundle->witness.last_map());
  if (bundle->is_lost()) return palpate::file_was_cut(error);
  if (refused == 0) return palpate::succeed(error);
  return fail(error, PALPATE_ERROR_LOCK, 0,
              "%llu bytes of the bundle were read but not locked: this process may lock %llu bytes; raise %s, or "
              "expect a page to be "
              "taken back when memory is short",
              static_cast<unsigned long long>(refused), static_cast<unsigned long long>(limit), palpate::kLockLimit);
}

void palpate_bundle_close(palpate_bundle* bundle) {
  if (!bundle) return;
  for (palpate::FileMap& map : bundle->maps) palpate::unmap(&map);
  bundle->witness.dismiss();
  if (bundle->descriptor >= 0) palpate::close_file(bundle->descriptor);
  palpate::free_bundle(bundle);
}

static palpate_bundle_info describe(const palpate_bundle* bundle) {
  palpate_bundle_info info = {};
  if (!bundle) return info;
  using formats::SectionId;
  const formats::BundleCounts& counts = bundle->index.counts;
  info.identity = bundle->index.header.index_checksum;
  info.node_count = static_cast<int32_t>(counts.nodes);
  info.surface_node_count = static_cast<int32_t>(counts.surface_nodes);
  info.triangle_count = static_cast<int32_t>(counts.triangles);
  info.tetrahedron_count = static_cast<int32_t>(counts.tetrahedra);
  info.touchable_count = static_cast<int32_t>(counts.touchable);
  const auto has = [&](SectionId id) { return formats::find_section(bundle->index, id) != nullptr; };
  info.has_interior = has(SectionId::displacement_interior) || counts.nodes == counts.surface_nodes;
  info.has_preload = has(SectionId::preload_displacement);
  // A curve that was not measured has the range 0.
  double range[2] = {};
  if (const formats::SectionEntry* entry = formats::find_section(bundle->index, SectionId::response_range)) {
    const palpate::SectionLook look(*const_cast<palpate_bundle*>(bundle), entry);
    if (look.data()) std::memcpy(range, look.data(), sizeof range);
  }
  info.has_radial = has(SectionId::response_radial) && range[0] > 0;
  info.has_force = has(SectionId::response_force) && range[1] > 0;
  return info;
}

void palpate_bundle_fill_info(const palpate_bundle* bundle, palpate_bundle_info* info, size_t struct_bytes) {
  if (!info) return;
  const palpate_bundle_info found = describe(bundle);
  std::memset(static_cast<void*>(info), 0, struct_bytes);
  std::memcpy(static_cast<void*>(info), &found, std::min(struct_bytes, sizeof found));
}

static const void* view(const palpate_bundle* bundle, formats::SectionId id) {
  palpate_error ignored;
  return bundle ? palpate::section_bytes(const_cast<palpate_bundle*>(bundle), id, &ignored) : nullptr;
}

const double* palpate_bundle_nodes(const palpate_bundle* bundle) {
  return static_cast<const double*>(view(bundle, formats::SectionId::nodes));
}
const int32_t* palpate_bundle_triangles(const palpate_bundle* bundle) {
  return static_cast<const int32_t*>(view(bundle, formats::SectionId::triangles));
}
const int32_t* palpate_bundle_tetrahedra(const palpate_bundle* bundle) {
  return static_cast<const int32_t*>(view(bundle, formats::SectionId::tetrahedra));
}
const int32_t* palpate_bundle_touchable(const palpate_bundle* bundle) {
  return static_cast<const int32_t*>(view(bundle, formats::SectionId::touchable));
}
const uint8_t* palpate_bundle_fixed(const palpate_bundle* bundle) {
  return static_cast<const uint8_t*>(view(bundle, formats::SectionId::fixed));
}
const char* palpate_bundle_provenance(const palpate_bundle* bundle, size_t* byte_count) {
  const auto* entry = bundle ? formats::find_section(bundle->index, formats::SectionId::provenance) : nullptr;
  if (byte_count) *byte_count = entry ? static_cast<size_t>(entry->bytes) : 0;
  return static_cast<const char*>(view(bundle, formats::SectionId::provenance));
}
