// Which buckets of the index a triangle touches: for building it and for its changes.
#pragma once

#include <algorithm>

#include "runtime/surface/exact_signs.h"
#include "runtime/surface/surface_index.h"

namespace palpate {
namespace index_cells {

// A unit normal of the triangle; where it has no area, a unit vector across its line; zero where it is a point.
inline Vec3 plane_of(Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 normal = unit_or_zero(cross(b - a, c - a));
  if (largest_of(normal) > 0) return normal;
  const Vec3 ab = b - a, ac = c - a, line = largest_of(ab) > largest_of(ac) ? ab : ac;
  for (const Vec3 axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}})
    if (const Vec3 across = unit_or_zero(cross(line, axis)); largest_of(across) > 0) return across;
  return {};
}

inline int major_axis(Vec3 v) {
  int major = 0;
  for (int d = 1; d < 3; ++d)
    if (std::fabs(v[d]) > std::fabs(v[major])) major = d;
  return major;
}

}  // namespace index_cells

// Visits every bucket that the triangle touches, with a margin far above the rounding of SurfaceIndex::walk.
template <class Visit>
void SurfaceIndex::cells_of_triangle(std::int32_t triangle, Visit visit) const {
  const Vec3 a = corner(triangle, 0), b = corner(triangle, 1), c = corner(triangle, 2);
  const double margin = 1e-4 * cell_;
  int first[3], last[3];
  for (int d = 0; d < 3; ++d) {
    first[d] = cell_of(std::min({a[d], b[d], c[d]}) - margin, d);
    last[d] = cell_of(std::max({a[d], b[d], c[d]}) + margin, d);
  }
  const Vec3 normal = index_cells::plane_of(a, b, c);
  const double reach =
      (0.5 * cell_ + margin) * (std::fabs(normal.x) + std::fabs(normal.y) + std::fabs(normal.z)) + margin;
  const auto height = [&](double at, int d) { return normal[d] * (low_[d] + (at + 0.5) * cell_ - a[d]); };
  // One column of buckets after the other, along the axis nearest to the normal; of each column only the buckets near the plane.
  const int w = index_cells::major_axis(normal), u = (w + 1) % 3, v = (w + 2) % 3;
  const double start = height(0, w), rise = normal[w] * cell_;
  int at[3];
  for (at[v] = first[v]; at[v] <= last[v]; ++at[v])
    for (at[u] = first[u]; at[u] <= last[u]; ++at[u]) {
      const double others = start + height(at[u], u) + height(at[v], v);
      int from = first[w], to = last[w];
      if (to - from > 8 && rise != 0) {
        const double middle = -others / rise, half = reach / std::fabs(rise) + 1;
        from = static_cast<int>(std::clamp(middle - half, 1.0 * from, 1.0 * to));
        to = static_cast<int>(std::clamp(middle + half, 1.0 * from, 1.0 * to));
      }
      for (at[w] = from; at[w] <= to; ++at[w])
        if (std::fabs(others + rise * at[w]) <= reach) visit(at[0], at[1], at[2]);
    }
}

}  // namespace palpate
