// Re-basing: what a cut has added to the compliance so far becomes a part of a base (cut_base.h), and its rank begins at zero again.
//
// The cost of a step grows with the square of the rank. From a rank on, the steps find
//     A' = A + Z M Z^T    between all nodes of the surface that move, with Z and M as they are when it begins,
// tile by tile, within the operations that each of them has left. Meanwhile the cut goes on with the compliance that there is. Then a second compliance
// begins on the new base, takes the changes that have come since, again within the operations of the steps, and the two change places.
//
// All of it happens in the thread of the touch and is counted, not timed: so a recorded run, and a state that is saved at any time, go on with the same bits.
// A restored scene begins with the uncut body, and makes all changes and bases again.
#pragma once

#include <algorithm>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/offset.h"
#include "runtime/cut/cut_base.h"
#include "runtime/cut/cut_compliance.h"
#include "runtime/cut/cut_field.h"
#include "runtime/cut/cut_log.h"
#include "runtime/cut/cut_response.h"

namespace palpate {

class CutRebase {
 public:
  // All borrowed.
  struct Parts {
    const HyperelasticBody* body = nullptr;
    SupportedSurface supports;
    const PairCompliance* pairs = nullptr;  // of the uncut body
    CutCapacity capacity;                   // of the compliance
    std::int32_t at = 0;                    // the rank
    std::int32_t most_slots = 0;            // nodes on which a cut may act
    CutCompliance* compliance = nullptr;
    CutResponse* response = nullptr;
    CutField* field = nullptr;
    const Offset* offset = nullptr;
  };
  // Memory: 144 n^2 bytes for n nodes that move, and that of a CutCompliance and of its PatternFields.
  bool create(SceneMemory& memory, const Parts& parts);
  // After all rows of the offset are there. Memory: 24 bytes for each row and node.
  bool take_loads(SceneMemory& memory);
  void forget();

  bool is_idle() const { return state_.stage == kIdle; }
  std::int32_t count() const { return state_.count; }
  // Of the compliance that follows.
  std::int32_t rank() const { return state_.stage == kFollow ? next_.rank() : 0; }
  // Counted operations of the last follow(), beside those of the compliance.
  double take_operations() { return next_fields_.take_operations(); }
  double most_operations() const { return cost_of_tile(kRun, parts_.capacity.patterns, true); }

  // Whether a unit of a change may find no room in the compliance. It then waits for the next base, where that has more.
  bool is_short() const {
    const CutCapacity& has = parts_.capacity;
    const std::int32_t of_unit = std::min(kMostOfUnit, (has.patterns - parts_.at) / 2);
    return compliance().rank() + of_unit > has.patterns ||
           (has.nodes < parts_.most_slots && compliance().slots() + of_unit > has.nodes);
  }
  bool makes_room() const { return !is_idle() || (may_begin() && compliance().rank() > 0); }
  void ask() { state_.is_asked = 1; }
  bool is_due() const { return is_idle() && may_begin() && (state_.is_asked != 0 || compliance().rank() >= parts_.at); }

  // place: in the log, up to which the compliance has all. Cost: copies of M and of the mesh, and for each row of the offset rank multiply-adds for
  // each number of the field.
  void begin(std::int32_t place);
  bool fills() const { return state_.stage == kFill; }
  // One more tile of A'. Returns its operations.
  double fill_tile();
  // All tiles are there, and the next compliance takes what came since begin(); followed(): the place in the log up to which it has all.
  bool follows() const { return state_.stage == kFollow; }
  std::int32_t followed() const { return state_.followed; }
  // One unit more, up to a place in the log. apply(CutCompliance&) makes it. False where it cannot be made: the base is to be given up.
  template <class Apply>
  bool follow(std::int32_t end, Apply apply) {
    if (!apply(next_)) return false;
    next_fields_.add_nodes([](std::int32_t, std::int32_t) {});
    state_.followed = end;
    return next_fields_.add_patterns();
  }
  void give_up() { state_.stage = kIdle, state_.is_given_up = 1; }
  // It has caught up: it is the compliance from now on. replayed: of a saved state.
  void finish(bool replayed);

  // Of a saved state, which has been restored: makes all units and bases again. for_each: CutLog::for_each_done(); take(unit) makes one, apply(unit,
  // compliance) makes it with another compliance.
  template <class ForEach, class Take, class Apply>
  void restore(ForEach for_each, Take take, Apply apply);

 private:
  static constexpr std::int32_t kMost = 256;            // bases
  static constexpr std::int32_t kMostOfUnit = 96;       // patterns or slots
  static constexpr std::int32_t kBlock = 4, kRun = 64;  // nodes of a tile, in its rows and its columns
  enum Stage : std::int32_t { kIdle, kFill, kFollow };
  struct State {
    std::int32_t stage, block, run;       // what of A' is there
    std::int32_t begun, followed, count;  // places in the log; bases so far
    std::int32_t is_asked, is_given_up;
  };
  const CutCompliance& compliance() const { return *parts_.compliance; }
  const CutBase* base() const { return parts_.response->fields().base(); }
  CutBase& other_base() { return bases_[base() == &bases_[0]]; }
  bool may_begin() const { return state_.count < kMost && state_.is_given_up == 0; }
  static double cost_of_tile(std::int32_t nodes, std::int32_t rank, bool is_first);
  void weigh_block();

  Parts parts_;
  CutCompliance next_;
  PatternFields next_fields_;
  BaseNumbers numbers_;
  CutBase bases_[2];
  BasePairs pairs_[2];
  State state_ = {};
  std::int32_t* begun_ = nullptr;  // [kMost] the places in the log where those that are finished began
  std::int32_t rank_ = 0;          // of M as it was at begin()
  double* matrix_ = nullptr;       // [rank][stride] M at begin()
  double* weighed_ = nullptr;      // [3 kBlock][stride] Z M of a block
  struct Scratch {
    double *z = nullptr, *product = nullptr, *tile = nullptr;
    float* moved = nullptr;
  } scratch_;
};

template <class ForEach, class Take, class Apply>
void CutRebase::restore(ForEach for_each, Take take, Apply apply) {
  const State saved = state_;
  state_ = {};
  const auto begin_at = [&](std::int32_t place) {
    begin(place);
    const bool all = state_.count < saved.count || saved.stage == kFollow;
    while (fills() && (all || state_.block < saved.block || state_.run < saved.run)) fill_tile();
    if (state_.count < saved.count) finish(true);
  };
  // Where the next one begins.
  const auto next = [&] {
    return state_.count < saved.count ? begun_[state_.count] : saved.stage != kIdle ? saved.begun : INT32_MAX;
  };
  for_each(0, [&](const auto& unit, std::int32_t at) {
    while (is_idle() && at >= next()) begin_at(next());
    take(unit);
    return true;
  });
  while (is_idle() && next() != INT32_MAX) begin_at(next());
  for_each(saved.begun, [&](const auto& unit, std::int32_t at) {
    return saved.stage == kFollow && at < saved.followed &&
           follow(at + CutLog::kUnit, [&](CutCompliance& of) { return apply(unit, of); });
  });
  take_operations();  // of no step
  state_ = saved;
}

}  // namespace palpate
