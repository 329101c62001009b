// Bundle sections while a scene is built: mapped, checked, and copied where a scene uses them as an index.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "runtime/base/error_text.h"
#include "runtime/base/scene_memory.h"
#include "runtime/bundle/bundle.h"
#include "runtime/bundle/tensors.h"

namespace palpate {

// Every function returns PALPATE_OK, or fills *error and returns its status.
class SectionReader {
 public:
  using SectionId = formats::SectionId;

  SectionReader(palpate_bundle& bundle, SceneMemory& memory, palpate_error* error)
      : bundle_(bundle), memory_(memory), error_(error) {}

  const formats::BundleCounts& counts() const { return bundle_.index.counts; }
  std::int32_t surface_nodes() const { return static_cast<std::int32_t>(counts().surface_nodes); }
  std::int32_t columns() const { return static_cast<std::int32_t>(counts().touchable); }
  std::int32_t triangles() const { return static_cast<std::int32_t>(counts().triangles); }
  SceneMemory& memory() const { return memory_; }
  palpate_bundle& bundle() const { return bundle_; }
  palpate_error* error() const { return error_; }
  const formats::SectionEntry* find(SectionId id) const { return formats::find_section(bundle_.index, id); }

  // The section's numbers, in the bundle's own bytes; the section must exist.
  template <class T>
  palpate_status map(SectionId id, const T** out) const {
    *out = section_as<T>(&bundle_, id, error_);
    if (*out) return PALPATE_OK;
    return error_->status == PALPATE_OK ? PALPATE_ERROR_FILE : error_->status;
  }
  // The same for a section that an effect needs and a bundle may lack.
  template <class T>
  palpate_status map_for(const char* effect, SectionId id, const T** out) const {
    return find(id) ? map(id, out) : missing(effect, id);
  }

  // A checked copy of integers that the scene uses as indices: if the file changes later, the check still holds.
  // member: which of the sections that formats::check_stored_indices knows.
  template <class Member>
  palpate_status copy_indices(SectionId id, std::size_t count, Member member, const std::int32_t** out) const {
    const std::int32_t* stored = nullptr;
    if (const palpate_status status = map(id, &stored)) return status;
    std::int32_t* copy = memory_.array<std::int32_t>(count);
    if (!copy) return no_memory();
    std::copy(stored, stored + count, copy);
    formats::IndexedSections sections;
    sections.*member = copy;
    *out = copy;
    return check(sections);
  }
  palpate_status check(const formats::IndexedSections& sections) const;

  // Displacement rows in their stored element type; f16 rows with their scales.
  palpate_status map_rows(SectionId id, DisplacementRows* out) const;

  // preload/displacement, [N][3] m; nullptr where the scene has no preload.
  palpate_status map_preload(const palpate_scene_def& def, const double** out) const;
  // From now on map_preload() gives these numbers, [N][3] m, borrowed.
  void replace_preload(const double* preload) { preload_ = preload; }

  // a + b of the first `nodes` nodes, as T, in `memory`. b may be nullptr.
  template <class T>
  palpate_status sum_positions(const double* a, const double* b, std::uint64_t nodes, SceneMemory& memory,
                               const T** out) const {
    T* sums = memory.array<T>(3 * nodes);
    if (!sums) return no_memory();
    for (std::uint64_t i = 0; i < 3 * nodes; ++i) {
      const double sum = a[i] + (b ? b[i] : 0.0);
      if (!(std::fabs(sum) <= 1e6)) return not_usable(SectionId::nodes, i);
      sums[i] = static_cast<T>(sum);
    }
    *out = sums;
    return PALPATE_OK;
  }

  // Rest positions of the first `nodes` nodes, preload included: [nodes][3] m.
  template <class T>
  palpate_status read_rest(const palpate_scene_def& def, std::uint64_t nodes, const T** out) const {
    const double *position = nullptr, *preload = nullptr;
    if (const palpate_status status = map(SectionId::nodes, &position)) return status;
    if (const palpate_status status = map_preload(def, &preload)) return status;
    return sum_positions(position, preload, nodes, memory_, out);
  }

  palpate_status missing(const char* effect, SectionId id) const;
  palpate_status not_usable(SectionId id, std::uint64_t number) const;
  palpate_status no_memory(const char* of_what = nullptr) const;

 private:
  palpate_bundle& bundle_;
  SceneMemory& memory_;
  palpate_error* error_;
  const double* preload_ = nullptr;
};

}  // namespace palpate
