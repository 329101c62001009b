// The displacement of nodes per unit of each motion of a bundle, in the bundle's own bytes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "formats/bundle_layout.h"
#include "runtime/base/vec3.h"

namespace palpate {

struct MotionRows {
  const float* numbers = nullptr;  // [count][nodes][3] m per unit
  const float* inside = nullptr;   // [count][nodes_inside][3] of the interior nodes; nullptr: the scene has no needles
  std::int32_t count = 0, nodes = 0, nodes_inside = 0;
  const double* longest = nullptr;  // [count] m per unit, an upper bound over the nodes

  const float* row(std::int32_t motion) const {
    return numbers + 3 * static_cast<std::size_t>(motion) * static_cast<std::size_t>(nodes);
  }
  Vec3 at(std::int32_t motion, std::int32_t node) const {
    const float* const u =
        node < nodes ? row(motion) + 3 * static_cast<std::size_t>(node)
                     : inside + 3 * (static_cast<std::size_t>(motion) * static_cast<std::size_t>(nodes_inside) +
                                     static_cast<std::size_t>(node - nodes));
    return {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
  }
  // m, under the amounts [count]. A motion of amount zero is not read.
  Vec3 sum_at(const double* amount, std::int32_t node) const {
    Vec3 sum;
    for (std::int32_t m = 0; m < count; ++m)
      if (amount[m] != 0) sum += amount[m] * at(m, node);
    return sum;
  }
};

}  // namespace palpate
