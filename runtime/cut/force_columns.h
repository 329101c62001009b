// A few columns of forces on some nodes: G of a change D = G S G^T of the stiffness.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/cut/small_update.h"

namespace palpate {

class ForceColumns {
 public:
  // nodes: their numbers are below it; most: nodes that carry forces.
  bool create(SceneMemory& memory, std::int32_t nodes, std::int32_t most) {
    node_ = memory.array<std::int32_t>(static_cast<std::size_t>(most));
    place_ = memory.array<std::int32_t>(static_cast<std::size_t>(nodes));
    value_ = memory.array<Vec3>(static_cast<std::size_t>(most) * kMostColumns);
    most_ = most;
    return !memory.failed();
  }
  void begin(int columns) {
    for (std::int32_t a = 0; a < count_; ++a) place_[node_[a]] = 0;
    count_ = 0, columns_ = columns, full_ = false;
  }
  void add(std::int32_t node, int column, Vec3 force) {
    if (place_[node] == 0) {
      if (count_ == most_) {
        full_ = true;
        return;
      }
      node_[count_] = node, place_[node] = ++count_;
      for (int c = 0; c < columns_; ++c) value_[at(count_ - 1, c)] = {};
    }
    value_[at(place_[node] - 1, column)] += force;
  }
  void clear(int column) {
    for (std::int32_t a = 0; a < count_; ++a) value_[at(a, column)] = {};
  }
  bool is_full() const { return full_; }
  int columns() const { return columns_; }
  std::int32_t count() const { return count_; }
  std::int32_t node(std::int32_t a) const { return node_[a]; }
  Vec3 force(std::int32_t a, int column) const { return value_[at(a, column)]; }

 private:
  std::size_t at(std::int32_t a, int column) const {
    return static_cast<std::size_t>(a) * kMostColumns + static_cast<std::size_t>(column);
  }
  std::int32_t* node_ = nullptr;   // [most]
  std::int32_t* place_ = nullptr;  // [nodes] of each node, plus 1; 0: none
  Vec3* value_ = nullptr;          // [most][kMostColumns]
  std::int32_t count_ = 0, most_ = 0;
  int columns_ = 0;
  bool full_ = false;
};

}  // namespace palpate
