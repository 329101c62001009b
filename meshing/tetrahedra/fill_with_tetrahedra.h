// Closed surfaces -> tetrahedra that keep every surface triangle, by gmsh's HXT; and the proof that they were kept.
#pragma once

#include <array>
#include <cstdint>

#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/relocate_vertices.h"
#include "meshing/tetrahedra/volume_boundary.h"

namespace palpate {

struct FillOptions {
  double size = 0;              // largest edge wanted inside, in the surface's unit; 0: as the surface's edges nearby
  double optimize_below = 0.5;  // elements of a gmsh quality below this are improved; 0 leaves all as they are
  double goal = 20;  // degrees: elements of a smaller dihedral are improved, then other settings tried; 0: never
  double time_limit = 3600;  // s, for each try
};

// Fills every region. Nodes: the boundary's points first, same order and bits, then the interior ones. Patches as the
// boundary's, named by patch_name. The same input gives the same mesh: one thread, fixed seed.
// boundary: closed, without self-intersection, each point used (check first: gmsh crashes or fills nonsense otherwise).
// What HXT's optimisation leaves behind varies with its threshold and size by ten degrees and more: up to three tries,
// each improved by improve_worst_elements, the best returned; improvement, if given, says how that one went. Errors:
// OperationError when gmsh fails, crashes or runs out of time; VerificationError from verify_boundary_kept. Cost: about
// 1 s per 4,000 vertices. Runs gmsh in a child process; fork before starting threads.
TetrahedralMesh fill_with_tetrahedra(const VolumeBoundary& boundary, const FillOptions& options,
                                     Improvement* improvement = nullptr);

// Checks triangle by triangle that each is a face of the mesh with its two regions on its two sides, and that no other
// face separates regions. Returns the triangles checked. Errors: VerificationError that names the first triangle lost.
std::size_t verify_boundary_kept(const VolumeBoundary& boundary, const TetrahedralMesh& mesh);

double mean_edge(const VolumeBoundary& boundary);

}  // namespace palpate
