// Splits regions and patches into connected volumes and surfaces, because gmsh's HXT fails on a volume or a surface
// of several pieces.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "meshing/tetrahedra/volume_boundary.h"

namespace palpate {

struct ConnectedVolumes {
  struct Volume {
    std::int32_t region = 0;
    // Closed sets of surfaces, by index. The first encloses the volume; each further one bounds a hole in it.
    std::vector<std::vector<int>> loops;
  };
  std::vector<std::vector<std::array<std::int32_t, 3>>> surfaces;  // the connected pieces of the patches
  std::vector<Volume> volumes;                                     // region by region
};

// For example, two tumours of one region become two volumes; two cavities of one patch become two surfaces. Surfaces
// that share a point belong to the same closed set. Cost: linear in the triangles; for a region of several pieces,
// the number of pieces times its triangles. Errors: VerificationError for a hole that no volume of its region
// encloses.
ConnectedVolumes connected_volumes(const VolumeBoundary& boundary);

}  // namespace palpate
