// Closed-form solutions of linear elasticity. SI units; a half-space is z >= 0.
#pragma once

#include <Eigen/Dense>
#include <functional>

#include "precompute/elements/elastic_body.h"

namespace palpate::validation {

using Eigen::Matrix3d;
using Eigen::Vector3d;

double shear_modulus(const Material& material);
double plane_modulus(const Material& material);  // E / (1 - nu^2)

// d u_i / d x_j of a displacement field, by central differences over a step (m). Relative error: the square of the step over
// the length on which the field changes.
Matrix3d gradient_of(const std::function<Vector3d(const Vector3d&)>& displacement, const Vector3d& x, double step);

// Hooke's stress of a displacement field, by differences over 1e-5 of the distance from the origin; relative error 1e-10.
Matrix3d stress_of(const Material& material, const std::function<Vector3d(const Vector3d&)>& displacement,
                   const Vector3d& x);

// The thick sphere inner <= r <= outer under pressure inside: u = (A + B / r^3) x. Lame; Timoshenko and Goodier, Theory of
// Elasticity, 3rd ed., art. 136.
struct ThickSphere {
  double inner, outer, pressure;
  Material material;

  Vector3d displacement(const Vector3d& x) const;
  Matrix3d gradient(const Vector3d& x) const;  // d u_i / d x_j
  double radial(double r) const;               // u at radius r
};

// A point force (N) at the origin towards +z. Boussinesq; Johnson, Contact Mechanics, eq. 3.18.
Vector3d point_load(const Material& material, double force, const Vector3d& x);

// A rigid flat circular punch without friction, pressed in by depth: F = 2 E a d / (1 - nu^2). Boussinesq; Johnson,
// eq. 3.36; inside, Sneddon 1946 (Proc. Camb. Phil. Soc. 42).
struct FlatPunch {
  double radius, depth;
  Material material;

  double force() const;
  Vector3d displacement(const Vector3d& x) const;  // everywhere
  Matrix3d gradient(const Vector3d& x) const;      // d u_i / d x_j; infinite on the edge
};

// A rigid sphere (its paraboloid) pressed in by depth, without friction: F = 4/3 E* sqrt(R) d^1.5, contact radius sqrt(R d).
// Hertz; Johnson, eq. 4.22 to 4.24.
struct HertzSphere {
  double radius, depth;
  Material material;

  double force() const;
  double contact_radius() const;
  Vector3d displacement(const Vector3d& x) const;  // valid from two contact radii outwards
};

// A cantilever of square section under a force at its end: P L^3 / (3 E I) + P L / (k G A), k by Cowper 1966 (J. Appl. Mech. 33).
// Timoshenko's beam theory, which differs from elasticity at the clamped end.
struct Cantilever {
  double length, width, force;
  Material material;

  double tip() const;
};

// A cylinder pressed between plates without friction; its strain is uniform. The paper's section 6.1.
struct PressedCylinder {
  double radius, height, pressed;
  Material material;

  double force(double area) const;  // of a section of that area
  Vector3d displacement(const Vector3d& x) const;
};

// sigma_yy at point D of the thick elliptic plate LE10 of NAFEMS, The Standard NAFEMS Benchmarks, 1990: three digits.
inline constexpr double kLe10Stress = -5.38e6;

}  // namespace palpate::validation
