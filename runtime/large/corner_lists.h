// Lists of the corners of tetrahedra: those at a node, or at a site where an element averages. A list may be split as the mesh is cut.
#pragma once

#include <algorithm>
#include <cstdint>

#include "runtime/base/scene_memory.h"

namespace palpate {

class CornerLists {
 public:
  bool create(SceneMemory& memory, std::int32_t lists, std::size_t tetrahedra) {
    lists_ = lists;
    range_ = memory.array<Range>(static_cast<std::size_t>(lists));
    entry_ = memory.array<std::int32_t>(4 * tetrahedra);
    return !memory.failed();
  }
  // Corner c is entry(c) of list of(c), where that is below `filled`, in the order of the corners.
  template <class Of, class Entry>
  void fill(std::size_t tetrahedra, std::int32_t filled, const Of& of, const Entry& entry) {
    for (std::size_t c = 0; c < 4 * tetrahedra; ++c)
      if (of(c) < filled) ++range_[of(c)].end;
    for (std::int32_t i = 0, begin = 0; i < filled; ++i) {
      begin += range_[i].end;
      range_[i] = {begin - range_[i].end, begin - range_[i].end};
    }
    for (std::size_t c = 0; c < 4 * tetrahedra; ++c)
      if (of(c) < filled) entry_[range_[of(c)].end++] = entry(c);
  }

  std::int32_t begin(std::int32_t list) const { return range_[list].begin; }
  std::int32_t end(std::int32_t list) const { return range_[list].end; }
  std::int32_t operator[](std::int32_t at) const { return entry_[at]; }
  bool has(std::int32_t list, std::int32_t entry) const {
    return std::find(entry_ + begin(list), entry_ + end(list), entry) != entry_ + end(list);
  }

  // For split(), drop() and forget_changes(), after fill().
  bool keep_uncut(SceneMemory& memory, std::size_t tetrahedra) {
    entries_ = 4 * tetrahedra;
    uncut_range_ = memory.array<Range>(static_cast<std::size_t>(lists_));
    uncut_entry_ = memory.array<std::int32_t>(entries_), moved_ = memory.array<std::int32_t>(entries_);
    if (memory.failed()) return false;
    std::copy(range_, range_ + lists_, uncut_range_), std::copy(entry_, entry_ + entries_, uncut_entry_);
    return true;
  }
  // Entries for which goes(entry) is true become the list `to`. Both lists keep their order.
  template <class Goes>
  void split(std::int32_t from, std::int32_t to, const Goes& goes) {
    Range& stays = range_[from];
    std::int32_t kept = stays.begin, moved = 0;
    for (std::int32_t at = stays.begin; at < stays.end; ++at) {
      const std::int32_t entry = entry_[at];
      if (goes(entry))
        moved_[moved++] = entry;
      else
        entry_[kept++] = entry;
    }
    std::copy(moved_, moved_ + moved, entry_ + kept);
    range_[to] = {kept, stays.end};
    stays.end = kept;
  }
  void drop(std::int32_t list, std::int32_t entry) {
    Range& range = range_[list];
    range.end = static_cast<std::int32_t>(std::remove(entry_ + range.begin, entry_ + range.end, entry) - entry_);
  }
  void forget_changes() {
    std::copy(uncut_range_, uncut_range_ + lists_, range_), std::copy(uncut_entry_, uncut_entry_ + entries_, entry_);
  }

 private:
  struct Range {
    std::int32_t begin, end;
  };
  std::int32_t lists_ = 0;
  std::size_t entries_ = 0;
  Range *range_ = nullptr, *uncut_range_ = nullptr;  // [lists]
  std::int32_t *entry_ = nullptr, *uncut_entry_ = nullptr, *moved_ = nullptr;
};

}  // namespace palpate
