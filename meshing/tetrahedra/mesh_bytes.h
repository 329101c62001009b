// Converts a mesh or a surface to bytes and back, to pass it from a child process to its parent. This is not a file format.
#pragma once

#include <string>

#include "formats/tetrahedral_mesh.h"
#include "meshing/surface/triangle_surface.h"

namespace palpate {

std::string to_bytes(const TetrahedralMesh& mesh);
std::string to_bytes(const TriangleSurface& surface);
TriangleSurface surface_from_bytes(const std::string& bytes);  // made by to_bytes of a surface
TetrahedralMesh from_bytes(const std::string& bytes);          // bytes made by to_bytes; they are not checked

}  // namespace palpate
