// A parametric gmsh geometry (.geo) -> tetrahedra. Its physical groups become regions and patches.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/tetrahedral_mesh.h"
#include "meshing/tetrahedra/fill_with_tetrahedra.h"

namespace palpate {

// Meshes the geometry with HXT. assignments: "name=value", which set its DefineConstant parameters. Physical volumes
// become regions and physical surfaces become patches, under their names. Without a physical volume each volume
// becomes a region "volume N". With one, volumes that belong to no physical volume are left out, as in gmsh.
// options.size = 0 keeps the edge lengths of the geometry. Errors: InputError when gmsh refuses the file (with its
// line), when the file has a command that runs programs or reaches other files (SystemCall and others), when there is
// no volume, when a volume belongs to two physical volumes, when elements are not linear tetrahedra, or when the file
// does not define a name of assignments; OperationError when gmsh crashes or runs out of time.
TetrahedralMesh tetrahedra_from_geometry(const std::filesystem::path& file, const std::vector<std::string>& assignments,
                                         const FillOptions& options);

}  // namespace palpate
