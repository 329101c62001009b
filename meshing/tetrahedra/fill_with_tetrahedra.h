// Closed surfaces -> tetrahedra, by gmsh's HXT. Every triangle of the surfaces is kept, and a check proves it.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/relocate_vertices.h"
#include "meshing/tetrahedra/volume_boundary.h"

namespace palpate {

struct FillOptions {
  double size = 0;  // largest edge wanted inside, in the unit of the surface; 0: as long as the nearby surface edges
  double optimize_below = 0.5;  // HXT improves elements whose gmsh quality is below this; 0: none
  double goal =
      20;  // degrees; elements with a smaller dihedral angle are improved, then other settings are tried; 0: neither
  double hopeless = 0;         // degrees; a mesh with a smaller dihedral angle gets no other settings
  double time_limit = 3600;    // seconds for each try
  double processor_limit = 0;  // seconds of processor time for all tries together; 0: none
};

// Fills every region. The nodes of the mesh are the points of the boundary, in the same order and with the same bits,
// then the interior nodes. The patches of the mesh are those of the boundary, named by patch_name. The same input
// gives the same mesh: gmsh runs with one thread and a fixed seed. gmsh runs in a child process, so call this
// function before starting threads. The boundary must be closed, without self-intersections, and use every point.
// Check it first: otherwise gmsh crashes or makes a wrong mesh.
//
// A small change of HXT's threshold or size can change the smallest dihedral angle by ten degrees and more. So the
// function makes up to three tries with different settings, improves each mesh by improve_worst_elements and returns
// the best one. improvement, if given, describes the improvement of that mesh. Cost: about 1 s for 4,000 vertices and
// each try. Errors: OperationError when gmsh fails, crashes or runs out of time at the first try; VerificationError
// from verify_boundary_kept at the first try. A later try that fails, or for which no processor time is left, leaves the mesh of an
// earlier one.
TetrahedralMesh fill_with_tetrahedra(const VolumeBoundary& boundary, const FillOptions& options,
                                     Improvement* improvement = nullptr);

// Chooses between tries; fill makes one mesh within the processor_limit that it is given: what is left of that of the first
// try. Stops at the first mesh that meets the goal or is hopeless, or when no processor time is left.
using FillOnce = std::function<TetrahedralMesh(const FillOptions&)>;
TetrahedralMesh best_of_tries(const std::vector<FillOptions>& tries, const FillOnce& fill, Improvement* improvement);

// Checks that each triangle of the boundary is a face of the mesh with the right regions on its two sides, and that
// no other face separates two regions. Returns the number of triangles checked. Errors: VerificationError that names
// the first lost triangle.
std::size_t verify_boundary_kept(const VolumeBoundary& boundary, const TetrahedralMesh& mesh);

double mean_edge(const VolumeBoundary& boundary);

}  // namespace palpate
