#include "runtime/contact/disc_compliance.h"

#include <algorithm>

namespace palpate {
namespace {

constexpr double kHalfPi = 1.57079632679489661923;

// 1/m; 1/m^3 of two gradients. rho: m, pi / 2 times the way from b's place to a's; along: m^2, rho^2.
double answer(const ContactDisc& a, const ContactDisc& b, double radius, Vec3 rho, double along) {
  const double root = 1 / std::sqrt(radius * radius + along);
  if (!is_gradient(a)) return root;
  const double p = root * root * root;
  return p * (dot(a.gradient, b.gradient) - 3 * root * root * (dot(a.gradient, rho) * dot(b.gradient, rho)));
}

// Of discs that the mesh shows as ones of radius `wide`.
double unresolved(const ContactDisc& a, const ContactDisc& b, double radius, double wide, Vec3 rho, double along) {
  return radius < wide ? answer(a, b, radius, rho, along) - answer(a, b, wide, rho, along) : 0;
}

}  // namespace

ContactDisc in_frame(const ContactDisc& disc, const Mat3& frame) {
  ContactDisc turned = disc;
  turned.normal_root = frame * disc.normal_root, turned.tangent_root = frame * disc.tangent_root;
  return turned;
}

ContactDisc opposite(const ContactDisc& disc) {
  ContactDisc turned = disc;
  turned.normal_root = -1 * disc.normal_root, turned.tangent_root = Mat3{};
  add_scaled(turned.tangent_root, -1, disc.tangent_root);
  return turned;
}

Mat3 compliance_between(const ContactDisc& a, const ContactDisc& b) {
  if (is_gradient(a) != is_gradient(b)) return {};
  const double radius = std::max(a.radius, b.radius), same = 0.5 * (1 + dot(a.outward, b.outward)), fold = same * same;
  const Vec3 apart = a.place - b.place, rho = kHalfPi * apart;
  const double along = kHalfPi * kHalfPi * dot(apart, apart),
               normal = fold * unresolved(a, b, radius, std::min(a.wide[0], b.wide[0]), rho, along),
               tangent = fold * unresolved(a, b, radius, std::min(a.wide[1], b.wide[1]), rho, along);
  Mat3 sum;
  add_scaled(sum, tangent, times_transposed(a.tangent_root, b.tangent_root));
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) sum.m[i][j] += normal * (a.normal_root[i] * b.normal_root[j]);
  return sum;
}

}  // namespace palpate
