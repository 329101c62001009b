// A beam with all kinds of supports, and its nodes in the order of a solver.
#pragma once

#include "tests/runtime/large/discs.h"
#include "tests/runtime/large/soft_supports.h"

namespace palpate::tests {

// The beam with a single held dof at its tip, and, where `soft`, a foundation and two springs.
inline ElasticBody beam_with_supports(bool soft) {
  ElasticBody elastic = beam();
  hold(elastic, [](const auto& p) { return p[0] == 0.1 && p[1] == 0 && p[2] == 0 ? 2 : 0; });
  if (!soft) return elastic;
  add_foundation(elastic, 1e6, 2e5, [](const auto& p) { return p[2] == 0; });
  const auto last = static_cast<std::int32_t>(elastic.nodes.size()) - 1;
  elastic.springs.push_back({"far apart", {{last, 3, 300, {0, 0.6, 0.8}}, {last, Spring::kWorld, 200}}});
  return elastic;
}

// Nodes in an order of their own, held ones behind the others, as a solver places them.
inline std::vector<std::int32_t> places_of(const HyperelasticBody& body, std::int32_t* rows) {
  const auto order = elimination_order(body);
  std::vector<std::int32_t> place(static_cast<std::size_t>(body.node_count), -1);
  *rows = 0;
  for (const auto n : order) place[static_cast<std::size_t>(n)] = (*rows)++;
  std::int32_t last = *rows;
  for (auto& p : place)
    if (p < 0) p = last++;
  return place;
}

}  // namespace palpate::tests
