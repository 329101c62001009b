// The deformation gradient F = I + H of one tetrahedron, and what isotropic laws ask of it. All of it comes from the displacement
// gradient H: near rest, F itself would lose the strain to rounding in single precision.
#pragma once

#include "runtime/large/lanes.h"

namespace palpate {

template <class Real>
struct Deformation {
  Real h[3][3];    // H, displacement gradient
  Real cof[3][3];  // of F, less the identity: cof F = I + cof
  Real j;          // J - 1, relative change of volume
  Real excess;     // |F|^2 - 3 - 2 (J - 1): zero at rest with its first derivatives
};

// h is filled in.
template <class Real>
PALPATE_INLINE void complete(Deformation<Real>& d) {
  const auto& h = d.h;
  const Real trace = h[0][0] + h[1][1] + h[2][2];
  Real square = Real{};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      // cof F = I + (tr H) I - H^T + cof H
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, k1 = (k + 1) % 3, k2 = (k + 2) % 3;
      d.cof[i][k] = h[i1][k1] * h[i2][k2] - h[i1][k2] * h[i2][k1];
      square = square + h[i][k] * h[i][k];
    }
  const Real minors = d.cof[0][0] + d.cof[1][1] + d.cof[2][2];
  const Real determinant = h[0][0] * d.cof[0][0] + h[0][1] * d.cof[0][1] + h[0][2] * d.cof[0][2];
  d.j = trace + (minors + determinant);
  d.excess = square - 2 * (minors + determinant);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) d.cof[i][k] = d.cof[i][k] - h[k][i] + (i == k ? trace : Real{});
}

// An isotropic law W(I, J), I = |F|^2, of one deformation. along: 2 dW/dI, and rest: 2 dW/dI + dW/dJ, which is zero at rest.
template <class Real>
struct LawValue {
  Real energy;  // Pa, of a unit volume at rest
  Real along, rest;
};
// Its second derivatives, Pa.
struct LawSecond {
  double ii, ij, jj;
};

// First Piola-Kirchhoff stress: dW/dF = 2 dW/dI F + dW/dJ cof F. pressure: dW/dJ of a part that the law leaves out.
template <class Real>
PALPATE_INLINE void stress_of(const Deformation<Real>& d, const LawValue<Real>& law, const Real& pressure,
                              Real stress[3][3]) {
  const Real across = law.rest - law.along + pressure, identity = law.rest + pressure;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      stress[i][k] = law.along * d.h[i][k] + across * d.cof[i][k] + (i == k ? identity : Real{});
}

// d stress / dF : change.
inline void stress_change(const Deformation<double>& d, const LawValue<double>& law, const LawSecond& second,
                          double pressure, const double change[3][3], double result[3][3]) {
  double f[3][3], c[3][3], on_f = 0, on_c = 0;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      f[i][k] = d.h[i][k] + (i == k), c[i][k] = d.cof[i][k] + (i == k);
      on_f += 2 * f[i][k] * change[i][k], on_c += c[i][k] * change[i][k];
    }
  const double across = law.rest - law.along + pressure;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      // The change of cof F: F and the change take turns in its products.
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, k1 = (k + 1) % 3, k2 = (k + 2) % 3;
      const double cof_change = f[i1][k1] * change[i2][k2] + change[i1][k1] * f[i2][k2] - f[i1][k2] * change[i2][k1] -
                                change[i1][k2] * f[i2][k1];
      result[i][k] = law.along * change[i][k] + across * cof_change +
                     2 * f[i][k] * (second.ii * on_f + second.ij * on_c) +
                     c[i][k] * (second.ij * on_f + second.jj * on_c);
    }
}

}  // namespace palpate
