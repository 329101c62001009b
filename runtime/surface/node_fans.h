// The triangles around each node of a surface, in the order of their numbers.
//
// Each corner of a triangle is an entry, 3 triangle + corner, in the list of its node. So a triangle comes, goes or gets another corner at the
// cost of the lists that it is in.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/scene_memory.h"

namespace palpate {

class NodeFans {
 public:
  // triangles: [triangle_count][3], checked, borrowed. active: [triangle_count], 0: the triangle is in no fan; borrowed, it may change;
  // nullptr: all are active, for good. False where there is no memory.
  bool build(SceneMemory& memory, std::int32_t nodes, const std::int32_t* triangles, std::int32_t triangle_count,
             const std::uint8_t* active = nullptr);

  // Calls visit(triangle, corner) for every triangle around a node.
  template <class Visit>
  void around(std::int32_t node, Visit visit) const {
    for (std::int32_t entry = first_[node]; entry >= 0; entry = next_[entry]) visit(entry / 3, entry % 3);
  }
  bool has(std::int32_t node) const { return first_[node] >= 0; }
  std::int32_t nodes() const { return nodes_; }
  // Triangles around one node at most, whichever are active.
  std::int32_t largest() const { return largest_; }

  // These triangles are active or inactive now, or have other corners, each at the place of the one before. A triangle may be listed that is
  // as it was. Nothing is allocated. Cost: the fans of their corners.
  void change(const std::int32_t* triangles, std::int32_t count);
  // The same of all triangles. Cost: all of them.
  void change_all();
  // Of the last change(): nodes whose fans have changed, then those that share a triangle with one of these.
  const std::int32_t* changed() const { return changed_; }
  std::int32_t changed_count() const { return changed_count_; }
  std::int32_t with_neighbours() const { return with_neighbours_; }

 private:
  void list_all(const std::uint8_t* active);
  void note(std::int32_t node);
  void move(std::int32_t entry, std::int32_t to);

  const std::int32_t* triangles_ = nullptr;
  const std::uint8_t* active_ = nullptr;
  std::int32_t nodes_ = 0, triangle_count_ = 0, largest_ = 0;
  std::int32_t* first_ = nullptr;  // [nodes] entry, -1: none
  std::int32_t* next_ = nullptr;   // [3 triangles]
  // Where triangles change:
  std::int32_t* node_of_ = nullptr;  // [3 triangles] in whose list an entry is; -1: in none
  std::int32_t* changed_ = nullptr;  // [nodes]
  std::uint8_t* noted_ = nullptr;    // [nodes] 1: it is in changed_
  std::int32_t changed_count_ = 0, with_neighbours_ = 0;
};

}  // namespace palpate
