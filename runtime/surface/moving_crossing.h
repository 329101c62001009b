// Where a moving point passes through a moving triangle.
#pragma once

#include "runtime/base/vec3.h"

namespace palpate {

struct MovingCrossing {
  double time = 0;  // 0 where the point was, 1 where it is
  bool entering = false;
  double barycentric[3] = {};
};

// The crossings of a point that moves from p0 to p1 while the corners move from a0[3] to a1[3], all along straight lines at
// constant speed. A triangle's outer side is the one from which its corners run counter-clockwise. A crossing through an edge
// or a corner counts for every triangle there. Returns the number of crossings, 0 to 3, in order of time.
// Source: Provot 1997, Collision and self-collision handling in cloth model: the roots of the volume of the four points, a cubic.
// Rounding: a crossing within about 1e-9 of the triangle's size from its border may be found or not.
int moving_crossings(Vec3 p0, Vec3 p1, const Vec3 a0[3], const Vec3 a1[3], MovingCrossing found[3]);

}  // namespace palpate
