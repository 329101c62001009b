// What a cut adds to the response of the surface nodes: the patterns of cut_compliance.h at each of them. Z (pattern_fields.h) is held for all surface
// nodes. So the cut body has
//     W' = C + A + Z M Z^T    between contact nodes,
//     u = o + (C + A) (f + df) + Z M (Z^T (f + df) + P^T o)    at all surface nodes, under forces f and what the offset and the preload make of the body
// without the patterns, o, with A, what the base adds (cut_base.h), and df, what divided nodes have of the loads that make o, less what they have in the base
// (take_loads()).
// A new node is a surface node of the bundle that has waited in no tetrahedron (reserve); it has the columns and rows of the node that it comes from.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/offset_rows.h"
#include "runtime/bundle/tensors.h"
#include "runtime/contact/changed_body.h"
#include "runtime/cut/cut_compliance.h"
#include "runtime/cut/pattern_fields.h"

namespace palpate {

class CutResponse final : public ChangedBody {
 public:
  struct Source {
    PatternFields::Source of;
    CutCompliance* compliance = nullptr;  // the same as of.compliance
    const double* preload = nullptr;      // [nodes][3] m: displacement by the preload; nullptr: none
    std::int32_t responses = 0;           // of contact nodes that are remembered
    bool moves = true;                    // what the offset and the preload make of the cut is a part of moved()
  };
  // All borrowed. Memory: that of PatternFields, 48 bytes for each remembered response and pattern, and 110 for each surface node.
  bool create(SceneMemory& memory, const Source& source);

  // The loads of the offset's rows and of the preload, of which nodes that split take their parts. After all rows are there. may_divide: [nodes of
  // body] 1: the rows have all nodes around. Memory: 12 bytes for each row and node. False where memory ends.
  bool take_loads(SceneMemory& memory, const HyperelasticBody& body, const std::uint8_t* may_divide,
                  const OffsetRows& rows);

  // After a change of the compliance: Z of its new patterns and nodes. False where a pair is not known. replayed: the change is one of a saved
  // state, which has what it moved. Cost: PatternFields::add_patterns(), and the new rows.
  bool take_change(bool replayed);
  // The compliance and Z of it are others from now on, of the same body. replayed: as above.
  PatternFields& fields() { return fields_; }
  void note_exchange(bool replayed);
  // What the cut does to the displacement by a row of the offset, per unit, or by the preload where load is the number of rows: [3 surface nodes] m.
  void find_moved_by(const OffsetRows& rows, std::int32_t load, float* moved);
  // Rows of the offset and the preload that move the body.
  std::int32_t loads() const { return source_.moves ? load_rows_ + (source_.preload ? 1 : 0) : 0; }
  // The compliance has forgotten its changes.
  void forget(bool replayed);
  // Of a state that is saved.
  void keep(SceneMemory& memory);

  std::int32_t version() const override { return version_; }
  std::int32_t at_rest(std::int32_t node) const override { return fields_.at_rest(node); }
  void find_response(std::int32_t node) override;
  Mat3 between(std::int32_t other) const override;
  void begin_step(const Offset& offset) override;

  // Of a new node: the surface node that it split from.
  std::int32_t parent(std::int32_t own) const {
    const PatternFields::Source& of = source_.of;
    return fields_.surface_node(of.compliance->tissue().parent(of.rest_nodes + own - of.first_reserve));
  }
  std::int32_t surface_nodes() const { return source_.of.surface_nodes; }
  std::int32_t new_nodes() const { return fields_.new_nodes(); }
  std::int32_t first_new() const { return fields_.first_new(); }
  // Surface nodes below it may move; the others are still in reserve.
  std::int32_t nodes() const { return fields_.nodes(); }
  bool is_cut() const { return fields_.filled() > 0; }
  std::int32_t rank() const { return fields_.filled(); }
  std::size_t stride() const { return fields_.stride(); }
  const PatternFields& fields() const { return fields_; }

  // Several sets of forces or offsets at once, a row of stride() numbers for each; at most kMostRows.
  static constexpr int kMostRows = 8;
  // x += Z^T f of a force on a surface node.
  void add_force(std::int32_t node, Vec3 force, double* x) const;
  // M x of `count` rows. The rows of x are zero from rank() on.
  void multiply(const double* x, int count, double* y) const { source_.compliance->multiply(x, count, y); }
  // out[3 node + axis][kMostRows]: Z y of `count` rows at the nodes below nodes().
  void spread(const double* y, int count, double* out) const;

 private:
  // Amounts of the offset's rows, and of the preload.
  struct Amounts {
    const double* row;
    double preload;
  };
  std::int32_t all_loads() const { return load_rows_ + (source_.preload ? 1 : 0); }
  void find_moved(const OffsetRows& rows, const Amounts& amounts, float* moved);
  void add_divided_loads(const OffsetRows& rows, const Amounts& amounts);
  void add_load(const OffsetRows& rows, const Amounts& amounts, std::int32_t node, const LoadShare& has);
  double* row(std::int32_t node) const { return fields_.row(node); }

  Source source_;
  PatternFields fields_;
  std::size_t stride_ = 0;
  std::int32_t version_ = 0, changed_ = 0;
  std::int32_t compliance_version_ = 0;
  // Responses of the last contact nodes that were asked for.
  double* response_ = nullptr;           // [responses][3][stride] M Z^T
  std::int32_t* response_of_ = nullptr;  // [responses] node
  std::int32_t response_at_ = 0, next_response_ = 0, asked_ = 0;
  double* amount_ = nullptr;  // [rows of the offset] of the last step
  float* load_ = nullptr;     // [loads()][rest_nodes][3] N: per unit of each row; by the preload
  std::int32_t load_rows_ = 0;
  struct Scratch {
    double *x = nullptr, *y = nullptr;  // [stride]
    double* alone = nullptr;     // [stride] N, df as amounts of patterns that are unit forces: C df is Z times it
    double* spread = nullptr;    // [3 surface nodes][kMostRows]
    float* moved = nullptr;      // [surface nodes][3] m
    Vec3* slot_moved = nullptr;  // [slots] m
  } scratch_;
};

}  // namespace palpate
