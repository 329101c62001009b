// Where an element is known to be too stiff for the body it is to compute.
#pragma once

#include <string>
#include <vector>

#include "formats/organ_config.h"
#include "precompute/elements/elastic_body.h"

namespace palpate {

// One sentence each, none where there is nothing to say:
// - p1 with a Poisson's ratio above 0.4 locks.
// - p1-anp with fewer than four elements between a held face and a touchable one opposite, counted along the edges of the
//   mesh from the nearest held vertex; opposite: normals more than 120 degrees apart. Said when more than one in a hundred
//   touchable nodes are concerned.
std::vector<std::string> element_warnings(const ElasticBody& body, Element element);

}  // namespace palpate
