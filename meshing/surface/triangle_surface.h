// A triangle surface in memory. All steps from the image to the surface pass it on.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace palpate {

using Point = std::array<double, 3>;
using Triangle = std::array<std::int32_t, 3>;

struct TriangleSurface {
  std::vector<Point> points;        // mm
  std::vector<Triangle> triangles;  // counter-clockwise from outside
};

inline Point operator-(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Point operator+(const Point& a, const Point& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Point operator*(double s, const Point& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
inline double dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

struct Box {
  Point low, high;
  Point centre() const { return 0.5 * (low + high); }
  double diagonal() const;
};
Box bounding_box(const TriangleSurface& surface);
void translate(TriangleSurface& surface, const Point& by);

// 2 r / R, where r is the radius of the inscribed circle and R that of the circumscribed circle: 1 for an equilateral
// triangle, 0 for a flat one. At a ratio q no angle is below the angle a (degrees) that solves 8 sin(a / 2) sin(45 -
// a / 4)^2 = q: 10 degrees at 0.32, 16.8 degrees at 0.5.
double radius_ratio(const Point& p, const Point& q, const Point& r);

double area(const TriangleSurface& surface);
// Signed volume, positive when the triangles point outward; the sum over all shells. Computed relative to the centre
// of the box, so that a surface far from the origin loses no digits.
double enclosed_volume(const TriangleSurface& surface);
Point centroid_of_volume(const TriangleSurface& surface);

// Returns the shell of each triangle, 0 .. *count - 1. Triangles that share a point belong to the same shell.
std::vector<std::int32_t> shell_of_triangle(const TriangleSurface& surface, std::int32_t* count);
// Returns the triangles for which keep[triangle] is true and the points that they use.
TriangleSurface subset(const TriangleSurface& surface, const std::vector<bool>& keep);

}  // namespace palpate
