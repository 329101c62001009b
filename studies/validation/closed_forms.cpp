#include "studies/validation/closed_forms.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace palpate::validation {
namespace {

using std::numbers::pi;

}  // namespace

double plane_modulus(const Material& m) {
  return m.young / (1 - m.poisson * m.poisson);
}

double shear_modulus(const Material& material) {
  return material.young / (2 * (1 + material.poisson));
}

Matrix3d gradient_of(const std::function<Vector3d(const Vector3d&)>& displacement, const Vector3d& x, double step) {
  Matrix3d gradient;
  for (int j = 0; j < 3; ++j) {
    const Vector3d aside = step * Vector3d::Unit(j);
    gradient.col(j) = (displacement(x + aside) - displacement(x - aside)) / (2 * step);
  }
  return gradient;
}

Matrix3d stress_of(const Material& material, const std::function<Vector3d(const Vector3d&)>& displacement,
                   const Vector3d& x) {
  const double mu = shear_modulus(material);
  const Matrix3d gradient = gradient_of(displacement, x, 1e-5 * x.norm());
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
// The integral of Hertz' solution below with a constant weight, in closed form: with R = sqrt(r^2 + (z + i a)^2), the
// derivatives of the potentials are imaginary parts of R, 1 / R and (z + i a) / R.
Vector3d FlatPunch::displacement(const Vector3d& x) const {
  const double r2 = x[0] * x[0] + x[1] * x[1], r = std::sqrt(r2), z = x[2], a = radius, nu = material.poisson;
  const std::complex<double> depth_of_source(z, a), distance = std::sqrt(r2 + depth_of_source * depth_of_source);
  const double potential = std::asin(std::min(1.0, 2 * a / (std::hypot(r + a, z) + std::hypot(r - a, z))));
  const double outward = -(1 - 2 * nu) * (a - distance.imag()) + z * (depth_of_source / distance).imag();
  const double down = 2 * (1 - nu) * potential - z * (1.0 / distance).imag();
  const double scale = force() / (4 * pi * a * shear_modulus(material)), along = r2 > 0 ? outward / r2 : 0;
  return scale * Vector3d(along * x[0], along * x[1], down);
}
Matrix3d FlatPunch::gradient(const Vector3d& x) const {
  const double from_edge = std::hypot(std::hypot(x[0], x[1]) - radius, x[2]);
  return gradient_of([this](const Vector3d& place) { return displacement(place); }, x, 1e-5 * from_edge);
}

double HertzSphere::force() const {
  return 4.0 / 3 * plane_modulus(material) * std::sqrt(radius) * std::pow(depth, 1.5);
}
double HertzSphere::contact_radius() const {
  return std::sqrt(radius * depth);
}
// The pressure of a round indenter as point loads on the axis at imaginary depths i s, |s| <= a, each with a weight: the
// real part of 1 / sqrt(r^2 - s^2) is zero outside r = |s|. The displacement follows from point_load with z + i s in its
// potentials. Away from the contact the integrand is smooth: at two radii, eight Gauss points reach rounding.
Vector3d HertzSphere::displacement(const Vector3d& x) const {
  constexpr double at[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
  constexpr double share[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
  const double a = contact_radius(), r2 = x[0] * x[0] + x[1] * x[1], z = x[2], nu = material.poisson;
  double along = 0, down = 0;  // u_r / r and u_z; s and -s are conjugate
  for (int k = 0; k < 4; ++k) {
    const std::complex<double> depth_of_source(z, a * at[k]),
        distance = std::sqrt(r2 + depth_of_source * depth_of_source);
    const std::complex<double> cube = distance * distance * distance;
    const double weight = 1.5 * share[k] * force() * (1 - at[k] * at[k]);
    along += weight * (z / cube - (1 - 2 * nu) / (distance * (distance + depth_of_source))).real();
    down += weight * (2 * (1 - nu) / distance + z * depth_of_source / cube).real();
  }
  const double scale = 1 / (4 * pi * shear_modulus(material));
  return scale * Vector3d(along * x[0], along * x[1], down);
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
