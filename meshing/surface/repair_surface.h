// A surface file as users have it -> closed, oriented shells and a list of all repairs, or one error.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "meshing/image/voxel_mask.h"
#include "meshing/surface/triangle_surface.h"

namespace palpate {

struct RepairedSurface {
  TriangleSurface surface;
  std::vector<std::string> repairs;  // one sentence for each repair, in order
  std::size_t dropped = 0;           // shells that the filter refused
  double dropped_mm3 = 0;            // that they enclose
};

// Merges points nearer than 1e-6 of the diagonal of the surface's box. Drops isolated points, flat and repeated
// triangles, and fins: patches that have a free edge and hang on an edge of three or more triangles. Turns triangles
// and shells outward. Drops the shells that the filter refuses. A shell inside another is a cavity if its orientation
// says so. cavities decides what happens to it: "keep", "fill", or "" (keeps it). Errors: InputError for a surface
// larger than 1e9 mm, an open surface, an edge of more than two triangles, a self-intersection, a one-sided surface,
// and, with cavities = "", an inner shell whose orientation does not show whether it is a cavity. The message names
// the first place where the surface fails.
RepairedSurface repair_surface(TriangleSurface surface, const PieceFilter& filter, const std::string& cavities,
                               const std::string& name);

}  // namespace palpate
