// Bodies of the tests of large deformation on foundations and springs.
#pragma once

#include <algorithm>

#include "studies/bodies/bodies.h"

namespace palpate::tests {

// A foundation under the triangles whose corners are all where `where` says.
inline void add_foundation(ElasticBody& body, double normal, double tangential,
                           const std::function<bool(const std::array<double, 3>&)>& where) {
  Foundation foundation{"soft", normal, tangential, {}};
  for (std::size_t t = 0; t < body.triangles.size(); ++t)
    if (std::all_of(body.triangles[t].begin(), body.triangles[t].end(),
                    [&](std::int32_t n) { return where(body.nodes[static_cast<std::size_t>(n)]); }))
      foundation.triangles.push_back(static_cast<std::int32_t>(t));
  body.foundations.push_back(foundation);
}

// Ties each node where `where` says to the world, along every axis.
inline void add_springs(ElasticBody& body, double stiffness,
                        const std::function<bool(const std::array<double, 3>&)>& where) {
  SpringSet set{"springs", {}};
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    if (where(body.nodes[n])) set.springs.push_back({static_cast<std::int32_t>(n), Spring::kWorld, stiffness});
  body.springs.push_back(set);
}

}  // namespace palpate::tests
