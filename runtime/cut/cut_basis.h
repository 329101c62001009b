// The basis of a cut: patterns of forces on nodes of the base, each with the jump that it gives a new node. What a cut changes of the compliance is
// a symmetric matrix between these patterns (cut_compliance.h).
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/cut/pair_compliance.h"

namespace palpate {

// Nodes of the base (CutTissue::base()) on which patterns act have slots; the compliance between them is held in double precision.
class CutSlots {
 public:
  bool create(SceneMemory& memory, const PairCompliance& source, std::int32_t nodes, std::int32_t most);
  // source: of the pairs from now on.
  void forget(const PairCompliance& source);
  // The slot of a node, which gets one if it has none. -1: no slot is left; -2: a pair is not known.
  std::int32_t take(std::int32_t node);
  std::int32_t find(std::int32_t node) const { return slot_of_node_[node] - 1; }
  std::int32_t count() const { return count_; }
  const std::int32_t* nodes() const { return node_; }
  // [stride()] m/N: displacement along `axis` of a slot's node for unit forces at all slots.
  const double* row(std::int32_t slot, int axis) const {
    return pairs_ + (3 * static_cast<std::size_t>(slot) + static_cast<std::size_t>(axis)) * stride_;
  }
  std::size_t stride() const { return stride_; }
  const PairCompliance& source() const { return *source_; }

 private:
  const PairCompliance* source_ = nullptr;
  std::int32_t* slot_of_node_ = nullptr;  // [nodes] plus 1
  std::int32_t* node_ = nullptr;          // [most]
  double* pairs_ = nullptr;               // [3 most][stride]
  std::size_t stride_ = 0;
  std::int32_t count_ = 0, most_ = 0, nodes_ = 0;
};

class CutBasis {
 public:
  bool create(SceneMemory& memory, std::int32_t most, std::int32_t slots, std::int32_t most_entries);

  void forget();
  std::int32_t count() const { return count_; }
  bool has_room(std::int32_t patterns) const { return count_ + patterns <= most_; }
  // A pattern is begun, gets its forces, and is then the last one. jump: 3 n + axis of the n-th new node, -1: none.
  std::int32_t begin(std::int32_t jump = -1);
  bool add(std::int32_t slot, Vec3 force);  // false: no room
  void drop_last(std::int32_t patterns);
  // Three patterns: unit forces on a slot's node. -1: no room.
  std::int32_t nodal(std::int32_t slot);
  // The first of them; -1: they have not been asked for.
  std::int32_t find_nodal(std::int32_t slot) const { return nodal_[slot] - 1; }

  // Calls visit(slot, force) for a pattern's forces.
  template <class Visit>
  void for_each_force(std::int32_t pattern, Visit visit) const {
    for (std::int32_t at = first_[pattern]; at < first_[pattern + 1]; ++at)
      visit(slot_[at], load3(force_ + 3 * static_cast<std::size_t>(at)));
  }
  std::int32_t jump(std::int32_t pattern) const { return jump_[pattern]; }
  // of[j][i]: what pattern i makes of field j, the sum of its forces . the field at their slots. fields: [count][field_stride]; of:
  // [count][stride]; scratch: scratch_of_weigh() numbers.
  void weigh(const double* fields, std::size_t field_stride, int count, std::int32_t slots, double* of,
             std::size_t stride, double* scratch) const;
  static std::size_t scratch_of_weigh(std::int32_t slots, std::int32_t patterns);

 private:
  std::int32_t* first_ = nullptr;  // [most + 1] into slot_ and force_
  std::int32_t* slot_ = nullptr;
  double* force_ = nullptr;        // [3] of each
  std::int32_t* jump_ = nullptr;   // [most]
  std::int32_t* nodal_ = nullptr;  // [slots] first pattern, plus 1
  std::int32_t count_ = 0, most_ = 0, most_entries_ = 0, slots_ = 0;
};

// Which patterns the gradients of an averaging site began as.
class CutSites {
 public:
  struct Site {
    std::int32_t node, region, pattern, next;  // next: plus 1
  };
  bool create(SceneMemory& memory, std::int32_t nodes, std::int32_t most);
  void forget();
  // nullptr: no room.
  Site* find_or_add(std::int32_t node, std::int32_t region);
  // The site goes to another node; what that node had there is forgotten.
  void move(std::int32_t from, std::int32_t region, std::int32_t to);

 private:
  std::int32_t* first_ = nullptr;  // [nodes] plus 1
  Site* sites_ = nullptr;
  std::int32_t count_ = 0, most_ = 0, nodes_ = 0;
};

}  // namespace palpate
