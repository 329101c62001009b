// A surface file -> one checked surface that a mesher can be trusted with.
#pragma once

#include <string>

#include "meshing/triangle_surface.h"

namespace palpate {

// Reads OFF, STL, OBJ or PLY; merges duplicate points and triangles, makes orientation consistent.
// Errors: InputError when it cannot be read, is open or self-intersects.
TriangleSurface read_closed_surface(const std::string& file);

// Errors: InputError when triangles of the surface cross or touch one another (says how many pairs and where).
void refuse_self_intersection(const TriangleSurface& surface, const std::string& name);

}  // namespace palpate
