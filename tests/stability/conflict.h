// What the cases with organs of a world share: a bound of the forces that contradictions may take, and maxima that keep NaN.
#pragma once

#include "tests/runtime/touched_box.h"

namespace palpate::tests {

// N/m: no node resists with more than its own block of K, however much others hold it.
inline double stiffest(const TouchedBody& body) {
  const Eigen::MatrixXd k = body.stiffness();
  double most = 0;
  for (Eigen::Index n = 0; n < k.rows() / 3; ++n) most = std::max(most, k.block<3, 3>(3 * n, 3 * n).norm());
  return most;
}

// NaN stays.
inline void keep(double value, double* most) {
  *most = std::isnan(value) || value > *most ? value : *most;
}

// The flags by which a step says that conditions contradict one another.
inline constexpr palpate_step_flags kOfConflict = PALPATE_STEP_REGULARISED | PALPATE_STEP_SOLVE_INEXACT;

}  // namespace palpate::tests
