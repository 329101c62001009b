// Converts a mesh to bytes and back, to pass it from a child process to its parent. This is not a file format.
#pragma once

#include <string>

#include "formats/tetrahedral_mesh.h"

namespace palpate {

std::string to_bytes(const TetrahedralMesh& mesh);
TetrahedralMesh from_bytes(const std::string& bytes);  // bytes made by to_bytes; they are not checked

}  // namespace palpate
