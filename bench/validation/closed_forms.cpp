#include "bench/validation/closed_forms.h"

#include <cmath>
#include <complex>
#include <numbers>

namespace palpate::validation {
namespace {

using std::numbers::pi;

double plane_modulus(const Material& m) {
  return m.young / (1 - m.poisson * m.poisson);
}

// Point loads on the axis at imaginary depths i s, |s| <= a, with a weight each: the pressure of an indenter of contact
// radius a, since the real part of 1 / sqrt(r^2 - s^2) is there only inside r = |s|. Displacements follow from point_load
// with z + i s in its potentials. Smooth away from the contact: eight Gauss points reach rounding at two radii.
template <class Weight>
Vector3d indenter(const Material& material, double a, const Weight& weight, const Vector3d& x) {
  constexpr double at[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
  constexpr double share[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
  const double r2 = x[0] * x[0] + x[1] * x[1], z = x[2], nu = material.poisson;
  double along = 0, down = 0;  // u_r / r and u_z; s and -s are conjugate
  for (int k = 0; k < 4; ++k) {
    const std::complex<double> depth(z, a * at[k]), distance = std::sqrt(r2 + depth * depth);
    const double w = 2 * a * share[k] * weight(a * at[k]);
    along += w * (z / (distance * distance * distance) - (1 - 2 * nu) / (distance * (distance + depth))).real();
    down += w * (2 * (1 - nu) / distance + z * depth / (distance * distance * distance)).real();
  }
  const double scale = 1 / (4 * pi * shear_modulus(material));
  return scale * Vector3d(along * x[0], along * x[1], down);
}

}  // namespace

double shear_modulus(const Material& material) {
  return material.young / (2 * (1 + material.poisson));
}

Matrix3d stress_of(const Material& material, const std::function<Vector3d(const Vector3d&)>& displacement,
                   const Vector3d& x) {
  const double step = 1e-5 * x.norm(), mu = shear_modulus(material);
  Matrix3d gradient;
  for (int j = 0; j < 3; ++j) {
    const Vector3d aside = step * Vector3d::Unit(j);
    gradient.col(j) = (displacement(x + aside) - displacement(x - aside)) / (2 * step);
  }
  const double lambda = 2 * mu * material.poisson / (1 - 2 * material.poisson);
  return lambda * gradient.trace() * Matrix3d::Identity() + mu * (gradient + gradient.transpose());
}

// ---- the thick sphere ----

namespace {
struct SphereConstants {
  double stretch, source;  // A and B
};
SphereConstants constants_of(const ThickSphere& s) {
  const double a3 = std::pow(s.inner, 3), b3 = std::pow(s.outer, 3), nu = s.material.poisson;
  const double scale = s.pressure * a3 / (s.material.young * (b3 - a3));
  return {scale * (1 - 2 * nu), scale * (1 + nu) * b3 / 2};
}
}  // namespace

Vector3d ThickSphere::displacement(const Vector3d& x) const {
  return radial(x.norm()) * x.normalized();
}
Matrix3d ThickSphere::gradient(const Vector3d& x) const {
  const auto [stretch, source] = constants_of(*this);
  const double r = x.norm();
  const Vector3d out = x / r;
  return stretch * Matrix3d::Identity() + source / (r * r * r) * (Matrix3d::Identity() - 3 * out * out.transpose());
}
double ThickSphere::radial(double r) const {
  const auto [stretch, source] = constants_of(*this);
  return stretch * r + source / (r * r);
}

// ---- half-spaces ----

Vector3d point_load(const Material& material, double force, const Vector3d& x) {
  const double z = x[2], distance = x.norm(), nu = material.poisson;
  const double scale = force / (4 * pi * shear_modulus(material) * distance);
  const double along = scale * (z / (distance * distance) - (1 - 2 * nu) / (distance + z));  // u_r / r
  return {along * x[0], along * x[1], scale * (2 * (1 - nu) + z * z / (distance * distance))};
}

double FlatPunch::force() const {
  return 2 * plane_modulus(material) * radius * depth;
}
Vector3d FlatPunch::displacement(const Vector3d& x) const {
  return indenter(
      material, radius, [this](double) { return force() / (2 * radius); }, x);
}

double HertzSphere::force() const {
  return 4.0 / 3 * plane_modulus(material) * std::sqrt(radius) * std::pow(depth, 1.5);
}
double HertzSphere::contact_radius() const {
  return std::sqrt(radius * depth);
}
Vector3d HertzSphere::displacement(const Vector3d& x) const {
  const double a = contact_radius();
  return indenter(
      material, a, [&](double s) { return 0.75 * force() * (a * a - s * s) / (a * a * a); }, x);
}

// ---- beams and cylinders ----

double Cantilever::tip() const {
  const double nu = material.poisson, area = width * width, inertia = area * area / 12;
  const double kappa = 10 * (1 + nu) / (12 + 11 * nu);
  return force * std::pow(length, 3) / (3 * material.young * inertia) +
         force * length / (kappa * shear_modulus(material) * area);
}

double PressedCylinder::force(double area) const {
  return material.young * area * pressed / height;
}
Vector3d PressedCylinder::displacement(const Vector3d& x) const {
  const double strain = pressed / height, widen = material.poisson * strain;
  return {widen * x[0], widen * x[1], -strain * x[2]};
}

}  // namespace palpate::validation
