// A chosen displacement of the unit box, and the body force for which this displacement is the solution.
#pragma once

#include "studies/validation/closed_forms.h"

namespace palpate::validation {

// u = w + pressure (mu / lambda) (s(x) s(y) s(z), 0, 0) with s = sin(pi .) and w = (s(x) c(y) s(z), -c(x) s(y) s(z), 0) free of
// divergence. lambda div u, and with it the force, stays of order one as nu -> 1/2. The method of manufactured solutions,
// Roache 2002, J. Fluids Eng. 124.
struct Manufactured {
  Manufactured(const Material& material, double pressure);

  Vector3d displacement(const Vector3d& p) const;
  Matrix3d gradient(const Vector3d& p) const;  // d u_i / d x_j
  Vector3d force(const Vector3d& p) const;     // per volume

 private:
  double mu_, lambda_, share_;  // share = pressure mu / lambda
};

}  // namespace palpate::validation
