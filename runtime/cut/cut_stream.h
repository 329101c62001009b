// The changes of a cut body as numbers, in their order: units of a change, and what the surface then shows. cut_beside.h follows them.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/cut/cut_change.h"
#include "runtime/cut/cut_compliance.h"
#include "runtime/cut/cut_triangles.h"

namespace palpate {

class CutStream {
 public:
  // most: numbers. A saved state has them.
  bool create(SceneMemory& memory, std::int32_t most);
  void clear() { used_ = 0; }

  // For all that may be added in a step for one change.
  bool has_room(const CutChange& change) const;
  // What of a change was made.
  void add(const CutChange& change, const CutResult& result);
  void add_hold(std::int32_t node, double stiffness);
  void add(const CutTriangles& triangles);

  std::int32_t end() const { return used_; }
  // Whole entries, most numbers at most; their count.
  std::int32_t copy(std::int32_t from, std::int32_t most, std::int32_t* out) const;
  const std::int32_t* numbers() const { return numbers_; }

  // Calls for each entry: split(CutChange of one new node), remove(tetrahedron), hold(node, stiffness), triangle(number, corners, is_active).
  template <class Follower>
  static void read(const std::int32_t* numbers, std::int32_t count, Follower& follower) {
    for (const std::int32_t *at = numbers, *const last = numbers + count; at < last; at += at[1]) {
      const std::int32_t* const of = at + kHead;
      switch (static_cast<Kind>(at[0])) {
        case Kind::split: {
          const CutChange::NewNode made = {of[0], of[1]};
          CutChange change;
          change.new_nodes = &made, change.new_node_count = 1;
          change.moved = reinterpret_cast<const CutChange::Moved*>(of + 2),
          change.moved_count = (at[1] - kHead - 2) / 5;
          follower.split(change);
          break;
        }
        case Kind::remove:
          follower.remove(of[0]);
          break;
        case Kind::hold:
          follower.hold(of[0], 1e-6 * of[1]);
          break;
        case Kind::triangles:
          for (const std::int32_t* t = of; t < at + at[1]; t += 5) follower.triangle(t[0], t + 1, t[4] != 0);
          break;
      }
    }
  }

 private:
  enum class Kind : std::int32_t { split, remove, hold, triangles };
  static constexpr std::int32_t kHead = 2;  // its kind; its length
  // Triangles of an entry at most, so that it is a part of a job.
  static constexpr std::int32_t kTriangles = 512;
  std::int32_t* begin(Kind kind, std::int32_t length);

  std::int32_t* numbers_ = nullptr;
  std::int32_t most_ = 0, used_ = 0;
};

}  // namespace palpate
