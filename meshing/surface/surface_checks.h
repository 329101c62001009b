// Checks what a tetrahedral mesher needs: a closed surface without self-intersections that points outward.
#pragma once

#include <cstddef>
#include <string>

#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Number of pairs of triangles that cross, or touch without being neighbours; counting stops at kMostCrossings. place:
// the centre of the first such triangle.
inline constexpr std::size_t kMostCrossings = 10'000;
struct SelfIntersections {
  std::size_t pairs = 0;
  Point place{};
};
// The surface must be an oriented manifold.
SelfIntersections find_self_intersections(const TriangleSurface& surface);

// Re-triangulates around self-intersections without changing the number of handles. Returns whether no
// self-intersection is left; if one is left, the surface stays unchanged. Gives up at once when more than 500 pairs
// intersect, because CGAL's repair then takes minutes and rarely succeeds.
bool remove_self_intersections(TriangleSurface& surface);

// Returns an empty text when each shell is a closed manifold, no triangles intersect, the surface encloses a positive
// volume, and nested shells alternate outward and inward. Otherwise returns a description of the first defect and its
// place. The cheapest checks come first.
std::string first_defect(const TriangleSurface& surface);

}  // namespace palpate
