// The softest free mode of a state of the body, which tells a balance that is not stable: one step of the locally optimal preconditioned
// conjugate gradient method (Knyazev 2001, SIAM J. Sci. Comput. 23) in each step of the body, on one vector.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/large/body_metric.h"
#include "runtime/large/hyperelastic_energy.h"
#include "runtime/large/large_rows.h"

namespace palpate {

class SoftMode {
 public:
  // All borrowed.
  bool create(SceneMemory& memory, HyperelasticEnergy* energy, const BodyMetric* metric, LargeRows* rows);
  void keep(SceneMemory& memory);
  // No mode is known: at rest, or with another metric.
  void forget() { state_ = {}; }
  // The rows' own compliance is that of other rows.
  void forget_local_moves();

  // A move of the method that is softer takes the mode's place. curvature: J, s . z.
  void take_if_softer(const BodyMove& pair, double curvature);
  // A state of the body: m; its gradient, N; s of each row, N; J.
  struct At {
    const float *u, *f;
    const double* local;
    double energy;
  };
  // One step on, where it is its turn. work, trial: overwritten. Returns the evaluations that it took.
  std::int32_t follow(const At& at, const BodyMove& work, float* trial);

  // q . K(u) q / q . K q of the softest free move q that is known; 1: no move was soft.
  double quotient() const { return state_.quotient; }
  // The balance is not stable, or nearly neutral.
  bool is_unheld() const { return state_.unheld != 0; }

 private:
  struct State {
    double quotient = 1;
    std::int32_t follows = 0;  // 0: no soft mode is known; else the steps until it is followed further, and one
    std::int32_t unheld = 0;
  };
  double in_metric(const BodyMove& a, const BodyMove& b) const;
  double in_tangent(const BodyMove& a, const BodyMove& b) const;
  void combine(double scale, const BodyMove& a, double factor, const BodyMove& b) const;
  void normalise(const BodyMove& a) const;
  bool find_tangent(const At& at, const BodyMove& a, float* trial) const;
  void find_residual(const BodyMove& residual) const;
  void combine_softest(const BodyMove& residual);

  HyperelasticEnergy* energy_ = nullptr;
  const BodyMetric* metric_ = nullptr;
  LargeRows* rows_ = nullptr;
  BodyMove mode_, last_;  // the mode, of the unit norm in the metric, and its last change
  State state_;
};

}  // namespace palpate
