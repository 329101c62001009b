// Regions and patches taken apart: gmsh's HXT fails on a volume or a surface that is in several pieces.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "meshing/tetrahedra/volume_boundary.h"

namespace palpate {

struct ConnectedVolumes {
  struct Volume {
    std::int32_t region = 0;
    // Closed sets of surfaces, by their index: the one around the volume, then those around what is cut out of it.
    std::vector<std::vector<int>> loops;
  };
  std::vector<std::vector<std::array<std::int32_t, 3>>> surfaces;  // the patches' connected pieces
  std::vector<Volume> volumes;                                     // of the regions in their order
};

// Two tumours of one region are two volumes; two cavities of one patch are two surfaces. Surfaces that share a point belong
// together. Cost: linear in the triangles, and where a region is in several pieces, its pieces times its triangles. Errors:
// VerificationError where a region is cut out that nothing is around.
ConnectedVolumes connected_volumes(const VolumeBoundary& boundary);

}  // namespace palpate
