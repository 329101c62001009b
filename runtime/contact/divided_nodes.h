// Which nodes of a surface that changes (surface_change.h) were divided, for what keeps the nodes that it holds. A place that is held belongs to the
// triangles that it touched: where its node was divided, it goes with most of these.
#pragma once

#include <cstdint>

#include "runtime/surface/surface_index.h"

namespace palpate {

class DividedNodes {
 public:
  // New nodes so far: 0 again after a reset. The k-th one does not change.
  virtual std::int32_t made() const { return 0; }
  // The node that now has what was held at `node` when the first `seen` new nodes were there, below a disc of that radius, m, around a place of the
  // surface (0: at the place itself). Of the parts that the node has become, the one with most of the disc's area at the node; where the disc
  // reaches no triangle of the node, the one with the place's triangle, or else the nearest. Cost: the new nodes; the triangles around a node that
  // was divided.
  virtual std::int32_t now(std::int32_t node, std::int32_t /*seen*/, const SurfacePoint&, double /*radius*/) const {
    return node;
  }
  // The k-th new node, and the node that it was divided from.
  struct Pair {
    std::int32_t node, from;
  };
  virtual Pair pair(std::int32_t) const { return {}; }
  // The bundle's node that a node was before all cuts.
  virtual std::int32_t at_rest(std::int32_t node) const { return node; }

 protected:
  ~DividedNodes() = default;
};

// Nodes [count] that something holds below one disc, as above.
inline void follow_divided(const DividedNodes& divided, std::int32_t seen, const SurfacePoint& place, double radius,
                           std::int32_t* nodes, std::int32_t count) {
  for (std::int32_t i = 0; i < count; ++i) nodes[i] = divided.now(nodes[i], seen, place, radius);
}

}  // namespace palpate
