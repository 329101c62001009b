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
  // The smallest gamma, in tissue that has stiffened.
  static constexpr double kLeastScale = 1e-4;

  // The two loops of the method, from a gradient to a direction p.move, around the metric. factor: [kMost], from the one to the other.
  void before_metric(const BodyMove& p, double* factor) const;
  void after_metric(const BodyMove& p, const double* factor) const;

  // The pair of the move -share p, from gradient f to after. Without enough curvature it is not kept: a full list then loses its oldest one.
  // energy: J, of the body. Returns the pair where the scale is to be measured by it (set_scale()); else -1.
  int add(double share, const BodyMove& p, const float* f, const float* after, double energy);
  // A pair: s is its move, z its of_tangent. newest(): the pair that add() was given last, whether it was kept or not; newest_curvature(): J,
  // s . z of that pair.
  const BodyMove& at(int pair) const { return pairs_[pair]; }
  const BodyMove& newest() const { return pairs_[newest_]; }
  double newest_curvature() const { return state_.curvature[newest_]; }
  // scaled: J, z.K^-1 z of the pair, projected onto the contacts.
  void set_scale(int pair, double scaled);

  // Sets the local part of each move to zero: it is that of rows which are no longer there.
  void forget_local_moves();
  // mark(): a renewal of the metric begins. take_metric(): it has ended, and the metric is the tangent near the states of the pairs that were
  // added since mark(). Older pairs are dropped, and gamma is 1 again.
  void mark() { state_.marked = 0; }
  void take_metric();

 private:
  struct State {
    double curvature[kMost];  // s . z of each pair
    double scale;
    std::int32_t first, count, since_scale, marked;
  };
  int pair(int age) const { return (state_.first + state_.count - 1 - age) % kMost; }  // 0: the newest

  std::size_t length_ = 0;
  const LargeRows* rows_ = nullptr;
  BodyMove pairs_[kMost];
  int newest_ = 0;
  State state_ = {};
};

}  // namespace palpate
