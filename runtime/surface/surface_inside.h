// Whether a place is inside a closed surface, by the triangles along a ray. Exact signs decide: a closed surface has no gap, and a
// crossing of an edge counts for one triangle.
#pragma once

#include <algorithm>

#include "runtime/surface/exact_signs.h"
#include "runtime/surface/surface_tree.h"

namespace palpate {

// side(edge) where it is the same for all three edges, so that the line passes through the triangle; else 0.
inline int common_side(const Vec3 corner[3], Vec3 p, Vec3 q) {
  const int first = side_of_edge(corner[0], corner[1], p, q);
  return first != 0 && side_of_edge(corner[1], corner[2], p, q) == first &&
                 side_of_edge(corner[2], corner[0], p, q) == first
             ? first
             : 0;
}

// +1 where the segment enters through the triangle, -1 where it leaves through it, 0 where it does not cross it.
inline int segment_crosses(const Vec3 corner[3], Vec3 from, Vec3 to) {
  const int before = side_of_plane(corner[0], corner[1], corner[2], from),
            after = side_of_plane(corner[0], corner[1], corner[2], to);
  if (before == after || common_side(corner, from, to) == 0) return 0;
  return before > after ? 1 : -1;
}

// Whether the box around `count` corners, grown by a margin, meets the box [low, high].
inline bool corners_meet(const Vec3* corner, int count, double margin, Vec3 low, Vec3 high) {
  for (int d = 0; d < 3; ++d) {
    double least = corner[0][d], most = corner[0][d];
    for (int v = 1; v < count; ++v) least = std::min(least, corner[v][d]), most = std::max(most, corner[v][d]);
    if (least - margin > high[d] || most + margin < low[d]) return false;
  }
  return true;
}

// Whether the winding number of p is above zero, so that a place where the surface overlaps itself is inside. meet(low, high,
// visit) asks the tree for the triangles that may meet a box, as SurfaceTree::meet does.
template <class Meet>
bool is_inside_surface(const SurfaceTree& tree, Vec3 p, const FieldBound& bound, Meet meet) {
  const double reach = tree.largest_reach() * (bound.norm + bound.apart) + 0.01 * tree.mean_edge();
  // The ray along the axis on which it leaves the surface's box first.
  Vec3 out = p;
  int axis = -1;
  double least = INFINITY, end = 0;
  for (int d = 0; d < 3; ++d) {
    const double low = tree.low()[d] - reach, high = tree.high()[d] + reach;
    if (p[d] < low || p[d] > high) return false;
    if (p[d] - low < least) least = p[d] - low, axis = d, end = low;
    if (high - p[d] < least) least = high - p[d], axis = d, end = high;
  }
  if (axis < 0) return false;
  out[axis] = end + (end < p[axis] ? -1 : 1) * tree.mean_edge();
  Vec3 low = p, high = p;
  low[axis] = std::min(p[axis], out[axis]), high[axis] = std::max(p[axis], out[axis]);
  int winding = 0;
  meet(low, high, [&](std::int32_t, const Vec3 corner[3]) {
    if (corners_meet(corner, 3, 0, low, high)) winding -= segment_crosses(corner, p, out);
  });
  return winding > 0;
}

}  // namespace palpate
