// Touching tissues of a label image -> tetrahedra, one region per tissue, neighbours sharing the triangles between
// them.
#pragma once

#include <string>
#include <vector>

#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/tissue_map.h"
#include "meshing/tetrahedra/volume_boundary.h"

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
TetrahedralMesh mesh_tissues(const TissueMap& map, const std::vector<Tissue>& tissues,
                             const std::vector<TissuePiece>& pieces, const LabelMeshOptions& options);

// The faces of a mesh between regions and around them, as patches; enclosed empty space is kCavity. Points are the
// mesh's nodes, all of them; without_unused_points drops those that no triangle has.
VolumeBoundary boundary_of(const TetrahedralMesh& mesh);
VolumeBoundary without_unused_points(const VolumeBoundary& boundary);

// Edges of the outer surface (outside and cavities) that do not have exactly two triangles; the first one's middle.
struct NonManifoldEdges {
  std::size_t count = 0;
  Point place{};
};
NonManifoldEdges non_manifold_edges(const VolumeBoundary& boundary);

}  // namespace palpate
