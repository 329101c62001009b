// One step of Newton's method on the contact laws as a system over the nodes that contacts share. The derivative of the laws' equations
// is D + V H W H^T with D and V one 3 x 3 block for each contact. By Woodbury's identity the step x with right-hand side b is
//     (I + K W) f = H^T D^-1 b,   x = D^-1 (b - V H W f),   K = H^T D^-1 V H:
// as many unknowns as the nodes have axes, however many contacts hold them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/contact_laws.h"

namespace palpate {

class SharedNewton {
 public:
  // Memory: at most 72 SharedNodes::kMostNodes^2 + 144 constraints bytes.
  bool create(SceneMemory& memory, std::int32_t contact_nodes, std::int32_t constraints);

  // Multiply-adds of factor() with its blocks, and of solve().
  static std::int64_t operations_to_factor(const ContactSystem& system);
  static std::int64_t operations_to_solve(const ContactSystem& system);

  // Call begin(), then add() for each constraint with equations, then factor().
  void begin(const ContactSystem& system);
  // own: D; weight: V; has[i]: whether row i has an equation.
  void add(const ContactSystem& system, std::int32_t p, const Mat3& own, const Mat3& weight, const bool has[3]);
  // matrix: [axes][stride], room for the factor, of which up to 16 numbers after each row's end are overwritten. It must stay as it
  // is until the last solve().
  bool factor(const ContactSystem& system, double* matrix, std::size_t stride);

  // change: [rows_end] in: b, zero in all rows without an equation; out: x.
  void solve(const ContactSystem& system, double* change);

 private:
  std::int32_t capacity_ = 0;  // nodes
  Mat3* inverse_ = nullptr;    // [constraints] D^-1
  Mat3* through_ = nullptr;    // [constraints] D^-1 V
  Mat3* between_ = nullptr;    // [nodes][capacity] K
  double* factor_ = nullptr;   // [axes][stride], borrowed
  std::size_t stride_ = 0;
};

}  // namespace palpate
