// An open tensor bundle: its checked index, and the bytes of each section that a scene has asked for.
#pragma once

#include <atomic>
#include <cstdint>

#include "formats/bundle_reader.h"
#include "runtime/bundle/file_map.h"
#include "runtime/include/palpate/palpate.h"

struct palpate_bundle {
  explicit palpate_bundle(const palpate_allocator& host) : allocator(host) {}
  const palpate_allocator allocator;
  palpate::formats::BundleIndex index;
  const unsigned char* bytes = nullptr;  // [whole bundle] of the host; nullptr for a file
  int descriptor = -1;
  std::atomic<bool> lost{false};  // a page of the file could not be read, or the witness found other bytes
  palpate::FileWitness witness;   // for a file

  // Whether the file was cut or written over since it was opened. Three reads and no system call, so every step can ask.
  bool is_lost() {
    if (!witness.holds()) lost.store(true, std::memory_order_relaxed);
    return lost.load(std::memory_order_relaxed);
  }

  // One map per section, made by the first thread that needs it.
  std::atomic_flag mapping = ATOMIC_FLAG_INIT;
  palpate::FileMap maps[palpate::formats::kMaxSections];
};

namespace palpate {

// The section's bytes, mapped on first use. nullptr where the bundle does not have the section (*error unchanged) or where mapping
// fails (*error filled). Not for use in a step.
const void* section_bytes(palpate_bundle* bundle, formats::SectionId id, palpate_error* error);

template <class T>
const T* section_as(palpate_bundle* bundle, formats::SectionId id, palpate_error* error) {
  return static_cast<const T*>(section_bytes(bundle, id, error));
}

}  // namespace palpate
