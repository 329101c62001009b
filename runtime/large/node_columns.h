// Columns of the metric's inverse at single nodes, which places that move over the same nodes share: the response of a place in a triangle or a
// tetrahedron is the weighted sum of those of its corners. So an edge or a point that slides takes a solve where it comes to another node, not in each
// step. The bits of a column do not depend on what else is known.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/large/body_metric.h"

namespace palpate {

class NodeColumns {
 public:
  // Nodes that one call of find() may ask for.
  static constexpr int kMostNodes = 16;

  // metric, energy: borrowed. most_nodes: that contacts have, 0 where no column is asked for. Memory: 36 bytes a node of the body for each column that is
  // kept, kMostKept or most_nodes.
  bool create(SceneMemory& memory, const HyperelasticEnergy* energy, const BodyMetric* metric, std::int32_t most_nodes);
  // Which nodes are known decides what later steps solve: a saved state has it, and know() finds the columns again.
  struct Known;
  void keep(SceneMemory& memory);
  Known known() const;
  void know(const Known& known);
  // The metric is another one.
  void forget();

  // Makes the columns of these places known (HyperelasticEnergy::place()); those of earlier calls may go. Held places are left out. Returns
  // the solves that it took: three for each that was not known.
  std::int32_t find(const std::int32_t* places, std::int32_t count);
  // [length] m/N, of a place of the last find() that moves.
  const float* column(std::int32_t place, int axis) const { return numbers(entry_of(place), axis); }

 private:
  static constexpr std::int32_t kMostKept = 64;
  struct Entry {
    std::int32_t place = -1, used = 0;  // place: -1: none; used: the call that asked for it last
  };
  std::int32_t entry_of(std::int32_t place) const;
  std::int32_t oldest() const;
  void solve(const std::int32_t* entries, int count);
  float* numbers(std::int32_t entry, int axis) const {
    return numbers_ + static_cast<std::size_t>(3 * entry + axis) * energy_->length();
  }

  const HyperelasticEnergy* energy_ = nullptr;
  const BodyMetric* metric_ = nullptr;
  std::int32_t kept_ = 0;     // columns at most
  Entry* entries_ = nullptr;  // [kept]
  float* numbers_ = nullptr;  // [kept][3][length]
  std::int32_t calls_ = 0;
};

struct NodeColumns::Known {
  Entry entries[kMostKept];
  std::int32_t calls;
};

}  // namespace palpate
