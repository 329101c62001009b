// Repairs triangles that do not yet form a mesh: a list of points and triangles that refer to them.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Each function returns how many points or triangles it dropped.
std::size_t merge_near_points(TriangleSurface& soup, double tolerance);  // keeps the first of the near points
std::size_t drop_isolated_points(TriangleSurface& soup);
std::size_t drop_collapsed_triangles(TriangleSurface& soup);  // those with the same point at two corners
std::size_t drop_repeated_triangles(TriangleSurface& soup);   // those with the same three points in any order

// Drops fins: patches that have a free edge and hang on an edge of three or more triangles. A patch is a set of
// triangles connected through edges of two triangles. Never drops the patch of largest area. Returns the number of
// triangles dropped.
std::size_t drop_fins(TriangleSurface& soup);

// Turns triangles until the two triangles at each edge run along it in opposite directions. In each patch it turns
// the smaller part. *orientable becomes false when a patch has only one side (a Moebius strip). Returns the number of
// triangles turned.
std::size_t orient_patches(TriangleSurface& soup, bool* orientable);

// Counts the edges of one triangle (free), the loops of free edges, and the edges of three or more triangles
// (crowded). The places are the middles of the first free and of the first crowded edge.
struct EdgeCensus {
  std::size_t free = 0, loops = 0, crowded = 0;
  Point free_place{}, crowded_place{};
};
EdgeCensus count_edges(const TriangleSurface& soup);

// Closes each connected set of free edges by a fan: one more point, the mean of the set's points, and a triangle from
// it to each free edge. widest: the largest diagonal of a set's box; place: that set's new point.
struct Caps {
  std::size_t loops = 0;
  double widest = 0;
  Point place{};
};
Caps cap_free_edges(TriangleSurface& soup);

}  // namespace palpate
