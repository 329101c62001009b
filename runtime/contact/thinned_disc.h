// A disc on fewer nodes, where a scene's limit leaves it no more.
#pragma once

#include <cstdint>

#include "runtime/base/vec3.h"

namespace palpate {

// Nodes with weights that sum to one.
struct WeightedNodes {
  std::int32_t* node;
  double* weight;  // above 0
  int count;
};

// Keeps the `most` nodes of largest weight, in their order, and changes their weights such that the sum and the weighted mean of
// the nodes' places stay. Where weights above zero cannot keep the mean, as on one node or two, only the sum stays. Returns what
// the kept nodes weighed before.
// rest: [..][3] m, places of the nodes; nullptr: only the sum stays. u, v: unit vectors along the disc: in these directions the
// mean is kept.
double thin_nodes(const double* rest, Vec3 u, Vec3 v, int most, WeightedNodes* nodes);

}  // namespace palpate
