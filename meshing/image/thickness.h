// How thick an organ is, from its voxels.
#pragma once

#include "meshing/image/voxel_mask.h"

namespace palpate {

// The largest diameter (mm) of a ball for which balls inside the organ cover at least the share of its voxels: parts thinner
// than that, with less than 1 - share of the volume, are left out. At least the mean of a voxel's sides. A plate has its own
// thickness, a rod its diameter. Above four million voxels the function looks at every second, third ... voxel along each
// axis. Up to one voxel and 15 % too small. Cost: up to 20 distance maps of the mask (ITK's signed Maurer map).
double local_thickness(const VoxelMask& mask, double share);

}  // namespace palpate
