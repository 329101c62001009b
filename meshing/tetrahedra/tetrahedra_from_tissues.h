// Touching tissues of a label image -> tetrahedra, one region per tissue, neighbours sharing the triangles between
// them.
#pragma once

#include <string>
#include <vector>

#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/tissue_map.h"

namespace palpate {

struct LabelMeshOptions {
  double edge = 0;            // mm, of surface triangles at most
  double facet_distance = 0;  // mm, largest distance between triangle and tissue border
  double interior = 0;        // mm, largest edge inside; 0: only surfaces are meshed well, to be filled anew
  double time_limit = 3600;   // s
};

// CGAL's Mesh_3 on the map. Regions in the order of the tissues; no patches. A tissue that the elements are too large
// to hold is an InputError that says so. The same input gives the same mesh. Runs in a child process. Errors:
// OperationError when CGAL crashes or runs out of time.
TetrahedralMesh tetrahedra_from_tissues(const TissueMap& map, const std::vector<Tissue>& tissues,
                                        const std::vector<TissuePiece>& pieces, const LabelMeshOptions& options);

}  // namespace palpate
