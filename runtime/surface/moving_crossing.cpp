#include "runtime/surface/moving_crossing.h"

#include "runtime/surface/surface_index.h"

namespace palpate {
namespace {

// Share of the triangle's size by which a crossing may lie beyond its border, so that no rounding opens a gap between neighbours.
constexpr double kBorder = 1e-9;

// c[0] + c[1] t + c[2] t^2 + c[3] t^3.
struct Cubic {
  double c[4];
  double at(double t) const { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); }
};

// The root between low and high, where the cubic is monotone and changes its sign, by bisection. 60 halvings reach the rounding
// of t, in the same bits everywhere.
double root_between(const Cubic& f, double low, double high) {
  const bool rises = f.at(low) < f.at(high);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) break;
    ((f.at(middle) < 0) == rises ? low : high) = middle;
  }
  return high;
}

// The ends of the intervals of [0, 1] in which the cubic is monotone. Returns their number, 2 to 4.
int monotone_ends(const Cubic& f, double end[4]) {
  int count = 0;
  end[count++] = 0;
  const double a = 3 * f.c[3], b = 2 * f.c[2], c = f.c[1], inner = b * b - 4 * a * c;
  if (inner > 0) {
    const double q = -0.5 * (b + (b < 0 ? -std::sqrt(inner) : std::sqrt(inner)));
    double first = q != 0 ? c / q : 2, second = a != 0 ? q / a : 2;
    if (first > second) {
      const double swapped = first;
      first = second, second = swapped;
    }
    if (first > 0 && first < 1) end[count++] = first;
    if (second > 0 && second < 1 && second > first) end[count++] = second;
  }
  end[count++] = 1;
  return count;
}

double volume(Vec3 a, Vec3 b, Vec3 c) {
  return dot(a, cross(b, c));
}

}  // namespace

int moving_crossings(Vec3 p0, Vec3 p1, const Vec3 a0[3], const Vec3 a1[3], MovingCrossing found[3]) {
  // The corners as the point sees them: from + t by.
  Vec3 from[3], by[3];
  for (int v = 0; v < 3; ++v) {
    from[v] = a0[v] - p0;
    by[v] = (a1[v] - p1) - from[v];
  }
  // Six times the signed volume of the point and the corners: negative outside.
  const Cubic f = {{volume(from[0], from[1], from[2]),
                    volume(by[0], from[1], from[2]) + volume(from[0], by[1], from[2]) + volume(from[0], from[1], by[2]),
                    volume(by[0], by[1], from[2]) + volume(by[0], from[1], by[2]) + volume(from[0], by[1], by[2]),
                    volume(by[0], by[1], by[2])}};
  double end[4];
  const int ends = monotone_ends(f, end);
  int count = 0;
  // A point on the plane counts as outside, so that a point that stops on the surface has not crossed it.
  bool inside = f.at(0) > 0;
  for (int i = 0; i + 1 < ends; ++i) {
    const bool then_inside = f.at(end[i + 1]) > 0;
    if (then_inside == inside) continue;
    inside = then_inside;
    MovingCrossing& crossing = found[count];
    crossing.time = root_between(f, end[i], end[i + 1]);
    crossing.entering = inside;
    Vec3 corner[3];
    for (int v = 0; v < 3; ++v) corner[v] = from[v] + crossing.time * by[v];
    const double apart = closest_on_triangle({}, corner[0], corner[1], corner[2], crossing.barycentric);
    const Vec3 ab = corner[1] - corner[0], ac = corner[2] - corner[0];
    const double size = dot(ab, ab) > dot(ac, ac) ? dot(ab, ab) : dot(ac, ac);
    if (apart <= kBorder * kBorder * size) ++count;
  }
  return count;
}

}  // namespace palpate
