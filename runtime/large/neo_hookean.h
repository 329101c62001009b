// Neo-Hookean laws: energy, stress and tangent.
//   compressible  W = mu/2 (I - 3) - mu ln J + lambda/2 (ln J)^2
//   isochoric     W = mu/2 (J^(-2/3) I - 3), the part of a law that does not answer to a change of volume
// Near rest both are linear elasticity with the shear modulus mu; compressible with Lame's lambda.
// Source: Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed. 2008, sections 6.4.3 and 6.5.
#pragma once

#include "runtime/large/deformation.h"
#include "runtime/large/small_strain.h"

namespace palpate {

template <class Real>
PALPATE_INLINE LawValue<Real> compressible_neo_hookean(const Deformation<Real>& d, const Real& mu, const Real& lambda) {
  const Real remainder = minus_logarithm_of_one_plus(d.j), logarithm = d.j - remainder;
  LawValue<Real> value;
  value.energy = mu * (Scalar<Real>(0.5) * d.excess + remainder) + Scalar<Real>(0.5) * lambda * logarithm * logarithm;
  value.along = mu;
  value.rest = (mu * d.j + lambda * logarithm) / (1 + d.j);
  return value;
}
inline LawSecond compressible_neo_hookean_second(const Deformation<double>& d, double mu, double lambda) {
  const double volume = 1 + d.j, logarithm = d.j - minus_logarithm_of_one_plus(d.j);
  return {0, 0, (mu + lambda * (1 - logarithm)) / (volume * volume)};
}

// x = J^(-2/3) I - 3 and its derivatives in the form of LawValue: energy x, along 2 dx/dI, rest 2 dx/dI + dx/dJ.
template <class Real>
PALPATE_INLINE LawValue<Real> isochoric_invariant(const Deformation<Real>& d) {
  const Real root = cube_root_of_one_plus(d.j), one = Real{} + 1, scale = one / ((1 + root) * (1 + root));
  LawValue<Real> value;
  value.energy = scale * (d.excess + root * root * (3 + 2 * root));
  value.along = 2 * scale;
  value.rest = value.along * (d.j - d.excess) / (3 + 3 * d.j);
  return value;
}
// Of a law psi(x): slope and curve are psi' and psi''.
inline LawSecond isochoric_second(const Deformation<double>& d, double slope, double curve) {
  const double volume = 1 + d.j, i = d.excess + 2 * d.j + 3, root = 1 + cube_root_of_one_plus(d.j);
  const double x_i = 1 / (root * root), x_j = -2.0 / 3 * i * x_i / volume, x_ij = -2.0 / 3 * x_i / volume;
  const double x_jj = 10.0 / 9 * i * x_i / (volume * volume);
  return {curve * x_i * x_i, curve * x_i * x_j + slope * x_ij, curve * x_j * x_j + slope * x_jj};
}

template <class Real>
PALPATE_INLINE LawValue<Real> isochoric_neo_hookean(const Deformation<Real>& d, const Real& mu) {
  LawValue<Real> value = isochoric_invariant(d);
  const Real half = Scalar<Real>(0.5) * mu;
  value.energy = half * value.energy, value.along = half * value.along, value.rest = half * value.rest;
  return value;
}
inline LawSecond isochoric_neo_hookean_second(const Deformation<double>& d, double mu) {
  return isochoric_second(d, mu / 2, 0);
}

}  // namespace palpate
