// [[foundation]] and [[spring]] of a boundary file -> the soft supports of a body.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "formats/organ_config.h"
#include "precompute/elements/elastic_body.h"

namespace palpate {

// select: gives the nodes of the body, ascending, that some selectors pick. The body has its nodes and triangles. metres:
// of a unit of the boundary file's points. Errors: InputError that names file and line of a foundation without a triangle and
// of a spring that begins where it ends.
void place_supports(const BoundaryConfig& boundary, double metres, const std::filesystem::path& file,
                    const std::function<std::vector<std::int32_t>(const std::vector<Selector>&)>& select,
                    ElasticBody& body);

// The triangles whose three corners are among the nodes, ascending.
std::vector<std::int32_t> triangles_on(const ElasticBody& body, const std::vector<std::int32_t>& nodes);

}  // namespace palpate
