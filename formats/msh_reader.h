// MSH bytes -> TetrahedralMesh; read_mesh without the file, so that tests and fuzzers can feed it.
#pragma once

#include <string>
#include <string_view>

#include "formats/tetrahedral_mesh.h"

namespace palpate {

// As read_mesh. name: of the file, for refusals. Memory: a small multiple of bytes, whatever they claim.
TetrahedralMesh parse_mesh(std::string_view bytes, const std::string& name);

}  // namespace palpate
