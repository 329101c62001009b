// Touching tissues of a label image -> tetrahedra whose surfaces are good, one region for each tissue. Neighbours share the
// triangles between them.
#pragma once

#include <string>
#include <vector>

#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/tissue_map.h"

namespace palpate {

// Lengths in mm for each tissue. Between two tissues the smaller one holds.
struct LabelMeshOptions {
  std::vector<double> edges;            // longest edge wanted of surface triangles
  std::vector<double> facet_distances;  // largest distance from a triangle to the border of the tissue
  double time_limit = 3600;             // s
};

// Meshes the map with CGAL's Mesh_3 in a child process. The regions come in the order of the tissues; there are no
// patches. The same input gives the same mesh. Errors: InputError for a tissue that is too small for the edge;
// OperationError when CGAL crashes or runs out of time.
TetrahedralMesh tetrahedra_from_tissues(const TissueMap& map, const std::vector<Tissue>& tissues,
                                        const std::vector<TissuePiece>& pieces, const LabelMeshOptions& options);

}  // namespace palpate
