#include "studies/validation/manufactured.h"

#include <cmath>
#include <numbers>

namespace palpate::validation {
namespace {
constexpr double pi = std::numbers::pi;
}

Manufactured::Manufactured(const Material& material, double pressure)
    : mu_(shear_modulus(material)),
      lambda_(2 * mu_ * material.poisson / (1 - 2 * material.poisson)),
      share_(pressure * mu_ / lambda_) {}

Vector3d Manufactured::displacement(const Vector3d& p) const {
  const Vector3d s = (pi * p).array().sin(), c = (pi * p).array().cos();
  return {s[0] * c[1] * s[2] + share_ * s[0] * s[1] * s[2], -c[0] * s[1] * s[2], 0};
}

Matrix3d Manufactured::gradient(const Vector3d& p) const {
  const Vector3d s = (pi * p).array().sin(), c = (pi * p).array().cos();
  Matrix3d g;
  g << c[0] * c[1] * s[2] + share_ * c[0] * s[1] * s[2], -s[0] * s[1] * s[2] + share_ * s[0] * c[1] * s[2],
      s[0] * c[1] * c[2] + share_ * s[0] * s[1] * c[2], s[0] * s[1] * s[2], -c[0] * c[1] * s[2], -c[0] * s[1] * c[2], 0,
      0, 0;
  return pi * g;
}

// -div sigma = -(lambda + mu) grad div u - mu laplace u
Vector3d Manufactured::force(const Vector3d& p) const {
  const Vector3d s = (pi * p).array().sin(), c = (pi * p).array().cos();
  const Vector3d dilatation(s[0] * s[1] * s[2], -c[0] * c[1] * s[2], -c[0] * s[1] * c[2]);
  return pi * pi * ((lambda_ + mu_) * share_ * dilatation + 3 * mu_ * displacement(p));
}

}  // namespace palpate::validation
