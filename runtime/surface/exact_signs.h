// On which side of a plane or an edge a point lies: exact for the given doubles, so that rounding decides nothing.
//
// Source: Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates, 1997: a floating-point
// filter first, then exact sums of doubles whose digits do not overlap.
#pragma once

#include "runtime/base/vec3.h"

namespace palpate {

// to - from, not yet rounded.
struct Difference {
  Vec3 to, from;
  Vec3 rounded() const { return to - from; }
};

inline double largest_of(Vec3 v) {
  const double x = std::fabs(v.x), y = std::fabs(v.y), z = std::fabs(v.z), xy = x > y ? x : y;
  return xy > z ? xy : z;
}

inline int sign_of(double x) {
  return (x > 0) - (x < 0);
}

// Sign of the determinant with the rows a, b and c. Exact while no product of three entries underflows, so for entries above
// 1e-80. Cost: a few microseconds.
int exact_sign_of_determinant(const Difference& a, const Difference& b, const Difference& c);

// The same in plain arithmetic: 0 where rounding could change the sign. Cost: a few nanoseconds.
inline int plain_sign_of_determinant(const Difference& a, const Difference& b, const Difference& c) {
  const Vec3 u = a.rounded(), v = b.rounded(), w = c.rounded();
  const double determinant = dot(cross(u, v), w);
  // Error bound: six products, each rounded at most eight times: 6 x 8 x 1.1e-16 of the largest possible product.
  return std::fabs(determinant) > 1e-14 * largest_of(u) * largest_of(v) * largest_of(w) ? sign_of(determinant) : 0;
}

// Sides of planes and edges. Where a point lies exactly on one, the tie is broken as if every point p that is asked about were at
// p + (e, e^2, e^3) with an infinitely small e. All answers then belong to one consistent geometry: a closed surface has no
// gap, and no crossing of an edge counts twice.
int exact_side_of_plane(Vec3 a, Vec3 b, Vec3 c, Vec3 p);
int exact_side_of_edge(Vec3 a, Vec3 b, Vec3 p, Vec3 q);

// The side of the plane through a, b, c on which p lies: +1 above, -1 below; 0 for a triangle without area alone.
inline int side_of_plane(Vec3 a, Vec3 b, Vec3 c, Vec3 p) {
  const int plain = plain_sign_of_determinant({b, a}, {c, a}, {p, a});
  return plain ? plain : exact_side_of_plane(a, b, c, p);
}

// The sense in which the line from p to q passes the edge from a to b: +1 or -1; 0 for an edge without length or along the line.
inline int side_of_edge(Vec3 a, Vec3 b, Vec3 p, Vec3 q) {
  const int plain = plain_sign_of_determinant({a, p}, {b, a}, {q, p});
  return plain ? plain : exact_side_of_edge(a, b, p, q);
}

}  // namespace palpate
