// Improves the worst tetrahedra of a mesh by moving their interior vertices.
#pragma once

#include <cstddef>
#include <limits>

#include "formats/tetrahedral_mesh.h"

namespace palpate {

struct Improvement {
  std::size_t below_before = 0, below_after = 0;  // elements with a dihedral angle below the goal
  std::size_t out_of_reach = 0;  // elements below the goal with all corners on surfaces, which cannot be improved
  std::size_t vertices_moved = 0;
  bool out_of_time = false;
};

// Moves the vertices of elements whose smallest dihedral angle is below goal (degrees). Where this does not help, it
// also moves the vertices of their neighbours. Each vertex moves to where the worst element around it is best
// (Freitag and Ollivier-Gooch, Tetrahedral mesh improvement using swapping and smoothing, 1997, section 3; here by
// direct search). The function keeps a move only when the smallest dihedral angle around the vertex grows, the number
// of elements below the goal does not grow there, and all volumes stay positive. Vertices of the outer surface, of
// faces between regions and of patches keep their coordinates exactly. The elements keep their corners. The same mesh
// gives the same result. Cost: one pass over the elements, then up to 1 ms for each vertex tried, in at most 12
// rounds and about 100,000 tries. Stops after processor_limit seconds of processor time with what is improved so far.
Improvement improve_worst_elements(TetrahedralMesh& mesh, double goal,
                                   double processor_limit = std::numeric_limits<double>::infinity());

}  // namespace palpate
