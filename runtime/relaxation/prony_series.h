// Force that relaxes while a displacement is held: a Prony series on each tool's force.
#pragma once

#include "runtime/base/vec3.h"
#include "runtime/include/palpate/palpate_relaxation.h"

namespace palpate {

// F(t) = F_e(t) - sum_i g_i (F_e(t) - h_i(t)),   h_i' = F_e' - h_i / tau_i.
// F_e is the instantaneous force, which the elastic tensors give; g_i are the shares, tau_i the times (palpate_relaxation_def). The
// equations follow from the relaxation function R(t) = 1 - sum_i g_i (1 - exp(-t / tau_i)) where all tissue relaxes alike and
// displacements are given.
class PronySeries {
 public:
  static constexpr int kMaxTerms = PALPATE_MAX_RELAXATION_TERMS;

  // False where the numbers are outside of the ranges that palpate.h states.
  bool set(const palpate_relaxation_def& wanted);

  // What one tool remembers from step to step.
  struct Memory {
    Vec3 elastic;          // F_e of the last step, N
    Vec3 part[kMaxTerms];  // h_i, N
  };

  // The force at the end of a step of dt (s, above 0) in which the instantaneous force went to `elastic` (N) in a straight line.
  // Exact for that at any dt, so unconditionally stable. Cost: one exponential and a dozen flops per term.
  Vec3 step(Memory& memory, Vec3 elastic, double dt) const;

 private:
  double share_[kMaxTerms] = {}, time_[kMaxTerms] = {};
  int terms_ = 0;
};

}  // namespace palpate
