// What a tetrahedral mesher needs of a surface, and where it fails: closed, free of self-intersections, outward.
#pragma once

#include <cstddef>
#include <string>

#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Pairs of triangles that cross or touch where they are not neighbours, and the centre of the first such triangle.
struct SelfIntersections {
  std::size_t pairs = 0;
  Point place{};
};
// The surface must be an oriented manifold.
SelfIntersections find_self_intersections(const TriangleSurface& surface);

// Tries to re-triangulate around self-intersections without changing the number of handles. Returns whether none are
// left; the surface is untouched otherwise.
bool remove_self_intersections(TriangleSurface& surface);

// Empty when each shell is closed and a manifold, nothing intersects and the whole encloses a positive volume with
// shells alternating outward and inward from outside in; otherwise what is wrong, with its place. Order: cheapest
// first.
std::string first_defect(const TriangleSurface& surface);

}  // namespace palpate
