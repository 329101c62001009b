// Ogden's isochoric law of one or two terms: energy, stress and tangent.
//     W = sum over k of 2 mu_k / a_k^2 (l_1^a_k + l_2^a_k + l_3^a_k - 3)
// l_n are the principal stretches times J^(-1/3), mu_1 + mu_2 = mu. One term with a = 2 is the isochoric neo-Hookean law. Which constants
// it takes: formats/tissue_laws.h. Where a power exceeds exp(32) the energy goes on in a straight line in the logarithm, so that no number
// overflows; beyond the stretches of principal_strains.h it is infinite, and no step goes there.
// Source: Ogden 1972, Large deformation isotropic elasticity, Proc. R. Soc. Lond. A 326, 565-584. The tangent by principal axes: Simo and
// Taylor 1991, Comput. Methods Appl. Mech. Eng. 85, 273-310.
#pragma once

#include "runtime/large/principal_strains.h"

namespace palpate {

inline constexpr int kLargestPower = 32;  // of exp

// shear: mu; share: mu_2 / mu.
template <class Real>
struct OgdenConstants {
  Real shear, exponent, share, second;
};

template <class Real>
PALPATE_INLINE Real held_power(const Real& x) {
  const Real most = Real{} + kLargestPower;
  return smaller(larger<Real>(x, -most), most);
}

// One term: += its energy, and the derivatives of W by the logarithms.
template <class Real>
PALPATE_INLINE void add_ogden_term(const Real logarithm[3], const Real& shear, const Real& exponent, Real* energy,
                                   Real slope[3]) {
  const Real factor = 2 * shear / exponent;
  Real sum = Real{};
  PALPATE_ROLLED
  for (int n = 0; n < 3; ++n) {
    // As the logarithms add up to zero, exp(x) - 1 - x may stand for exp(x) - 1.
    const Real x = exponent * logarithm[n], held = held_power(x);
    const ExponentialRests<Real> rests = exponential_rests(held);
    sum = sum + (rests.of_line + (x - held) * rests.of_one);
    slope[n] = slope[n] + factor * rests.of_one;
  }
  *energy = *energy + factor / exponent * sum;
}

// Derivatives of the energy by the logarithms, less their mean: the principal Kirchhoff stresses.
template <class Real>
PALPATE_INLINE Real ogden_slopes(const PrincipalStrains<Real>& of, const OgdenConstants<Real>& law, Real slope[3]) {
  Real energy = Real{};
  for (int n = 0; n < 3; ++n) slope[n] = Real{};
  const Real shear[] = {law.shear * (1 - law.share), law.shear * law.share}, exponent[] = {law.exponent, law.second};
  PALPATE_ROLLED
  for (int k = 0; k < 2; ++k) add_ogden_term(of.logarithm, shear[k], exponent[k], &energy, slope);
  const Real mean = (slope[0] + slope[1] + slope[2]) * (Scalar<Real>(1) / 3);
  for (int n = 0; n < 3; ++n) slope[n] = slope[n] - mean;
  return energy;
}

// The energy of a unit volume, Pa. stress: dW/dF + pressure cof F, Pa. With the tensor T of the slopes along the axes at rest dW/dF is
// F^-T T, as T and F^T F have the same axes.
template <class Real>
PALPATE_INLINE Real ogden_law(const Deformation<Real>& d, const OgdenConstants<Real>& law, const Real& pressure,
                              Real stress[3][3]) {
  const PrincipalStrains<Real> of = principal_strains(d);
  Real slope[3], t[3][3];
  const Real energy = ogden_slopes(of, law, slope);
  tensor_of(of, slope, t);
  const Real inverse = 1 / (1 + d.j);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      stress[i][k] = inverse * (t[i][k] + (d.cof[i][0] * t[0][k] + d.cof[i][1] * t[1][k] + d.cof[i][2] * t[2][k])) +
                     pressure * d.cof[i][k] + (i == k ? pressure : Real{});
  const Real zero = Real{}, infinite = zero + std::numeric_limits<Scalar<Real>>::infinity();
  return of.beyond <= zero ? energy : infinite;
}

// Its tangent at one deformation.
class OgdenTangent {
 public:
  OgdenTangent() = default;
  OgdenTangent(const Deformation<double>& d, const OgdenConstants<double>& law) : of_(principal_strains(d)) {
    double slope[3];
    ogden_slopes(of_, law, slope);
    tensor_of(of_, slope, t_);
    const double shears[] = {law.shear * (1 - law.share), law.shear * law.share};
    const double exponents[] = {law.exponent, law.second};
    for (int k = 0; k < 2; ++k) add_term(shears[k], exponents[k]);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k)
        inverse_[i][k] = (d.cof[i][k] + (i == k)) / (1 + d.j), f_[i][k] = d.h[i][k] + (i == k);
  }

