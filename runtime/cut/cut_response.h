// What a cut adds to the response of the surface nodes: the patterns of cut_compliance.h at each of them. Z is held for all surface nodes and grows
// with the patterns, of which none changes any more. So the cut body has
//     W' = C + Z M Z^T    between contact nodes,
//     u = o + C (f + df) + Z M (Z^T (f + df) + P^T o)    at all surface nodes, under forces f and what the offset and the preload make of the uncut body, o,
// with df, what divided nodes have of the loads that make o, less what the uncut body has (take_loads()).
// A new node is a surface node of the bundle that has waited in no tetrahedron (reserve); it has the columns and rows of the node that it comes from.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/offset_rows.h"
#include "runtime/bundle/tensors.h"
#include "runtime/contact/changed_body.h"
#include "runtime/cut/cut_compliance.h"

namespace palpate {

class CutResponse final : public ChangedBody {
 public:
  // All borrowed.
  struct Source {
    CutCompliance* compliance = nullptr;
    const Tensors* tensors = nullptr;
    const std::int32_t* touchable = nullptr;  // [columns of the surface] the node of each
    // Nodes between which `pairs` knows the compliance, in double precision; elsewhere it is the tensors'.
    const PairCompliance* pairs = nullptr;
    const std::int32_t* pair_nodes = nullptr;
    const double* preload = nullptr;  // [nodes][3] m: displacement by the preload; nullptr: none
    std::int32_t pair_count = 0;
    std::int32_t rest_nodes = 0;  // of the mesh: the compliance's new nodes have the numbers behind
    std::int32_t surface_nodes = 0;
    std::int32_t first_reserve = 0;  // the surface nodes from here on become the new nodes, in their order
    std::int32_t responses = 0;      // of contact nodes that are remembered
    bool moves = true;               // what the offset and the preload make of the cut is a part of moved()
  };
  // Memory: 24 bytes for each surface node and pattern, twice as many for each remembered response, and 250 for each surface node.
  bool create(SceneMemory& memory, const Source& source);

  // The loads of the offset's rows and of the preload, of which nodes that split take their parts. After all rows are there. may_divide: [nodes of
  // body] 1: the rows have all nodes around. Memory: 12 bytes for each row and node. False where memory ends.
  bool take_loads(SceneMemory& memory, const HyperelasticBody& body, const std::uint8_t* may_divide,
                  const OffsetRows& rows);

  // After a change of the compliance: Z of its new patterns and nodes. False where a pair is not known. replayed: the change is one of a saved
  // state, which has what it moved. Cost: for each slot of the new patterns the column of its node, for each of their forces three
  // multiply-adds at each surface node, and the new rows.
  bool take_change(bool replayed);
  // The compliance has forgotten its changes.
  void forget(bool replayed);
  // Of a state that is saved.
  void keep(SceneMemory& memory);

  std::int32_t version() const override { return version_; }
  std::int32_t at_rest(std::int32_t node) const override { return node < source_.surface_nodes ? origin_[node] : node; }
  void find_response(std::int32_t node) override;
  Mat3 between(std::int32_t other) const override;
  void begin_step(const Offset& offset) override;

  // The surface node of a node of the compliance, old or new.
  std::int32_t surface_node(std::int32_t node) const {
    return node < source_.rest_nodes ? node : source_.first_reserve + node - source_.rest_nodes;
  }
  // Of a new node: the surface node that it split from.
  std::int32_t parent(std::int32_t own) const {
    return surface_node(source_.compliance->tissue().parent(source_.rest_nodes + own - source_.first_reserve));
  }
  std::int32_t surface_nodes() const { return source_.surface_nodes; }
  std::int32_t new_nodes() const { return new_count_; }
  std::int32_t first_new() const { return source_.first_reserve; }
  // Surface nodes below it may move; the others are still in reserve.
  std::int32_t nodes() const { return source_.first_reserve + new_count_; }
  bool is_cut() const { return filled_ > 0; }
  std::int32_t rank() const { return filled_; }
  std::size_t stride() const { return stride_; }

  // Several sets of forces or offsets at once, a row of stride() numbers for each; at most kMostRows.
  static constexpr int kMostRows = 8;
  // x += Z^T f of a force on a surface node.
  void add_force(std::int32_t node, Vec3 force, double* x) const;
  // M x of `count` rows. The rows of x are zero from rank() on.
  void multiply(const double* x, int count, double* y) const { source_.compliance->multiply(x, count, y); }
  // out[3 node + axis][kMostRows]: Z y of `count` rows at the nodes below nodes().
  void spread(const double* y, int count, double* out) const;

 private:
  struct Entry {  // of a pattern
    std::int32_t pattern, next;
    Vec3 force;
  };
  bool fill(std::int32_t first, std::int32_t end);
  bool superpose_pattern(std::int32_t pattern);
  bool fill_by_columns(std::int32_t first, std::int32_t end);
  bool read_column(std::int32_t node);
  std::int32_t loads() const { return load_rows_ + (source_.preload ? 1 : 0); }
  void add_divided_loads(const OffsetRows& rows);
  void add_load(const OffsetRows& rows, std::int32_t node, std::int32_t at_rest, double less);
  double* row(std::int32_t node) const { return z_ + 3 * static_cast<std::size_t>(node) * stride_; }

  Source source_;
  double* z_ = nullptr;             // [surface nodes][3][stride]
  std::int32_t* origin_ = nullptr;  // [surface nodes]
  std::int32_t* column_ = nullptr;  // [surface nodes] of the node at rest; -1: it has none
  std::int32_t* others_ = nullptr;  // [other_count] surface nodes at rest that `pairs` does not know
  std::size_t stride_ = 0;
  std::int32_t other_count_ = 0, new_count_ = 0, filled_ = 0, version_ = 0, changed_ = 0;
  std::int32_t compliance_version_ = 0;
  // Responses of the last contact nodes that were asked for.
  double* response_ = nullptr;           // [responses][3][stride] M Z^T
  std::int32_t* response_of_ = nullptr;  // [responses] node
  std::int32_t response_at_ = 0, next_response_ = 0;
  double* amount_ = nullptr;  // [rows of the offset] of the last step
  float* load_ = nullptr;     // [loads()][rest_nodes][3] N: per unit of each row; by the preload
  std::int32_t load_rows_ = 0;
  struct Scratch {
    double* column = nullptr;           // [3][3 surface nodes] of a slot's node
    double* pair_row = nullptr;         // [3][3 pair_count]
    double* pattern = nullptr;          // [kPatternsAtOnce][3 surface nodes]
    double *x = nullptr, *y = nullptr;  // [stride]
    double* alone = nullptr;   // [stride] N, df as amounts of patterns that are unit forces: C df is Z times it
    double* spread = nullptr;  // [3 surface nodes][kMostRows]
    float *moved = nullptr, *moved_by = nullptr;  // [surface nodes][3] m; m per unit of a pattern
    const void** row = nullptr;                   // [3 slots]
    float* coefficient = nullptr;                 // [3 slots]
    Vec3* slot_moved = nullptr;                   // [slots] m
    Entry* entry = nullptr;                       // [kMostEntries]
    std::int32_t* first = nullptr;                // [slots] into entry, plus 1
    std::int32_t* slot = nullptr;                 // [slots] that have entries
  } scratch_;
};

}  // namespace palpate
