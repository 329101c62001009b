// Principal axes and logarithmic strains of a deformation, by Jacobi's rotations. They use the four operations alone, as all laws do,
// so that every platform computes the same bits, and give each lane the same number of rotations.
#pragma once

#include <limits>

#include "runtime/large/deformation.h"
#include "runtime/large/small_strain.h"

namespace palpate {

// Squares of principal stretches that laws are asked for: stretches from 1/50 to 54.
inline constexpr double kLeastSquare = 4e-4, kMostSquare = 3000;

template <class Real>
struct PrincipalStrains {
  Real axis[3][3];    // axis[i][n]: component i of axis n, in the body at rest
  Real square[3];     // of the principal stretches, held within the limits above
  Real logarithm[3];  // of the stretches, less their mean: what changes the shape
  Real beyond;        // by how much the squares were beyond the limits: 0 where none was
};

// tan(atan(r / (1 - r)) / 4), for r from 0 to 1, to three digits.
template <class Real>
PALPATE_INLINE Real rough_quarter_tangent(const Real& r) {
  using Number = Scalar<Real>;
  constexpr Number c[] = {Number(0.25025), Number(0.23875),  Number(0.23353),
                          Number(0.07267), Number(-0.88709), Number(0.50651)};
  return r * (c[0] + r * (c[1] + r * (c[2] + r * (c[3] + r * (c[4] + r * c[5])))));
}

// Turns axes p and q so that a[p][q] falls to 1e-3 of itself or less. The rotation is exact, as its sine and cosine belong together;
// its angle is rough, which later rotations make up for.
template <class Real>
PALPATE_INLINE void rotate_axes(Real a[3][3], Real axis[3][3], int p, int q) {
  using Number = Scalar<Real>;
  constexpr Number tiny = sizeof(Number) == 4 ? Number(1e-30) : Number(1e-200);
  const int r = 3 - p - q;
  const Real twice = 2 * a[p][q], difference = a[p][p] - a[q][q], zero = Real{};
  const Real of_twice = magnitude(twice), of_both = of_twice + magnitude(difference) + tiny;
  const Real quarter = rough_quarter_tangent<Real>(of_twice / of_both);
  // The tangent of half the angle, which tan(2 angle) = twice / difference gives; the angle is between -pi/4 and pi/4.
  const Real half = (difference < zero ? -twice : twice) < zero ? -quarter : quarter;
  const Real scale = 1 / (1 + half * half), cosine = (1 - half * half) * scale, sine = 2 * half * scale;
  const Real moved = sine * (cosine * twice - sine * difference);
  a[p][p] = a[p][p] + moved, a[q][q] = a[q][q] - moved;
  a[p][q] = a[q][p] = Number(0.5) * (cosine * cosine - sine * sine) * twice - cosine * sine * difference;
  const Real on_p = a[r][p], on_q = a[r][q];
  a[r][p] = a[p][r] = cosine * on_p + sine * on_q;
  a[r][q] = a[q][r] = cosine * on_q - sine * on_p;
  for (int i = 0; i < 3; ++i) {
    const Real along_p = axis[i][p], along_q = axis[i][q];
    axis[i][p] = cosine * along_p + sine * along_q;
    axis[i][q] = cosine * along_q - sine * along_p;
  }
}

template <class Real>
PALPATE_INLINE PrincipalStrains<Real> principal_strains(const Deformation<Real>& d) {
  using Number = Scalar<Real>;
  constexpr int sweeps = sizeof(Number) == 4 ? 4 : 6;
  const auto& h = d.h;
  PrincipalStrains<Real> of;
  Real a[3][3];  // C - I = H + H^T + H^T H
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      a[i][k] = (h[i][k] + h[k][i]) + (h[0][i] * h[0][k] + h[1][i] * h[1][k] + h[2][i] * h[2][k]);
      of.axis[i][k] = Real{} + Number(i == k);
    }
  PALPATE_ROLLED
  for (int s = 0; s < 3 * sweeps; ++s) rotate_axes(a, of.axis, s % 3 == 2, s % 3 == 0 ? 1 : 2);
  of.beyond = Real{};
  PALPATE_ROLLED
  for (int n = 0; n < 3; ++n) {
    const Real least = Real{} + Number(kLeastSquare - 1), most = Real{} + Number(kMostSquare - 1);
    const Real held = smaller(larger(a[n][n], least), most);
    of.beyond = of.beyond + magnitude<Real>(a[n][n] - held);
    of.square[n] = 1 + held;
    of.logarithm[n] = Number(0.5) * logarithm_of_one_plus(held);
  }
  const Real mean = (of.logarithm[0] + of.logarithm[1] + of.logarithm[2]) * (Number(1) / 3);
  for (Real& logarithm : of.logarithm) logarithm = logarithm - mean;
  return of;
}

// sum over n of value[n] times the square of axis n.
template <class Real>
PALPATE_INLINE void tensor_of(const PrincipalStrains<Real>& of, const Real value[3], Real tensor[3][3]) {
  for (int i = 0; i < 3; ++i)
    for (int k = i; k < 3; ++k)
      tensor[i][k] = tensor[k][i] = value[0] * of.axis[i][0] * of.axis[k][0] +
                                    value[1] * of.axis[i][1] * of.axis[k][1] + value[2] * of.axis[i][2] * of.axis[k][2];
}

}  // namespace palpate
