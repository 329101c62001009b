// Moves a closed surface along its normals until it encloses a given volume again.
#pragma once

#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Every point of every given shell moves by the same distance d (mm) along its normal (mean of its triangles' normals
// by area), so that their signed volumes sum to volume_mm3. Newton's method; d is returned. Gives up, leaving the
// surface as it was and returning NaN, when d would exceed the mean edge length: the shape is then not the one that was
// asked for.
double offset_to_volume(std::vector<TriangleSurface*> shells, double volume_mm3);

}  // namespace palpate
