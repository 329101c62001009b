// Yeoh's isochoric law of three terms: energy, stress and tangent.
//     W = c1 x + c2 x^2 + c3 x^3,   x = J^(-2/3) I - 3,   c1 = mu / 2
// With c2 < 0 < c3 the tissue first softens in shear and then stiffens, as silicone does. c2 = c3 = 0 is the isochoric neo-Hookean law, to
// the bit. Which constants it takes: formats/tissue_laws.h.
// Source: Yeoh 1993, Some forms of the strain energy function for rubber, Rubber Chemistry and Technology 66, 754-771.
#pragma once

#include "runtime/large/neo_hookean.h"

namespace palpate {

template <class Real>
PALPATE_INLINE LawValue<Real> yeoh_law(const Deformation<Real>& d, const Real& mu, const Real& c2, const Real& c3) {
  LawValue<Real> value = isochoric_invariant(d);
  const Real x = value.energy, half = Scalar<Real>(0.5) * mu;
  const Real slope = half + x * (2 * c2 + 3 * (c3 * x));
  value.energy = x * (half + x * (c2 + c3 * x));
  value.along = slope * value.along, value.rest = slope * value.rest;
  return value;
}
inline LawSecond yeoh_law_second(const Deformation<double>& d, double mu, double c2, double c3) {
  const double x = isochoric_invariant(d).energy;
  return isochoric_second(d, mu / 2 + x * (2 * c2 + 3 * c3 * x), 2 * c2 + 6 * c3 * x);
}

}  // namespace palpate
