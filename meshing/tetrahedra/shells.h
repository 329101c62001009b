// Closed surfaces -> regions: which shell lies in which, what is tissue and what is an empty pocket.
#pragma once

#include <string>
#include <vector>

#include "meshing/surface/triangle_surface.h"
#include "meshing/tetrahedra/volume_boundary.h"

namespace palpate {

// One input: its closed, oriented, disjoint shells. name: of its one region; empty: each shell is a region of its own.
struct ShellInput {
  TriangleSurface surface;
  std::string file;
  std::string name;
};

// Shells are turned outward or inward as their place asks. A shell directly inside one of another input is a region of
// its own, cut out of the one around it. Inside one of its own input it is an empty cavity when its normals run against
// its parent's (a shell in a cavity is solid again), or, with nested_are_regions, always a region. names: of the
// regions in order (inputs in order, shells by falling volume), or empty for names made of the files'. Errors:
// InputError for a nested shell that points like its parent, for a name too many or too few (lists the shells), for a
// region twice.
VolumeBoundary regions_of_shells(const std::vector<ShellInput>& inputs, bool nested_are_regions,
                                 const std::vector<std::string>& names);

// The winding number of a closed surface around a point not on it, rounded: 1 inside, 0 outside, -1 inside one turned
// inside out. Source: van Oosterom and Strackee 1983, the solid angle of a triangle.
int winding_number(const TriangleSurface& surface, const Point& point);

}  // namespace palpate
