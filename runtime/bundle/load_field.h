// The displacement that forces at nodes give an organ: u_n = sum_k T^u_nk u~_k (eq. 9 of the paper).
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/tensors.h"

namespace palpate {

class LoadField {
 public:
  bool create(SceneMemory& memory, std::int32_t capacity);
  // Marks the loads as a part of the state; restored() completes it.
  void keep(SceneMemory& memory);
  void restored(const Tensors& tensors);

  // Begins a new list of loads. tensors: borrowed until the next call.
  void begin(const Tensors& tensors);
  // modified: m, u~ of the column's node; of a node of the corridor N, its force.
  void add(std::int32_t column, Vec3 modified);
  void forget() { count_ = 0; }

  std::int32_t count() const { return count_; }
  // How many of the loads first .. last - 1 are not zero.
  std::int32_t acting(std::int32_t first, std::int32_t last) const {
    return first == last ? 0 : (rows_before_[last] - rows_before_[first]) / 3;
  }
  std::int32_t acting() const { return acting(0, count_); }
  std::int32_t column(std::int32_t e) const { return loads_[e].column; }
  Vec3 modified(std::int32_t e) const { return loads_[e].modified; }

  // m. node: of the surface, or of the corridor. Cost: three reads at distant addresses for each load that acts, or as much as
  // Tensors::displacement.
  Vec3 at_node(std::int32_t node) const { return at_node(node, 0, count_); }
  // The same of the loads first .. last - 1 alone.
  Vec3 at_node(std::int32_t node, std::int32_t first, std::int32_t last) const;
  // Surface nodes first .. first + count - 1, where the tensors are stored as rows. out: [count][3] m.
  void at_run(std::int32_t first, std::int32_t count, double* out) const;

 private:
  struct Load {
    std::int32_t column, unused;  // in the place of padding, which a saved state would hold
    Vec3 modified;                // m
  };
  void find_rows(std::int32_t e);
  Vec3 sum_at_node(const DisplacementRows& rows, std::int32_t node, std::int32_t first, std::int32_t last) const;
  Vec3 sum_of_types(std::int32_t node, std::int32_t first, std::int32_t last) const;

  const Tensors* tensors_ = nullptr;
  Load* loads_ = nullptr;  // [capacity]
  // Of the loads that are not zero, three stored rows each (unused with a stored compliance) and their coefficients, m. Where organs
  // come near one another most loads are zero.
  const void** row_ = nullptr;           // [3 capacity]
  double* coefficient_ = nullptr;        // [3 capacity]
  std::int32_t* rows_before_ = nullptr;  // [capacity + 1] rows of all loads before this one
  std::int32_t capacity_ = 0, count_ = 0;
};

}  // namespace palpate
