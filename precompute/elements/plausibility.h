// Warns where a right file holds what hardly can be meant: sizes, stiffnesses and supports that no organ has. Most often a unit is
// wrong.
#pragma once

#include <string>
#include <vector>

#include "formats/plausible_size.h"
#include "precompute/elements/elastic_body.h"

namespace palpate {

inline constexpr double kSoftestTissue = 100, kStiffestTissue = 1e7;  // Pa
inline constexpr double kLeastHeldShare = 0.01;                       // of the surface's area

// A sentence, which names the file, the figure and what was probably meant, for each of these:
// - The organ's longest side is below kSmallestOrgan or above kLargestOrgan.
// - Young's modulus of a region is outside kSoftestTissue to kStiffestTissue.
// - Less than kLeastHeldShare of the surface's area is supported: the triangles count that lie on a foundation, and those whose
//   three nodes are held along an axis or tied by a spring.
// Errors: none. Cost: one pass over the surface.
std::vector<std::string> plausibility_warnings(const ElasticBody& body, const OrganConfig& organ,
                                               const BodyFiles& files);

}  // namespace palpate
