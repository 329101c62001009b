#include "runtime/bundle/bundle.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <new>
#include <type_traits>

#include "formats/checksum.h"
#include "formats/response_check.h"
#include "runtime/base/aligned_memory.h"
#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"

namespace palpate {
namespace {

using formats::SectionEntry;
using formats::SectionId;

// Memory of the host's functions or of the C library, aligned to 64 bytes. Not new: a C host needs no C++ runtime library.
void* take_memory(const palpate_allocator& host, std::size_t bytes) {
  if (bytes > static_cast<std::size_t>(-1) - 63) return nullptr;
  const std::size_t whole = (bytes + 63) / 64 * 64;
  return host.allocate ? host.allocate(host.user, whole, 64) : take_aligned(whole);
}
void release_memory(const palpate_allocator& host, void* memory) {
  if (host.allocate)
    host.release(host.user, memory);
  else
    release_aligned(memory);
}

palpate_bundle* make_bundle(const palpate_bundle_options& options) {
  static_assert(alignof(palpate_bundle) <= 64);
  void* memory = take_memory(options.allocator, sizeof(palpate_bundle));
  return memory ? new (memory) palpate_bundle(options) : nullptr;
}
void free_bundle(palpate_bundle* bundle) {
  const palpate_allocator host = bundle->allocator;
  bundle->~palpate_bundle();
  release_memory(host, bundle);
}

// options: NULL for the defaults.
palpate_status read_options(const palpate_bundle_options* options, palpate_bundle_options* out, palpate_error* error) {
  *out = palpate_default_bundle_options();
  if (!options) return PALPATE_OK;
  if (const palpate_status status = read_host_struct("bundle_options", options, out, error)) return status;
  if (const int access = enum_number(out->file_access); access < PALPATE_FILE_MAP || access > PALPATE_FILE_COPY)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_bundle_options: file_access is %d, which palpate.h does not list; expected PALPATE_FILE_MAP, "
                "PALPATE_FILE_MAP_GUARDED or PALPATE_FILE_COPY",
                access);
  if ((out->allocator.allocate == nullptr) == (out->allocator.release == nullptr)) return PALPATE_OK;
  return fail(error, PALPATE_ERROR_ARGUMENT, 0,
              "palpate_bundle_options: the allocator needs both allocate and release, or neither");
}

palpate_status file_was_cut(palpate_error* error) {
  return fail(
      error, PALPATE_ERROR_TRUNCATED, 0,
      "the bundle's file became shorter or was written over after it was opened; wait until it is complete and open "
      "it again");
}

palpate_status no_map(const SectionEntry& entry, palpate_error* error) {
  return fail(error, PALPATE_ERROR_FILE, entry.offset,
              "section %s of %llu bytes cannot be mapped; close other bundles or raise the limit on address space",
              formats::describe_section(static_cast<SectionId>(entry.id))->path,
              static_cast<unsigned long long>(entry.bytes));
}

// Whether the file still begins with the index that was read when it was opened, which stands for all its bytes.
bool has_its_index(const palpate_bundle& bundle) {
  std::uint64_t checksum = 0;
  return read_range(bundle.descriptor, offsetof(formats::BundleHeader, index_checksum), &checksum, sizeof checksum) &&
         checksum == bundle.index.header.index_checksum;
}

// Copies the bytes of a section into new memory of the bundle's allocator.
palpate_status copy_section(const palpate_bundle& bundle, const SectionEntry& entry, FileMap* copy,
                            palpate_error* error) {
  const std::size_t bytes = static_cast<std::size_t>(entry.bytes);
  void* memory = bytes == entry.bytes ? take_memory(bundle.allocator, bytes) : nullptr;
  if (!memory)
    return fail(error, PALPATE_ERROR_MEMORY, entry.offset,
                "no memory for a copy of section %s of %llu bytes; open the bundle with PALPATE_FILE_MAP, or a smaller "
                "one (palpate-bundle pack)",
                formats::describe_section(static_cast<SectionId>(entry.id))->path,
                static_cast<unsigned long long>(entry.bytes));
  if (!read_range(bundle.descriptor, entry.offset, memory, bytes) || !has_its_index(bundle)) {
    release_memory(bundle.allocator, memory);
    return file_was_cut(error);
  }
  copy->base = memory, copy->bytes = bytes, copy->data = static_cast<const unsigned char*>(memory);
  return PALPATE_OK;
}

// Copies or maps a section of a file.
palpate_status take_section(palpate_bundle& bundle, const SectionEntry& entry, FileMap* map, palpate_error* error) {
  if (!bundle.is_mapped()) return copy_section(bundle, entry, map, error);
  std::atomic<bool>* const lost = bundle.is_guarded() ? &bundle.lost : nullptr;
  return map_range(bundle.descriptor, entry.offset, entry.bytes, lost, map) ? PALPATE_OK : no_map(entry, error);
}
void drop_section(const palpate_bundle& bundle, FileMap* map) {
  if (bundle.is_mapped()) return unmap(map);
  if (map->base) release_memory(bundle.allocator, map->base);
  *map = FileMap{};
}

// The bytes of one section for the duration of a check.
class SectionLook {
 public:
  SectionLook(palpate_bundle& bundle, const SectionEntry* entry, palpate_error* error) : bundle_(bundle) {
    if (!entry) return;
    if (bundle.bytes) {
      data_ = bundle.bytes + entry->offset;
    } else {
      status_ = take_section(bundle, *entry, &map_, error);
      data_ = map_.data;
    }
  }
  ~SectionLook() { drop_section(bundle_, &map_); }
  SectionLook(const SectionLook&) = delete;
  SectionLook& operator=(const SectionLook&) = delete;
  const unsigned char* data() const { return data_; }
  palpate_status status() const { return status_; }  // PALPATE_OK also where there is no such section

