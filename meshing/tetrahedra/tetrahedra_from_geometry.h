// A parametric gmsh geometry (.geo) -> tetrahedra with its physical groups as regions and patches.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/fill_with_tetrahedra.h"

namespace palpate {

// Meshes file with HXT. assignments: "name=value" for its DefineConstant parameters. Physical volumes become regions
// and physical surfaces patches, under their names; without any physical volume each volume is a region "volume N". As
// in gmsh, volumes outside every physical volume are left out when there is one. options.size: 0 keeps the geometry's
// sizes. Errors: InputError when gmsh refuses the file (with its line), for a file that runs programs (SystemCall and
// its kin), for no volume, for a tetrahedron in two physical volumes, for elements that are no linear tetrahedra, for a
// name of assignments that the file does not define; OperationError when gmsh crashes or runs out of time.
TetrahedralMesh tetrahedra_from_geometry(const std::filesystem::path& file, const std::vector<std::string>& assignments,
                                         const FillOptions& options);

}  // namespace palpate
