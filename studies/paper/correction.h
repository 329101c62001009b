// The paper's quasi-non-linear correction of one tool's answer (eqs 3-6), in double: what a full solve has to do as well.
#pragma once

#include "bench/peers/push.h"
#include "precompute/run/response_fit.h"
#include "runtime/tissue/response_curve.h"

namespace palpate::bench {

class Correction {
 public:
  // Errors: InputError for an organ without a measured response.
  explicit Correction(const OrganConfig& organ);

  // Of each node's displacement what is across the tool's motion gets the length P of it; the force along it becomes Q.
  void apply(const Eigen::Vector3d& displacement, Answer& answer) const;

 private:
  ResponseCurve radial_, force_;
};

}  // namespace palpate::bench
