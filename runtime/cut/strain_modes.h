// The strain of a gradient in six parts, each of which has a stiffness of its own: the change of volume, and five of shape.
#pragma once

#include "runtime/base/vec3.h"

namespace palpate {

inline constexpr int kStrainModes = 6;

// A displacement u with the gradient g (u g^T) has the strain u . strain_mode(m, g) in mode m. Mode 0 is the change of volume; modes 1 to 5
// are an orthonormal basis of deviatoric strain. An isotropic tissue of volume V has the stiffness V (bulk in mode 0, twice the shear modulus
// in the others).
inline Vec3 strain_mode(int m, Vec3 g) {
  constexpr double kHalf = 0.70710678118654752440, kSixth = 0.40824829046386301637;  // square roots of 1/2 and 1/6
  switch (m) {
    case 0:
      return g;
    case 1:
      return {0, kHalf * g.z, kHalf * g.y};
    case 2:
      return {kHalf * g.z, 0, kHalf * g.x};
    case 3:
      return {kHalf * g.y, kHalf * g.x, 0};
    case 4:
      return {kHalf * g.x, -kHalf * g.y, 0};
    default:
      return {kSixth * g.x, kSixth * g.y, -2 * kSixth * g.z};
  }
}

}  // namespace palpate
