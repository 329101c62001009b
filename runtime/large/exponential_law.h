// An isochoric law that stiffens with strain: energy, stress and tangent.
//     W = mu / (2 b) (exp(b x) - 1),   x = J^(-2/3) I - 3
// mu is the shear modulus near rest and b, without unit, the stiffening; b -> 0 is the isochoric neo-Hookean law. Where
// b x exceeds 32 the energy goes on in a straight line, so that no number overflows.
// Source: Demiray 1972, A note on the elasticity of soft biological tissues, J. Biomechanics 5, 309-311 (an isotropic law of
// Fung's exponential kind).
#pragma once

#include "runtime/large/neo_hookean.h"

namespace palpate {

inline constexpr int kLargestExponent = 32;

// stiffening: b, above 0.
template <class Real>
PALPATE_INLINE LawValue<Real> exponential_law(const Deformation<Real>& d, const Real& mu, const Real& stiffening) {
  LawValue<Real> value = isochoric_invariant(d);
  const Real exponent = stiffening * value.energy, zero = Real{}, largest = zero + kLargestExponent;
  const Real held = smaller(larger(exponent, zero), largest), grown = exponential_minus_one(held);
  const Real slope = Scalar<Real>(0.5) * mu * (1 + grown);
  value.energy = Scalar<Real>(0.5) * mu * (grown + (1 + grown) * (exponent - held)) / stiffening;
  value.along = slope * value.along, value.rest = slope * value.rest;
  return value;
}
inline LawSecond exponential_law_second(const Deformation<double>& d, double mu, double stiffening) {
  const double exponent = stiffening * isochoric_invariant(d).energy;
  const double slope = mu / 2 * (1 + exponential_minus_one(exponent < kLargestExponent ? exponent : kLargestExponent));
  return isochoric_second(d, slope, exponent < kLargestExponent ? stiffening * slope : 0);
}

}  // namespace palpate
