// What a blade or a burning tool has changed in the mesh: new nodes, tetrahedra with other corners, tetrahedra removed.
#pragma once

#include <cstdint>

namespace palpate {

// Borrowed arrays. New nodes have the numbers behind all others, in their order.
struct CutChange {
  struct NewNode {
    std::int32_t node, from;  // it lies where `from` lies at rest; `from` may be a new node of an earlier change
  };
  struct Moved {
    std::int32_t tetrahedron, corners[4];  // after the change, in the order of the corners before it
  };
  const NewNode* new_nodes = nullptr;
  const Moved* moved = nullptr;
  const std::int32_t* removed = nullptr;
  std::int32_t new_node_count = 0, moved_count = 0, removed_count = 0;
};

}  // namespace palpate