  // result += the change of dW/dF with that of F.
  void add_change(const double change[3][3], double result[3][3]) const {
    // T moves along its axes with the logarithms, and between two axes as these turn.
    double half[3][3], across[3][3], moved[3][3], turned[3][3];
    multiply_transposed(change, f_, half);  // dF^T F
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) moved[i][k] = half[i][k] + half[k][i];
    multiply(moved, of_.axis, half), multiply_transposed(of_.axis, half, across);
    double along[3], mean = 0, mean_slope = 0;
    for (int n = 0; n < 3; ++n) mean += (along[n] = across[n][n] / (2 * of_.square[n])) / 3;
    for (int n = 0; n < 3; ++n) mean_slope += (along[n] = curve_[n] * (along[n] - mean)) / 3;
    for (int m = 0; m < 3; ++m)
      for (int n = 0; n < 3; ++n) turned[m][n] = m == n ? along[n] - mean_slope : turn_[m][n] * across[m][n];
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        moved[i][k] = 0;
        for (int m = 0; m < 3; ++m)
          for (int n = 0; n < 3; ++n) moved[i][k] += of_.axis[i][m] * turned[m][n] * of_.axis[k][n];
      }
    // d(F^-T) = -F^-T dF^T F^-T
    multiply(inverse_, t_, half), multiply_transposed(change, half, across);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) moved[i][k] -= across[i][k];
    multiply(inverse_, moved, half);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) result[i][k] += half[i][k];
  }

 private:
  void add_term(double shear, double exponent) {
    for (int m = 0; m < 3; ++m) {
      const double power = 1 + exponential_minus_one_of(exponent * of_.logarithm[m]);
      curve_[m] += 2 * shear * power;
      for (int n = 0; n < 3; ++n) {
        // (slope_n - slope_m) / (square_n - square_m), and its limit where both are equal.
        const double apart = of_.logarithm[n] - of_.logarithm[m];
        turn_[m][n] += apart == 0 ? shear * power / of_.square[m]
                                  : 2 * shear / exponent * power * exponential_minus_one_of(exponent * apart) /
                                        (of_.square[m] * exponential_minus_one_of(2 * apart));
      }
    }
  }
  static double exponential_minus_one_of(double x) { return exponential_rests(held_power(x)).of_one; }
  static void multiply(const double a[3][3], const double b[3][3], double result[3][3]) {
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) result[i][k] = a[i][0] * b[0][k] + a[i][1] * b[1][k] + a[i][2] * b[2][k];
  }
  static void multiply_transposed(const double a[3][3], const double b[3][3], double result[3][3]) {
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) result[i][k] = a[0][i] * b[0][k] + a[1][i] * b[1][k] + a[2][i] * b[2][k];
  }

  PrincipalStrains<double> of_ = {};
  double t_[3][3] = {}, inverse_[3][3] = {}, f_[3][3] = {};
  double curve_[3] = {}, turn_[3][3] = {};  // d slope / d logarithm; what turns T
};

}  // namespace palpate
