// What is held, as rows over tensor columns: the contact nodes and the blocks of up to three rows that bind them.
#pragma once

#include <cstdint>

#include "runtime/vec3.h"

namespace palpate {

// One node under one contact: where a force acts. The same node may serve several contacts.
struct ContactEntry {
  std::int32_t node, column, tool, point;
};

// Rows H that hold the weighted mean of its entries at a target: up to three rows, one per imposed axis.
struct ContactBlock {
  std::int32_t first_entry, entry_count;  // 1 .. 3
  double weight[3];
  std::uint32_t axes;  // bits 1, 2, 4
};

// Fixed capacity; all arrays belong to the scene.
struct ContactSet {
  ContactEntry* entries = nullptr;  // [entry_capacity]
  ContactBlock* blocks = nullptr;   // [entry_capacity]
  Vec3* target = nullptr;           // [entry_capacity] per block, m; imposed axes only
  std::int32_t entry_capacity = 0, entry_count = 0, block_count = 0;
};

}  // namespace palpate
