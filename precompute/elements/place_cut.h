// [cut] of a boundary file -> the nodes on which a cut at run time may act.
#pragma once

#include <filesystem>
#include <vector>

#include "formats/organ_config.h"
#include "formats/tetrahedral_mesh.h"

namespace palpate {

// In numbers of the mesh.
struct CutPlace {
  std::vector<std::int32_t> nodes;  // on which a cut may act, ascending
  std::size_t dividable = 0;        // of these, that it may divide
  std::int32_t reserve = 0;         // new nodes that it may make
};

// dividable: nodes that a cut may divide. A cut at a node changes the stiffness of its tetrahedra and, where the element averages at nodes, that of
// sites at their corners: it acts on the nodes one edge away, or two. Errors: InputError that names file and line, for p2-p0 and for more than
// formats::kMostCutNodes nodes.
CutPlace place_cut(const TetrahedralMesh& mesh, const std::vector<std::int32_t>& dividable,
                   const BoundaryConfig::Cut& config, Element element, const std::filesystem::path& file);

}  // namespace palpate
