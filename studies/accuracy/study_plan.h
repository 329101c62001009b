// Which points are measured: one axis after another, each varied about the organ as its pipeline has it.
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

// Each setting once. The meshes of p2-p0 come first: the finest of them that is not too large is the reference.
// crowd: how many places there are for contacts beyond --places.
std::vector<PlannedPoint> plan_study(const OrganCase& organ, int crowd);

}  // namespace palpate::accuracy
