// Closed surfaces -> tetrahedra that keep every surface triangle, by gmsh's HXT; and the proof that they were kept.
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
  double size = 0;              // largest edge wanted inside, in the surface's unit; 0: as the surface's edges nearby
  double optimize_below = 0.5;  // elements of a gmsh quality below this are improved; 0 leaves all as they are
  double goal =
      20;  // degrees: elements with a smaller dihedral angle are improved, then other settings tried; 0: never
  double time_limit = 3600;  // s, for each try
};

// Fills every region. The mesh's nodes: first the boundary's points, in the same order and with the same bits, then the interior
// nodes. The mesh's patches are the boundary's, named by patch_name. The same input gives the same mesh: gmsh runs with one
// thread and a fixed seed. gmsh runs in a child process: call this before starting threads.
// boundary: closed, without self-intersections, every point used. Check it first: gmsh crashes or fills nonsense otherwise.
// The smallest dihedral that HXT's optimisation leaves varies by ten degrees and more with its threshold and size. So the
// function makes up to three tries, improves each by improve_worst_elements and returns the best; improvement, if given, says
// what was improved in that one. Cost: about 1 s per 4,000 vertices and try.
// Errors: OperationError when gmsh fails, crashes or runs out of time at the first try; VerificationError from
// verify_boundary_kept at the first try. A later try that fails leaves the mesh of an earlier one.
TetrahedralMesh fill_with_tetrahedra(const VolumeBoundary& boundary, const FillOptions& options,
                                     Improvement* improvement = nullptr);

// The choice between tries: fill makes one mesh. The loop ends at the first mesh that meets the goal.
using FillOnce = std::function<TetrahedralMesh(const FillOptions&)>;
TetrahedralMesh best_of_tries(const std::vector<FillOptions>& tries, const FillOnce& fill, Improvement* improvement);

// Checks triangle by triangle that each is a face of the mesh with its two regions on its two sides, and that no other
// face separates regions. Returns the triangles checked. Errors: VerificationError that names the first triangle lost.
std::size_t verify_boundary_kept(const VolumeBoundary& boundary, const TetrahedralMesh& mesh);

double mean_edge(const VolumeBoundary& boundary);

}  // namespace palpate
