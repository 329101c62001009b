// [cut] of a boundary file -> the nodes on which a cut at run time may act.
#pragma once

#include <filesystem>
#include <vector>

#include "formats/organ_config.h"
#include "precompute/elements/elastic_body.h"

namespace palpate {

// Fills body.cut_nodes and adds those inside the body to body.corridor_nodes, after corridors and touchable nodes. dividable: nodes that a cut
// may divide, ascending. A cut at a node changes the stiffness of its tetrahedra and, where the element averages at nodes, that of sites at their
// corners: it acts on the nodes one edge away, or two. line: of [cut]. Errors: InputError that names file and line, for p2-p0, for more than
// formats::kMostCutNodes nodes, and for a surface node that moves and has no column.
void place_cut(const std::vector<std::int32_t>& dividable, Element element, int line, const std::filesystem::path& file,
               ElasticBody& body);

}  // namespace palpate