 private:
  palpate_bundle& bundle_;
  FileMap map_;
  const unsigned char* data_ = nullptr;
  palpate_status status_ = PALPATE_OK;
};

// Checks every integer that is used as an index, one section after the other; none stays in memory.
palpate_status check_indices(palpate_bundle& bundle, palpate_error* error) {
  const auto check = [&](SectionId id, auto member) {
    const SectionEntry* entry = formats::find_section(bundle.index, id);
    if (!entry || entry->bytes == 0) return PALPATE_OK;
    const SectionLook look(bundle, entry, error);
    if (look.status() != PALPATE_OK) return look.status();
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
  if (status == PALPATE_OK) status = check(SectionId::corridor_nodes, &Sections::corridor_nodes);
  if (status == PALPATE_OK) status = check(SectionId::cut_nodes, &Sections::cut_nodes);
  return status;
}

// The table of blocks refers to the table of clusters, so both are checked together.
palpate_status check_compliance(palpate_bundle& bundle, palpate_error* error) {
  const auto entry = [&](SectionId id) { return formats::find_section(bundle.index, id); };
  if (!entry(SectionId::compliance_values)) return PALPATE_OK;
  const SectionLook nodes(bundle, entry(SectionId::compliance_nodes), error),
      clusters(bundle, entry(SectionId::compliance_clusters), error),
      blocks(bundle, entry(SectionId::compliance_blocks), error),
      scale(bundle, entry(SectionId::compliance_scale), error);
  for (const SectionLook* look : {&nodes, &clusters, &blocks, &scale})
    if (look->status() != PALPATE_OK) return look->status();
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

// Whether the response curve of that section, P or Q, can be used (formats/response_check.h).
palpate_status check_curve(const SectionEntry& entry, const double* coefficients, double range, palpate_error* error) {
  const formats::ResponseVerdict verdict =
      formats::check_response(coefficients, static_cast<std::size_t>(entry.shape[0]), range);
  if (verdict.fault == formats::ResponseFault::none) return PALPATE_OK;
  const SectionId id = static_cast<SectionId>(entry.id);
  char fault[200];
  formats::describe_response_fault(verdict, id == SectionId::response_force ? "N" : "m", fault, sizeof fault);
  return fail(error, PALPATE_ERROR_CONTENT, entry.offset, "section %s: the curve %s",
              formats::describe_section(id)->path, fault);
}

// P and Q, where they were measured.
palpate_status check_curves(palpate_bundle& bundle, palpate_error* error) {
  const SectionEntry* ranges = formats::find_section(bundle.index, SectionId::response_range);
  if (!ranges) return PALPATE_OK;
  const SectionLook range(bundle, ranges, error);
  if (range.status() != PALPATE_OK) return range.status();
  constexpr SectionId kCurves[] = {SectionId::response_radial, SectionId::response_force};
  for (int which = 0; which < 2; ++which) {
    const SectionEntry* entry = formats::find_section(bundle.index, kCurves[which]);
    const double end = reinterpret_cast<const double*>(range.data())[which];
    if (!entry || end == 0) continue;
    const SectionLook curve(bundle, entry, error);
    if (curve.status() != PALPATE_OK) return curve.status();
    if (bundle.is_lost()) return file_was_cut(error);
    if (const palpate_status status = check_curve(*entry, reinterpret_cast<const double*>(curve.data()), end, error))
      return status;
  }
  return PALPATE_OK;
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
  if (status == PALPATE_OK) status = check_curves(*opened, error);
  if (status != PALPATE_OK) {
    palpate_bundle_close(opened);
    return status;
  }
  *bundle = opened;
  const formats::BundleCounts& counts = opened->index.counts;
  opened->log.say(PALPATE_LOG_NOTE, "bundle %016llx: %llu nodes, %llu of them touchable, %llu triangles; %s",
                  static_cast<unsigned long long>(opened->index.header.index_checksum),
                  static_cast<unsigned long long>(counts.nodes), static_cast<unsigned long long>(counts.touchable),
                  static_cast<unsigned long long>(counts.triangles),
                  opened->bytes          ? "in the host's memory"
                  : opened->is_guarded() ? "in a mapped file; SIGBUS is handled"
                  : opened->is_mapped()  ? "in a mapped file"
                                         : "in a file whose sections are copied");
  int unknown = 0;
  for (std::uint32_t e = 0; e < opened->index.header.section_count; ++e)
    unknown += formats::describe_section(static_cast<SectionId>(opened->index.entries[e].id)) == nullptr;
  if (unknown > 0)
    opened->log.say(PALPATE_LOG_WARNING,
                    "bundle %016llx: %d sections were written by a later version and are not used by this one",
                    static_cast<unsigned long long>(opened->index.header.index_checksum), unknown);
  return succeed(error);
}

// A file is read piece by piece, without a map or a copy of the section: no SIGBUS can come.
palpate_status checksum_of(palpate_bundle& bundle, const SectionEntry& entry, std::uint64_t* sum,
                           palpate_error* error) {
  formats::Xxh64 hash;
  if (bundle.bytes) {
    hash.update(bundle.bytes + entry.offset, static_cast<std::size_t>(entry.bytes));
  } else {
    unsigned char piece[16384];
    for (std::uint64_t at = 0; at < entry.bytes; at += sizeof piece) {
      const std::size_t count = static_cast<std::size_t>(std::min<std::uint64_t>(sizeof piece, entry.bytes - at));
      if (!read_range(bundle.descriptor, entry.offset + at, piece, count)) return file_was_cut(error);
      hash.update(piece, count);
    }
    if (entry.bytes > 0 && !has_its_index(bundle)) return file_was_cut(error);
  }
  *sum = hash.digest();
  return PALPATE_OK;
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
  if (!map.data && take_section(*bundle, *entry, &map, error) != PALPATE_OK) return nullptr;
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
  palpate_bundle* opened = palpate::make_bundle(wanted);
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
  palpate_bundle* opened = palpate::make_bundle(wanted);
  if (!opened) {
    palpate::close_file(descriptor);
    return fail(error, PALPATE_ERROR_MEMORY, 0, "no memory for the bundle's index");
  }
  opened->descriptor = descriptor;
  alignas(64) unsigned char head[formats::kUserBlockBytes] = {};
  const std::uint64_t head_bytes = file_bytes < sizeof head ? file_bytes : sizeof head;
  if (!palpate::read_range(descriptor, 0, head, static_cast<std::size_t>(head_bytes))) {
    palpate_bundle_close(opened);
    return fail(error, PALPATE_ERROR_FILE, 0, "\"%.150s\" cannot be read", path);
  }
  formats::BundleError from;
  if (formats::read_bundle_index(head, file_bytes, &opened->index, &from) != formats::BundleStatus::ok) {
    palpate_bundle_close(opened);
    return fail(error, from);
  }
  if (opened->is_mapped() &&
      !opened->witness.call(descriptor, file_bytes, offsetof(formats::BundleHeader, index_checksum),
                            opened->index.header.index_checksum, opened->is_guarded() ? &opened->lost : nullptr)) {
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
    std::uint64_t sum = 0;
    if (const palpate_status status = palpate::checksum_of(opened, entry, &sum, error)) return status;
    if (opened.is_guarded() && opened.is_lost()) return palpate::file_was_cut(error);  // else the file was read whole
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
  for (palpate::FileMap& map : bundle->maps) palpate::drop_section(*bundle, &map);
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
  info.motion_count = static_cast<int32_t>(counts.motions);
  info.has_large = has(SectionId::large_order) && has(SectionId::large_stiffening);
  // A curve that was not measured has the range 0.
  double range[2] = {};
  if (const formats::SectionEntry* entry = formats::find_section(bundle->index, SectionId::response_range)) {
    palpate_error ignored;
    const palpate::SectionLook look(*const_cast<palpate_bundle*>(bundle), entry, &ignored);
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
