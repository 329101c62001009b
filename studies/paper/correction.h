// The paper's quasi-non-linear correction (eqs 3-6) for one tool, in double precision, for the answers of the full solves.
#pragma once

#include "precompute/run/response_fit.h"
#include "runtime/tissue/response_curve.h"
#include "studies/peers/push.h"

namespace palpate::studies {

class Correction {
 public:
  // Errors: InputError if the organ has no measured response.
  explicit Correction(const OrganConfig& organ);

  // Replaces the length of each displacement's part across the tool's motion by P of it, and the part of the force along the
  // motion by Q of it.
  void apply(const Eigen::Vector3d& displacement, Answer& answer) const;

 private:
  ResponseCurve radial_, force_;
};

}  // namespace palpate::studies
