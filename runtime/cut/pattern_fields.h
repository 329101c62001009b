// Z at all surface nodes: what the patterns of cut_compliance.h do to them. It grows with the patterns, of which none changes any more.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/tensors.h"
#include "runtime/cut/cut_base.h"
#include "runtime/cut/cut_compliance.h"

namespace palpate {

class PatternFields {
 public:
  // All borrowed.
  struct Source {
    const CutCompliance* compliance = nullptr;
    const Tensors* tensors = nullptr;
    const std::int32_t* touchable = nullptr;  // [columns of the surface] the node of each
    // Nodes between which `pairs` knows the compliance, in double precision; elsewhere it is the tensors'.
    const PairCompliance* pairs = nullptr;
    const std::int32_t* pair_nodes = nullptr;
    std::int32_t pair_count = 0;
    std::int32_t rest_nodes = 0;  // of the mesh: the compliance's new nodes have the numbers behind
    std::int32_t surface_nodes = 0;
    std::int32_t first_reserve = 0;  // the surface nodes from here on become the new nodes, in their order
  };
  // Memory: 24 bytes for each surface node and pattern, 360 for each surface node, 600 for each slot.
  bool create(SceneMemory& memory, const Source& source);
  // Of the same source, but for the compliance: beside `other`, which is not asked at the same time.
  bool create_beside(SceneMemory& memory, const PatternFields& other, const CutCompliance& compliance);
  // It may get a base, whose rows are `stride` numbers apart. base_number: [surface nodes], borrowed.
  bool create_base(SceneMemory& memory, const std::int32_t* base_number, std::size_t stride);

  void forget();
  // As `now` is, without a pattern, on a base that has all its nodes.
  void begin_from(const PatternFields& now, const CutBase& base);
  // Everything but the compliance.
  void exchange(PatternFields& other);

  // The compliance has more new nodes: calls visit(own, parent), surface nodes, for each.
  template <class Visit>
  void add_nodes(Visit visit) {
    const CutTissue& tissue = source_.compliance->tissue();
    while (source_.rest_nodes + new_count_ < tissue.nodes()) {
      const std::int32_t own = first_new() + new_count_,
                         parent = surface_node(tissue.parent(source_.rest_nodes + new_count_));
      add_node(own, parent);
      visit(own, parent);
    }
  }
  // The compliance has more patterns. False where a pair is not known. Cost: for each slot of the new patterns the column of its node, for
  // each of their forces three multiply-adds at each surface node; on a base, twice as much.
  bool add_patterns();
  // Counted operations of add_patterns() since the last call.
  double take_operations() {
    const double counted = operations_;
    operations_ = 0;
    return counted;
  }

  const Source& source() const { return source_; }
  std::int32_t first_new() const { return source_.first_reserve; }
  std::int32_t new_nodes() const { return new_count_; }
  // Surface nodes below it may move; the others are still in reserve.
  std::int32_t nodes() const { return source_.first_reserve + new_count_; }
  std::int32_t filled() const { return filled_; }
  std::int32_t at_rest(std::int32_t node) const { return node < source_.surface_nodes ? origin_[node] : node; }
  // The surface node of a node of the compliance, old or new.
  std::int32_t surface_node(std::int32_t node) const {
    return node < source_.rest_nodes ? node : source_.first_reserve + node - source_.rest_nodes;
  }
  double* row(std::int32_t node) const { return z_ + 3 * static_cast<std::size_t>(node) * stride_; }
  std::size_t stride() const { return stride_; }

  const CutBase* base() const { return base_; }
  // The number in the base of a surface node, or of the one that it comes from; -1: there is none.
  std::int32_t number_in_base(std::int32_t node) const { return base_ ? number_[node] : -1; }
  // What the base adds to the compliance between two surface nodes, m/N.
  Mat3 added(std::int32_t a, std::int32_t b) const;
  // What the base adds under forces on surface nodes, one after the other.
  void begin_sum() const;
  void add_to_sum(std::int32_t node, Vec3 force) const;
  // m, of the nodes by their numbers in the base, until the next begin_sum(); a base is there.
  const double* end_sum() const;

 private:
  struct Entry {  // of a pattern
    std::int32_t pattern, next;
    Vec3 force;
  };
  void add_node(std::int32_t own, std::int32_t parent);
  bool fill(std::int32_t first, std::int32_t end);
  bool superpose_patterns(std::int32_t first, std::int32_t end);
  bool list_rows(std::int32_t pattern, std::size_t at, int* count);
  template <class Read, class Index>
  bool fill_by_columns(std::int32_t first, std::int32_t end, const double* column, std::int32_t count, Read read,
                       Index index);
  void add_base(std::int32_t first, std::int32_t end);
  double cost_of(std::int32_t first, std::int32_t end) const;
  bool read_column(std::int32_t node);
  bool read_pairs(std::int32_t node);
  void flush_sum() const;

  Source source_;
  double* z_ = nullptr;             // [surface nodes][3][stride]
  std::int32_t* origin_ = nullptr;  // [surface nodes] at rest
  std::int32_t* number_ = nullptr;  // [surface nodes] in the base
  const std::int32_t* base_number_ = nullptr;
  const CutBase* base_ = nullptr;
  std::size_t stride_ = 0;
  std::int32_t new_count_ = 0, filled_ = 0;
  struct Shared {
    std::int32_t* column = nullptr;     // [surface nodes] of the node at rest; -1: it has none
    std::int32_t* pair = nullptr;       // [surface nodes] which of the nodes of `pairs`; -1: none
    double* of_node = nullptr;          // [3][3 surface nodes] the column of a slot's node
    double* pair_row = nullptr;         // [3][3 pair_count]
    double* pattern = nullptr;          // [kPatternsAtOnce][3 surface nodes]
    float* moved_by = nullptr;          // [kPatternsAtOnce][surface nodes][3] m per unit of a pattern
    const void** row = nullptr;         // [kPatternsAtOnce][3 slots]
    float* coefficient = nullptr;       // [kPatternsAtOnce][3 slots]
    Entry* entry = nullptr;             // [kMostEntries]
    std::int32_t* first = nullptr;      // [slots] into entry, plus 1
    std::int32_t* slot = nullptr;       // [slots] that have entries
    double* sum = nullptr;              // [kPatternsAtOnce][stride of a base]
    const double** sum_row = nullptr;   // [kMostSources]
    double* sum_coefficient = nullptr;  // [kPatternsAtOnce][kMostSources]
  } shared_;
  double operations_ = 0;
  mutable std::int32_t sources_ = 0;
};

}  // namespace palpate
