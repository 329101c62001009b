// The pairs (s, z) of the limited-memory BFGS method (Nocedal 1980, Math. Comp. 35): a move of the body and the change of its gradient along
// it. Both have a part in the rows' own compliance (large_rows.h).
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/large/large_rows.h"

namespace palpate {

class SecantPairs {
 public:
  static constexpr int kMost = 8;

  // rows: borrowed.
  bool create(SceneMemory& memory, std::size_t length, const LargeRows* rows);
  void keep_state(SceneMemory& memory);
  void drop() { state_.count = state_.first = state_.since_scale = 0, state_.scale = 1; }

  std::int32_t count() const { return state_.count; }
  double scale() const { return state_.scale; }  // gamma: the initial matrix is gamma K^-1
  // Bounds of gamma, in tissue that has stiffened.
  static constexpr double kLeastScale = 1e-4;

  // The two loops of the method, from a gradient to a direction, around the metric. factor: [kMost], from the one to the other.
  void before_metric(float* p, double* local, double* factor) const;
  void after_metric(float* p, double* local, const double* factor) const;

  // The pair of the move -share p, from gradient f to after. Without enough curvature it is not kept: a full list then loses its oldest one.
  // energy: J, of the body. Returns the pair where the scale is to be measured by it (set_scale()); else -1.
  int add(double share, const float* p, const double* local_p, const float* f, const float* after, double energy);
  const float* change(int pair) const { return changes_[pair]; }
  const double* local_move(int pair) const { return local_moves_[pair]; }
  // scaled: J, z.K^-1 z of the pair, projected onto the contacts.
  void set_scale(int pair, double scaled);

  // What the pairs say about the rows' own compliance belongs to other rows.
  void forget_local_moves();
  // The pairs of before mark() go; the others keep no scale.
  void mark() { state_.marked = 0; }
  void drop_before_mark();

 private:
  struct State {
    double curvature[kMost];  // s . z of each pair
    double scale;
    std::int32_t first, count, since_scale, marked;
  };
  int pair(int age) const { return (state_.first + state_.count - 1 - age) % kMost; }  // 0: the newest

  std::size_t length_ = 0;
  const LargeRows* rows_ = nullptr;
  float* moves_[kMost] = {};         // [length] s of each pair
  float* changes_[kMost] = {};       // [length] z
  double* local_moves_[kMost] = {};  // [rows] the part of s and of z in the rows' own compliance
  State state_ = {};
};

}  // namespace palpate
