// Repairs of triangles that are not yet a mesh: points and index triples.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Each returns how many points or triangles it dropped or turned.
std::size_t merge_near_points(TriangleSurface& soup, double tolerance);  // onto the first of them in the file
std::size_t drop_isolated_points(TriangleSurface& soup);
std::size_t drop_collapsed_triangles(TriangleSurface& soup);  // two corners are one point
std::size_t drop_repeated_triangles(TriangleSurface& soup);   // the same three points, whatever their order

// Drops patches (triangles joined through edges of two) that have a free edge and hang on an edge of three or more;
// never the patch of largest area.
std::size_t drop_fins(TriangleSurface& soup);

// Turns triangles so that both at an edge of two run along it in opposite directions; of each patch the lesser part is
// turned. *orientable is false where a patch has one side only.
std::size_t orient_patches(TriangleSurface& soup, bool* orientable);

// Edges by number of triangles: free (1) and crowded (3 or more), with the middle of the first of each.
struct EdgeCensus {
  std::size_t free = 0, loops = 0, crowded = 0;
  Point free_place{}, crowded_place{};
};
EdgeCensus count_edges(const TriangleSurface& soup);

}  // namespace palpate
