// The changes of a cut mesh in their order, and which of them the compliance has. A saved state holds the log: a restored scene begins with the
// compliance of the uncut body, makes all changes of the log again and so gets the same bits.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/cut/cut_change.h"
#include "runtime/cut/cut_mesh.h"

namespace palpate {

class CutLog {
 public:
  // A part of a change that the compliance takes as one.
  struct Unit {
    enum Kind : std::int32_t { hold, split, remove } kind;
    std::int32_t number;  // the node; which new node of `change`; which removed tetrahedron of it
    CutChange change;     // the whole of it, for split and remove
  };

  // most: numbers of the log.
  bool create(SceneMemory& memory, std::int32_t most);
  void forget() { used_ = change_ = at_ = 0; }

  // Units of kind `hold` in a change, at most.
  static constexpr std::int32_t kMostHolds = 64;
  // What a change takes with all units that it may have.
  static std::int32_t numbers_of(const CutMeshChange& change);
  bool has_room(std::int32_t numbers) const { return used_ + numbers <= most_; }
  // The mesh's last change. Its units follow by add().
  void add(const CutMesh& mesh);
  // A unit of the last change.
  void add(Unit::Kind kind, std::int32_t number);

  // The units that the compliance does not have yet, in their order.
  std::int32_t left() const { return (used_ - at_) / kUnit; }
  Unit next() const { return unit_at(change_, at_); }
  void done() { at_ += kUnit; }
  CutChange last() const { return unit_at(change_, change_).change; }
  // The compliance takes none of what is left.
  void drop_rest() { used_ = at_, log_[change_] = used_ - change_; }
  static constexpr std::int32_t kUnit = 2;  // numbers of a unit
  // The place in the log up to which it has all.
  std::int32_t place() const { return at_; }
  // Calls visit(unit, place of it) for all that it has from a place on, until one returns false. Cost: also the changes before.
  template <class Visit>
  void for_each_done(std::int32_t from, Visit visit) const {
    for (std::int32_t change = 0; change < at_;) {
      const std::int32_t begin = units_of(change), end = change + log_[change];
      for (std::int32_t at = begin; at < end && at < at_; at += kUnit)
        if (at >= from && !visit(unit_at(change, at), at)) return;
      change = end;
    }
  }

 private:
  // A change: its length, the numbers of new nodes, moved and removed tetrahedra, these, then units of two numbers.
  static constexpr std::int32_t kHead = 4;
  std::int32_t units_of(std::int32_t change) const {
    const std::int32_t* const head = log_ + change;
    return change + kHead + 2 * head[1] + 5 * head[2] + head[3];
  }
  Unit unit_at(std::int32_t change, std::int32_t at) const;

  std::int32_t* log_ = nullptr;
  std::int32_t most_ = 0, used_ = 0;
  std::int32_t change_ = 0, at_ = 0;  // the last change; its next unit
};

}  // namespace palpate
