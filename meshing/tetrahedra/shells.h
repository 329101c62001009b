// Closed surfaces -> regions. Finds which shell encloses which, and which shells bound tissue and which bound a
// cavity.
#pragma once

#include <string>
#include <vector>

#include "meshing/surface/triangle_surface.h"
#include "meshing/tetrahedra/volume_boundary.h"

namespace palpate {

// One input file: closed, oriented, disjoint shells. name: the name of its region; if empty, each shell is a region
// of its own.
struct ShellInput {
  TriangleSurface surface;
  std::string file;
  std::string name;
};

// Turns each shell outward or inward as its nesting requires. A shell directly inside a shell of another input
// becomes a region of its own, and is cut out of the region around it. A shell inside a shell of the same input is a
// cavity if its normals point opposite to those of the enclosing shell; a shell inside a cavity is solid again. With
// nested_are_regions it always becomes a region. names: one for each region in order (inputs in order, within each
// the largest shell first), or empty to make the names from those of the files. Errors: InputError for a nested shell
// that points like the enclosing one, for too few or too many names (lists the shells), and for a name given twice.
VolumeBoundary regions_of_shells(const std::vector<ShellInput>& inputs, bool nested_are_regions,
                                 const std::vector<std::string>& names);

// Returns the winding number of a closed surface around a point that is not on it: 1 inside, 0 outside, -1 inside a
// surface turned inside out. Source: van Oosterom and Strackee 1983, the solid angle of a triangle.
int winding_number(const TriangleSurface& surface, const Point& point);

}  // namespace palpate
