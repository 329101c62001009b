// A mesh as bytes between a child process and its parent on one machine; not a file format.
#pragma once

#include <string>

#include "formats/tetrahedral_mesh.h"

namespace palpate {

std::string to_bytes(const TetrahedralMesh& mesh);
TetrahedralMesh from_bytes(const std::string& bytes);  // of to_bytes, trusted

}  // namespace palpate
