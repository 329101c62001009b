// Sections that a pass of the plan maps.
#pragma once

#include <cstdint>
#include <initializer_list>

#include "runtime/bundle/bundle.h"

namespace palpate {

// A section that the bundle does not have is left out, so a function may add all that a pass can map.
class SectionList {
 public:
  static constexpr int kMost = 16;
  explicit SectionList(const palpate_bundle& bundle) : bundle_(bundle) {}

  SectionList& add(std::initializer_list<formats::SectionId> ids) {
    for (const formats::SectionId id : ids)
      if (const formats::SectionEntry* entry = find(id); entry && count_ < kMost)
        id_[count_++] = id, bytes_ += entry->bytes;
    return *this;
  }

  // The positions of nodes at rest, and the triangles.
  SectionList& add_rest(const palpate_scene_def& def) {
    add({formats::SectionId::nodes, formats::SectionId::triangles});
    return def.preload == PALPATE_PRELOAD_ON ? add({formats::SectionId::preload_displacement}) : *this;
  }

  // Displacements of the surface: rows, or a compliance in blocks.
  SectionList& add_surface() {
    using Id = formats::SectionId;
    if (!find(Id::displacement_surface))
      return add({Id::compliance_nodes, Id::compliance_clusters, Id::compliance_blocks, Id::compliance_values,
                  Id::compliance_scale});
    add({Id::displacement_surface});
    return is_half(Id::displacement_surface) ? add({Id::displacement_scale}) : *this;
  }
  // These, and what contacts need beside them.
  SectionList& add_contacts() { return add({formats::SectionId::touchable, formats::SectionId::force}).add_surface(); }

  bool is_half(formats::SectionId id) const {
    const formats::SectionEntry* entry = find(id);
    return entry && static_cast<formats::ElementType>(entry->type) == formats::ElementType::f16;
  }
  const formats::SectionEntry* find(formats::SectionId id) const { return formats::find_section(bundle_.index, id); }
  const palpate_bundle& bundle() const { return bundle_; }
  int count() const { return count_; }
  const char* name(int i) const { return formats::describe_section(id_[i])->path; }
  // In the bundle, of all of them.
  std::uint64_t bytes() const { return bytes_; }

 private:
  const palpate_bundle& bundle_;
  formats::SectionId id_[kMost];
  int count_ = 0;
  std::uint64_t bytes_ = 0;
};

}  // namespace palpate
