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

// Each setting appears once. The p2-p0 meshes come first, because the finest one that is not too large is the reference.
// crowd: the number of sites for settings with more contacts than --sites.
std::vector<PlannedPoint> plan_study(const OrganCase& organ, int crowd);

}  // namespace palpate::accuracy
