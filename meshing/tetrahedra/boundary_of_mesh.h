// Tetrahedra -> the triangles that bound their regions.
#pragma once

#include <vector>

#include "formats/tetrahedral_mesh.h"
#include "meshing/surface/triangle_surface.h"
#include "meshing/tetrahedra/volume_boundary.h"

namespace palpate {

// Collects the faces between two regions and the faces between a region and empty space. Enclosed empty space becomes
// kCavity, all other empty space kOutside. The boundary's points are all nodes of the mesh, in the mesh's order.
VolumeBoundary boundary_of(const TetrahedralMesh& mesh);

// Drops the points that no triangle uses and renumbers the triangles' corners.
VolumeBoundary without_unused_points(const VolumeBoundary& boundary);

// Edges of the outer surface (patches ahead of which is kOutside or kCavity) that do not have exactly two triangles.
struct NonManifoldEdges {
  std::vector<Point> places;                       // the middles of these edges
  std::vector<std::vector<std::int32_t>> regions;  // behind their triangles
};
NonManifoldEdges non_manifold_edges(const VolumeBoundary& boundary);

}  // namespace palpate
