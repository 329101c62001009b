// Warns where the chosen element is known to be too stiff for this body.
#pragma once

#include <string>
#include <vector>

#include "formats/organ_config.h"
#include "precompute/elements/elastic_body.h"

namespace palpate {

// At most one sentence for each of these:
// - The element is p1 and a Poisson's ratio is above 0.4: p1 locks, that is, it becomes far too stiff near 0.5.
// - The element is p1-anp, a Poisson's ratio is above 0.4, and a thin layer lies on a support: fewer than four elements
//   separate more than 1 % of the touchable nodes from a held face on the opposite side. Elements are counted along the
//   edges of the mesh; two faces are opposite where their normals differ by more than 120 degrees.
std::vector<std::string> element_warnings(const ElasticBody& body, Element element);

}  // namespace palpate
