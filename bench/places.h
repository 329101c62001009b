// Places of an organ that a benchmark presses, the same ones for every mesh of it.
#pragma once

#include <vector>

#include "runtime/base/vec3.h"
#include "runtime/include/palpate/palpate.hpp"

namespace palpate::bench {

// Farthest-point sampling among the touchable nodes, away from the border of the touchable region.
inline std::vector<Vec3> spread_places(const Bundle& bundle, int count) {
  const palpate_bundle_info info = bundle.describe();
  std::vector<char> touchable(static_cast<std::size_t>(info.surface_node_count), 0), border(touchable);
  for (int k = 0; k < info.touchable_count; ++k) touchable[bundle.touchable()[k]] = 1;
  for (int round = 0; round < 2; ++round) {
    const std::vector<char> before = border;
    for (int t = 0; t < info.triangle_count; ++t) {
      bool near_border = false;
      for (int v = 0; v < 3; ++v) {
        const int n = bundle.triangles()[3 * t + v];
        near_border = near_border || !touchable[n] || before[n];
      }
      for (int v = 0; near_border && v < 3; ++v) border[bundle.triangles()[3 * t + v]] = 1;
    }
  }
  std::vector<Vec3> places;
  std::vector<double> distance(touchable.size(), INFINITY);
  int next = -1;
  for (std::size_t n = 0; n < touchable.size() && next < 0; ++n)
    if (touchable[n] && !border[n]) next = static_cast<int>(n);
  while (next >= 0 && static_cast<int>(places.size()) < count) {
    const Vec3 place = load3(bundle.nodes() + 3 * next);
    places.push_back(place);
    next = -1;
    for (std::size_t n = 0; n < touchable.size(); ++n) {
      if (!touchable[n] || border[n]) continue;
      distance[n] = std::min(distance[n], length(load3(bundle.nodes() + 3 * n) - place));
      if (next < 0 || distance[n] > distance[next]) next = static_cast<int>(n);
    }
  }
  return places;
}

}  // namespace palpate::bench
