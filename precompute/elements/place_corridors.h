// [[corridor]] of a boundary file -> the nodes inside the body that a needle may hold.
#pragma once

#include <filesystem>

#include "formats/organ_config.h"
#include "precompute/elements/elastic_body.h"

namespace palpate {

// Fills body.corridors and body.corridor_nodes. The body has its nodes and tetrahedra. metres: of a unit of the boundary file's
// points. Errors: InputError that names file and line of a corridor that meets no tetrahedron, of one whose tetrahedra have no
// node inside the body, and of the one by which all together have more than formats::kMostCorridorNodes nodes. Cost: a
// microsecond for each tetrahedron near a corridor.
void place_corridors(const BoundaryConfig& boundary, double metres, const std::filesystem::path& file,
                     ElasticBody& body);

}  // namespace palpate
