// A segmented surface as users have it -> closed, oriented shells, with every repair told; or one clear error.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "meshing/image/voxel_mask.h"
#include "meshing/surface/triangle_surface.h"

namespace palpate {

struct RepairedSurface {
  TriangleSurface surface;
  std::vector<std::string> repairs;  // a sentence each, in order
};

// Merges points nearer than 1e-6 of the box's diagonal; drops isolated points, flat and repeated triangles, and fins
// (patches with a free edge that hang on an edge of three or more triangles); turns triangles and shells outward; drops
// shells that the filter refuses. A shell inside another is a cavity when it is oriented so, and is kept or filled as
// cavities says ("keep", "fill" or nothing).
// Errors: InputError for a box of 1e9 mm and more, an open surface (loops and place), walls inside, self-intersections (pairs and place), shells
// that cannot be oriented, and nested shells that all point outward while cavities is empty.
RepairedSurface repair_surface(TriangleSurface surface, const PieceFilter& filter, const std::string& cavities,
                               const std::string& name);

}  // namespace palpate
