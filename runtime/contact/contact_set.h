// What is held, as rows over tensor columns: the contact nodes and the blocks of up to three rows that bind them.
#pragma once

#include <cstdint>

#include "runtime/base/vec3.h"
#include "runtime/surface/surface_index.h"

namespace palpate {

// One node under one contact: where a force acts. The same node may serve several contacts.
struct ContactEntry {
  std::int32_t node, column, tool, point;
  double weight;
};

// How the rows of a block bind. A block that is not sticking has its first row along the inward normal, the other two
// across it.
enum class ContactLaw : std::uint8_t { sticking, sliding, unilateral, coulomb };

// Rows H that hold the weighted mean of its entries at a target: up to three rows, one per imposed axis of its frame.
struct ContactBlock {
  std::int32_t first_entry, entry_count;
  std::uint32_t axes;              // bits 1, 2, 4: the frame's rows that are imposed
  std::int32_t tool, point, part;  // whose it is; ascending through a set
  ContactLaw law;
  bool framed;      // false: frame is the identity
  Mat3 frame;       // unit rows, orthogonal
  Mat3 local;       // m/N, in the frame: compliance of the place itself, that the mesh does not resolve
  double friction;  // coulomb: largest tangential force over the normal one
  double share;     // of the place that the tool holds: a vertex' weight in its triangle, else 1
  // Of a patch: where it was pressed, to know it again.
  SurfacePlace place;
  double radius;    // m; 0: not a patch
  bool incomplete;  // part of it lies on nodes without a column
};

// Fixed capacity; all arrays belong to the scene.
struct ContactSet {
  ContactEntry* entries = nullptr;  // [entry_capacity]
  ContactBlock* blocks = nullptr;   // [block_capacity]
  Vec3* target = nullptr;           // [block_capacity] per block along its rows, m; imposed axes only
  std::int32_t entry_capacity = 0, block_capacity = 0, entry_count = 0, block_count = 0;
};

}  // namespace palpate
