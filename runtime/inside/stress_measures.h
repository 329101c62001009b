// What is read off a symmetric tensor of three by three, such as a stress. Its six numbers are xx yy zz xy yz xz.
#pragma once

#include <algorithm>
#include <cmath>

#include "runtime/base/arcsine.h"
#include "runtime/base/sine.h"

namespace palpate {

constexpr int kTensorNumbers = 6;

// Pa, above zero under compression.
inline double pressure_of(const double* stress) {
  return -(stress[0] + stress[1] + stress[2]) / 3;
}

// Pa: the stress along one axis that distorts as much.
inline double von_mises_of(const double* stress) {
  const double a = stress[0] - stress[1], b = stress[1] - stress[2], c = stress[2] - stress[0];
  const double shear = stress[3] * stress[3] + stress[4] * stress[4] + stress[5] * stress[5];
  return std::sqrt(0.5 * (a * a + b * b + c * c) + 3 * shear);
}

// The eigenvalues, largest first, in closed form. Error: 1e-7 of the part that distorts, from arcsine.h, and
// 1e-12 of the whole where two of them meet.
// Source: Smith 1961, Eigenvalues of a symmetric 3 x 3 matrix, Communications of the ACM 4(4), 168.
inline void principal_of(const double* tensor, double* values) {
  const double mean = (tensor[0] + tensor[1] + tensor[2]) / 3;
  const double x = tensor[0] - mean, y = tensor[1] - mean, z = tensor[2] - mean;
  const double xy = tensor[3], yz = tensor[4], xz = tensor[5];
  const double p = std::sqrt((x * x + y * y + z * z + 2 * (xy * xy + yz * yz + xz * xz)) / 6);
  values[0] = values[1] = values[2] = mean;
  if (!(p > 0)) return;
  const double determinant = x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz);
  const double half = std::clamp(determinant / (2 * p * p * p), -1.0, 1.0);
  constexpr double quarter_turn = 1.5707963267948966;
  const double angle = (quarter_turn - std::copysign(arcsine(std::fabs(half)), half)) / 3;
  const SineCosine turned = sine_cosine(angle);
  const double root = 0.5 * std::sqrt(3.0);
  const double most = 2 * p * turned.cosine, least = -p * (turned.cosine + 2 * root * turned.sine);
  values[0] = mean + most;
  values[1] = mean - most - least;
  values[2] = mean + least;
}

}  // namespace palpate
