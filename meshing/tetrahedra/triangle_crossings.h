// Whether triangles of surfaces that share edges and vertices cross.
#pragma once

#include <optional>
#include <vector>

#include "meshing/surface/triangle_surface.h"

namespace palpate {

// The centre of the first triangle that crosses another one, touches one that is no neighbour, or lies folded on its neighbour;
// nothing where no triangle does. Triangles that name the same points are neighbours, and an edge may have more than two. Exact.
// Cost: about n log n for n triangles.
std::optional<Point> first_crossing(const std::vector<Point>& points, const std::vector<Triangle>& triangles);

}  // namespace palpate
