// Cuts a mesh of tetrahedra along the path of a blade, before anything is computed on it.
//
// Faces between tetrahedra are cut, those nearest to the path; nodes there are doubled, so that the two lips of the cut lie on one another and
// may move apart (runtime/cut). Then the lips' nodes move onto the path as far as the shape of the elements allows; those of the organ's surface
// move along it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "formats/tetrahedral_mesh.h"
#include "meshing/cut/blade_path.h"

namespace palpate {

struct CutReport {
  std::size_t faces = 0, new_nodes = 0, moved_nodes = 0;
  double area = 0;                               // of one lip, in the square of the mesh's unit
  double mean_distance = 0, worst_distance = 0;  // of the lips' corners from the path, in the mesh's unit
  std::vector<std::size_t> pieces;               // tetrahedra of each piece, the largest one first
};

// The mesh's patches follow their triangles; the lips are a patch of their own, "cut". largest_piece: others are left out. Elements keep at least
// min_dihedral (degrees), or what they had. Errors: InputError where the path meets no face, or where a patch is called "cut".
CutReport cut_by_blade(TetrahedralMesh& mesh, const BladePath& path, bool largest_piece, double min_dihedral);

}  // namespace palpate
