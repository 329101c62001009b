// A tensor bundle as the runtime holds it: checked index, and each section's bytes when something needs them.
#pragma once

#include <atomic>
#include <cstdint>

#include "formats/bundle_reader.h"
#include "runtime/bundle/file_map.h"
#include "runtime/include/palpate/palpate.h"

struct palpate_bundle {
  palpate::formats::BundleIndex index;
  const unsigned char* bytes = nullptr;  // the host's, or nullptr for a file
  int descriptor = -1;
  std::atomic<bool> lost{false};  // a page of the file was gone when it was read, or the witness found another file
  palpate::FileWitness witness;   // of a file

  // Whether the file has shrunk or was written over since it was opened. Three reads and no system call: for every step.
  bool is_lost() {
    if (!witness.holds()) lost.store(true, std::memory_order_relaxed);
    return lost.load(std::memory_order_relaxed);
  }

  // One map per section, made on first use by whoever comes first.
  std::atomic_flag mapping = ATOMIC_FLAG_INIT;
  palpate::FileMap maps[palpate::formats::kMaxSections];
};

namespace palpate {

// The section's bytes, mapped if need be; nullptr where the bundle has none (error untouched) or mapping fails (*error
// filled). Not for use in a step.
const void* section_bytes(palpate_bundle* bundle, formats::SectionId id, palpate_error* error);

template <class T>
const T* section_as(palpate_bundle* bundle, formats::SectionId id, palpate_error* error) {
  return static_cast<const T*>(section_bytes(bundle, id, error));
}

}  // namespace palpate
