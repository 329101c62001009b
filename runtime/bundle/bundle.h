// An open tensor bundle: its checked index, and the bytes of each section that a scene has asked for.
#pragma once

#include <atomic>
#include <cstdint>

#include "formats/bundle_reader.h"
#include "runtime/base/log.h"
#include "runtime/bundle/file_map.h"
#include "runtime/include/palpate/palpate.h"

struct palpate_bundle {
  explicit palpate_bundle(const palpate_bundle_options& options)
      : allocator(options.allocator), log{options.log, options.log_user}, access(options.file_access) {}
  const palpate_allocator allocator;
  const palpate::Log log;
  const palpate_file_access access;  // of a file
  bool is_mapped() const { return access != PALPATE_FILE_COPY; }
  bool is_guarded() const { return access == PALPATE_FILE_MAP_GUARDED; }
  palpate::formats::BundleIndex index;
  const unsigned char* bytes = nullptr;  // [whole bundle] of the host; nullptr for a file
  int descriptor = -1;
  std::atomic<bool> lost{false};  // a mapped page could not be read, or the witness found other bytes
  palpate::FileWitness witness;   // for a mapped file

  // Whether the mapped file was cut or written over since it was opened. Three reads and no system call, so every step can ask.
  // False for a file whose sections are copied: their bytes stay.
  bool is_lost() {
    if (!witness.holds()) lost.store(true, std::memory_order_relaxed);
    return lost.load(std::memory_order_relaxed);
  }

  // One map or copy per section, made by the first thread that needs it.
  std::atomic_flag mapping = ATOMIC_FLAG_INIT;
  palpate::FileMap maps[palpate::formats::kMaxSections];
};

namespace palpate {

// The section's bytes, copied or mapped on first use. nullptr where the bundle does not have the section (*error unchanged) or
// where that fails (*error filled). Not for use in a step.
const void* section_bytes(palpate_bundle* bundle, formats::SectionId id, palpate_error* error);

template <class T>
const T* section_as(palpate_bundle* bundle, formats::SectionId id, palpate_error* error) {
  return static_cast<const T*>(section_bytes(bundle, id, error));
}

}  // namespace palpate
