#include "meshing/surface/triangle_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace palpate {

double Box::diagonal() const {
  return std::sqrt(dot(high - low, high - low));
}

Box bounding_box(const TriangleSurface& surface) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Box box{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
  for (const Point& point : surface.points) {
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::min(box.low[axis], point[axis]);
      box.high[axis] = std::max(box.high[axis], point[axis]);
    }
  }
  return box;
}

void translate(TriangleSurface& surface, const Point& by) {
  for (Point& point : surface.points) point = point + by;
}

double radius_ratio(const Point& p, const Point& q, const Point& r) {
  const Point n = cross(q - p, r - p);
  const auto length = [](const Point& side) { return std::sqrt(dot(side, side)); };
  const double a = length(r - q), b = length(p - r), c = length(q - p);
  // 16 A^2 / (a b c (a + b + c)); 0 when all corners coincide
  const double below = a * b * c * (a + b + c);
  return below > 0 ? 4 * dot(n, n) / below : 0;
}

double area(const TriangleSurface& surface) {
  double sum = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    const Point normal = cross(surface.points[b] - surface.points[a], surface.points[c] - surface.points[a]);
    sum += 0.5 * std::sqrt(dot(normal, normal));
  }
  return sum;
}

double enclosed_volume(const TriangleSurface& surface) {
  const Point centre = bounding_box(surface).centre();
  double sum = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    sum += dot(surface.points[a] - centre, cross(surface.points[b] - centre, surface.points[c] - centre)) / 6;
  }
  return sum;
}

Point centroid_of_volume(const TriangleSurface& surface) {
  const Point centre = bounding_box(surface).centre();
  Point moment{};
  double volume = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    const Point p = surface.points[a] - centre, q = surface.points[b] - centre, r = surface.points[c] - centre;
    const double part = dot(p, cross(q, r)) / 6;
    volume += part;
    moment = moment + (part / 4) * (p + q + r);
  }
  return centre + (1 / volume) * moment;
}

std::vector<std::int32_t> shell_of_triangle(const TriangleSurface& surface, std::int32_t* count) {
  // union-find over the points of every triangle
  std::vector<std::int32_t> parent(surface.points.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](std::int32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const auto& [a, b, c] : surface.triangles) {
    parent[root(b)] = root(a);
    parent[root(c)] = root(a);
  }
  // number the shells in the order in which they first appear
  std::vector<std::int32_t> number(surface.points.size(), -1), shell;
  shell.reserve(surface.triangles.size());
  *count = 0;
  for (const Triangle& triangle : surface.triangles) {
    std::int32_t& n = number[root(triangle[0])];
    if (n < 0) n = (*count)++;
    shell.push_back(n);
  }
  return shell;
}

TriangleSurface subset(const TriangleSurface& surface, const std::vector<bool>& keep) {
  TriangleSurface part;
  std::vector<std::int32_t> renumbered(surface.points.size(), -1);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    if (!keep[t]) continue;
    Triangle triangle{};
    for (int corner = 0; corner < 3; ++corner) {
      std::int32_t& number = renumbered[surface.triangles[t][corner]];
      if (number < 0) {
        number = static_cast<std::int32_t>(part.points.size());
        part.points.push_back(surface.points[surface.triangles[t][corner]]);
      }
      triangle[corner] = number;
    }
    part.triangles.push_back(triangle);
  }
  return part;
}

}  // namespace palpate
