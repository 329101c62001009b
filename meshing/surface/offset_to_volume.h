// Moves a closed surface along its normals until it encloses a given volume again.
#pragma once

#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Moves every point of the given shells by the same distance d (mm) along its normal, the mean of its triangles'
// normals by area. Finds d by Newton's method so that the signed volumes of the shells sum to volume_mm3, and returns
// d. When d would exceed the mean edge length, the function leaves the shells unchanged and returns NaN, because so
// large a d would change the shape.
double offset_to_volume(std::vector<TriangleSurface*> shells, double volume_mm3);

}  // namespace palpate
