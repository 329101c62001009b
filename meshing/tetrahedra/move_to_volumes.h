// Moves the surfaces between regions until every region has a wanted volume.
#pragma once

#include <vector>

#include "meshing/tetrahedra/volume_boundary.h"

namespace palpate {

struct VolumeMove {
  std::vector<double> distance;  // [regions] how far the surface of a region moved outward, where it has no neighbour
  double share = 0;              // of the missing volume that the move gave back, 0 .. 1
};

// Every point of the surface moves along the gradients of the volumes of the regions beside it, each divided by the point's share
// of area. So the surface of region r against empty space moves outward by one distance d_r, and that between r and s by d_r - d_s
// from r to s. Newton's method finds the d_r. No point moves by more than half the mean edge of its triangles, no triangle turns by
// more than 60 degrees, and no triangles cross: where the whole move would break this, three quarters, a half or a quarter of it is
// taken, or none. volumes: [regions], wanted, in the unit of the points cubed. Cost: a few passes over the triangles and one
// search for crossings in each try.
VolumeMove move_to_volumes(VolumeBoundary& boundary, const std::vector<double>& volumes);

}  // namespace palpate
