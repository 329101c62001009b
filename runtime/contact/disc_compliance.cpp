#include "runtime/contact/disc_compliance.h"

#include <algorithm>

namespace palpate {
namespace {

constexpr double kHalfPi = 1.57079632679489661923;

// 1/m. along: m^2, (pi d / 2)^2.
double unresolved(double a, double wide, double along) {
  return a < wide ? 1 / std::sqrt(a * a + along) - 1 / std::sqrt(wide * wide + along) : 0;
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
  const double radius = std::max(a.radius, b.radius), same = 0.5 * (1 + dot(a.outward, b.outward)), fold = same * same;
  const Vec3 apart = a.place - b.place;
  const double along = kHalfPi * kHalfPi * dot(apart, apart),
               normal = fold * unresolved(radius, std::min(a.wide[0], b.wide[0]), along),
               tangent = fold * unresolved(radius, std::min(a.wide[1], b.wide[1]), along);
  Mat3 sum;
  add_scaled(sum, tangent, times_transposed(a.tangent_root, b.tangent_root));
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) sum.m[i][j] += normal * (a.normal_root[i] * b.normal_root[j]);
  return sum;
}

}  // namespace palpate
