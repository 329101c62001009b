// The displacements of surface nodes that were evaluated since forget(): each node once, and all at once where many are asked for.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/step_work.h"
#include "runtime/bundle/load_field.h"

namespace palpate {

class KnownNodes {
 public:
  // nodes: of the surface. Contacts hold these; other constraints may hold nodes inside, which are never known.
  bool create(SceneMemory& memory, std::int32_t nodes);
  // What is known costs a step less work, which is counted: it is a part of the state.
  void keep_state(SceneMemory& memory);
  void forget();
  // For the nodes that come next: loads that act on each; many: all nodes are likely to be asked for.
  void expect(std::int32_t acting, bool many);

  bool has(std::int32_t node) const {
    assert(node < nodes_);
    return stamp_[node] == now_;
  }
  Vec3 at(std::int32_t node) const { return at_[node]; }
  Vec3 keep(std::int32_t node, Vec3 u) {
    stamp_[node] = now_;
    return at_[node] = is_finite(u) ? u : Vec3{};
  }
  // are_many(): so many nodes were evaluated one by one that all at once would cost less. are_all(): all were evaluated at once.
  bool are_many() const { return count_ > few_; }
  bool are_all() const { return count_ > nodes_; }

  // m: of the loads and added(node). beside: operations of one added(). as_rows: the tensors are stored as rows. A node that is not known costs
  // its loads; where it is one too many, all nodes are evaluated, if that fits. Zero where the query ends.
  template <class Added>
  Vec3 recall(std::int32_t node, const LoadField& loads, bool as_rows, Operations beside, QueryWork* work,
              Added added) {
    if (has(node)) return at_[node];
    if (const Operations all = nodes_ * (in_run(loads.acting()) + beside); are_many() && as_rows && work->fits(all)) {
      work->take(all);
      evaluate_all(loads, added);
      return at_[node];
    }
    if (!work->take(alone(loads.acting()) + beside)) return {};
    ++count_;
    return keep(node, loads.at_node(node) + added(node));
  }

  // Operations of a node under that many loads, three distant reads for each; of one among all nodes, which are evaluated at once.
  static Operations alone(std::int32_t loads) { return 10 + Operations{3} * loads; }
  static Operations in_run(std::int32_t loads) { return 5 + Operations{loads}; }
  bool all_cost_much(std::int32_t loads) const { return nodes_ * in_run(loads) > kMostOneByOne; }

 private:
  // Share of the nodes that is evaluated one by one before all others are at once; where the field before was evaluated at all nodes,
  // the smaller one. For many loads fewer: so many operations at most. Where the query has no room for all at once, one by one.
  static constexpr std::int32_t kFew = 3, kFewAgain = 32;
  static constexpr Operations kMostOneByOne = 60'000;
  static constexpr std::int32_t kRun = 64;  // nodes that are evaluated at a time

  // Those that are known stay.
  template <class Added>
  void evaluate_all(const LoadField& loads, Added added) {
    count_ = nodes_ + 1;
    double run[3 * kRun];
    for (std::int32_t first = 0; first < nodes_; first += kRun) {
      const std::int32_t nodes = std::min(kRun, nodes_ - first);
      loads.at_run(first, nodes, run);
      for (std::int32_t n = 0; n < nodes; ++n)
        if (!has(first + n)) keep(first + n, load3(run + 3 * n) + added(first + n));
    }
  }

  Vec3* at_ = nullptr;              // [nodes] m
  std::uint32_t* stamp_ = nullptr;  // [nodes] of the evaluation
  std::uint32_t now_ = 0;
  std::int32_t nodes_ = 0;
  std::int32_t count_ = 0;  // nodes that were evaluated one by one; nodes + 1: all were, at once
  std::int32_t few_ = 0;    // of these, before all others are
};

}  // namespace palpate
