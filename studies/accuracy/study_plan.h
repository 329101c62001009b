// The list of points to measure: one axis at a time is varied about the organ's default setting.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "studies/accuracy/organ_case.h"
#include "studies/accuracy/setting.h"

namespace palpate::accuracy {

struct PlannedPoint {
  Setting setting;
  std::set<std::string> axes;  // "mesh", "poisson", "tolerance", "storage", "contact", "law", ...; "reference"
};

// Each setting appears once. The meshes that may be the reference come first, fine to coarse, with each of the elements
// `references`. crowd: the number of sites for settings with more contacts than --sites.
std::vector<PlannedPoint> plan_study(const OrganCase& organ, int crowd, const std::vector<std::string>& references);

}  // namespace palpate::accuracy
