// Cuts each tetrahedron into eight: a finer mesh of the same body, to tell the error of a coarse mesh from that of its shape.
#pragma once

#include "formats/tetrahedral_mesh.h"

namespace palpate::large {

// New nodes at the middle of all edges, after the old ones. The octahedron inside each tetrahedron is cut along its shortest diagonal.
// Regions and patches stay. Cost: linear, and a map of the edges.
TetrahedralMesh split_mesh(const TetrahedralMesh& mesh);

}  // namespace palpate::large
