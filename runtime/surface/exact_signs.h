// On which side of a plane or an edge: exact for the given doubles, so that rounding decides nothing.
//
// Source: the filter, and sums of doubles that do not overlap, are Shewchuk's (Adaptive precision floating-point
// arithmetic, 1997).
#pragma once

#include "runtime/base/vec3.h"

namespace palpate {

// to - from, before it is rounded.
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

// Sign of the determinant whose rows are a, b and c. Exact while no product of three entries underflows: entries above
// 1e-80. Cost: a microsecond or a few.
int exact_sign_of_determinant(const Difference& a, const Difference& b, const Difference& c);

// The same where rounding cannot change the sign, else 0: a few nanoseconds.
inline int plain_sign_of_determinant(const Difference& a, const Difference& b, const Difference& c) {
  const Vec3 u = a.rounded(), v = b.rounded(), w = c.rounded();
  const double determinant = dot(cross(u, v), w);
  // Six products, each rounded at most eight times: 6 x 8 x 1.1e-16 of the largest there could be.
  return std::fabs(determinant) > 1e-14 * largest_of(u) * largest_of(v) * largest_of(w) ? sign_of(determinant) : 0;
}

// Sides of planes and edges. Ties are broken as if every point p that is asked about stood at p + (e, e^2, e^3) for an
// infinitely small e. What is asked of two points is then never contradicted by a third: a closed surface has no gap and
// no double edge.

int exact_side_of_plane(Vec3 a, Vec3 b, Vec3 c, Vec3 p);
int exact_side_of_edge(Vec3 a, Vec3 b, Vec3 p, Vec3 q);
int exact_side_of_edge_from_above(Vec3 a, Vec3 b, Vec3 p);

// Which side of the plane of a b c: +1 above, -1 below; 0 only for a triangle without area.
inline int side_of_plane(Vec3 a, Vec3 b, Vec3 c, Vec3 p) {
  const int plain = plain_sign_of_determinant({b, a}, {c, a}, {p, a});
  return plain ? plain : exact_side_of_plane(a, b, c, p);
}

// How the line from p to q turns about the edge from a to b; 0 only for an edge without length or along the line.
inline int side_of_edge(Vec3 a, Vec3 b, Vec3 p, Vec3 q) {
  const int plain = plain_sign_of_determinant({a, p}, {b, a}, {q, p});
  return plain ? plain : exact_side_of_edge(a, b, p, q);
}

// The same for the line from p along +z.
inline int side_of_edge_from_above(Vec3 a, Vec3 b, Vec3 p) {
  const Vec3 u = a - p, v = b - p;
  const double left = u.x * v.y, right = u.y * v.x;
  // Four roundings.
  if (std::fabs(left - right) > 1e-15 * (std::fabs(left) + std::fabs(right))) return sign_of(left - right);
  return exact_side_of_edge_from_above(a, b, p);
}

}  // namespace palpate
