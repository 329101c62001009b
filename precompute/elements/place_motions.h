// [[motion]] of a boundary file -> the motions of a body.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "formats/organ_config.h"
#include "precompute/elements/elastic_body.h"

namespace palpate {

// Call it after place_supports(), with the same select and metres. Errors: InputError that names file and line of a motion that
// moves no support, of a pressure without a triangle, of more than formats::kMostMotions motions, of gravity without a density; and of
// a field's file that cannot be read or has no row near a support.
void place_motions(const BoundaryConfig& boundary, double metres, const std::filesystem::path& file,
                   const std::function<std::vector<std::int32_t>(const std::vector<Selector>&)>& select,
                   ElasticBody& body);

}  // namespace palpate
