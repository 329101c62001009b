// The touch steps of organs that touch one another or that links join: begun, solved as one, finished.
#pragma once

#include <cstdint>

#include "runtime/contact/touch_step.h"
#include "runtime/include/palpate/palpate_world_pairs.h"
#include "runtime/world/joint_solver.h"
#include "runtime/world/pair_search.h"
#include "runtime/world/world_links.h"

namespace palpate {

class TouchingOrgans {
 public:
  // organs: [count], borrowed. most_pairs 0: organs pass through one another.
  bool create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t count, std::int32_t most_pairs,
              double friction, std::int32_t most_links);
  bool is_on() const { return organ_count_ > 0; }
  bool has_pairs() const { return search_bytes_ > 0; }
  // Tells the bundles' logs where organs overlap.
  void say_overlaps() const;

  // One step: begin() of each organ, then find_pairs(), request_links() and solve(), then finish() of each organ, which returns its step
  // flags, then end_links().
  void begin(std::int32_t organ, const palpate_tool* tools, std::int32_t tool_count, double dt, palpate_contacts& out);
  // Finds the pairs and requests their rows. Returns step flags.
  std::uint32_t find_pairs();
  // Requests the rows of the world's links. Returns step flags.
  std::uint32_t request_links();
  // Solves the organs that have pairs or links. Returns step flags.
  std::uint32_t solve();
  std::uint32_t finish(std::int32_t organ);
  // step: the number of this step, from 1. Returns step flags.
  std::uint32_t end_links(std::uint64_t step);

  WorldLinks& links() { return links_; }
  const WorldLinks& links() const { return links_; }

  // Of the step.
  std::int32_t pair_count() const { return search_.count(); }
  void write_pair(std::int32_t i, palpate_world_pair* out);
  std::int32_t sweeps() const { return sweeps_; }

  // Vertices that the search looks through, and the memory of search and solver.
  std::int32_t vertices() const { return search_.vertices(); }
  std::uint64_t search_bytes() const { return search_bytes_; }
  std::uint64_t solver_bytes() const { return solver_bytes_; }
  std::uint64_t link_bytes() const { return link_bytes_; }

  void forget();

 private:
  TouchState& touch(std::int32_t organ) const { return organs_[organ]->touch; }
  const ContactConstraints& acting(std::int32_t organ);
  void request_pairs();
  ContactLaw law_of(const OrganPair& pair) const;
  std::int32_t request_side(const OrganPair& pair, int side);
  bool is_held_pair(std::int32_t i) const;
  Vec3 target_of(std::int32_t i);
  bool is_missed(std::int32_t l) const;
  std::uint32_t solve_together(const std::int32_t* members, std::int32_t count);
  void take_reactions(const std::int32_t* members, std::int32_t count);
  std::uint32_t solve_slipping(const std::int32_t* members, std::int32_t count, std::int32_t pair_count,
                               Operations operations);

  palpate_scene* const* organs_ = nullptr;
  std::int32_t organ_count_ = 0;
  double friction_ = 0;
  PairSearch search_;
  WorldLinks links_;
  JointSolver joint_;
  TouchStep step_[PALPATE_MAX_ORGANS];
  bool is_joint_[PALPATE_MAX_ORGANS] = {};  // in this step, solved with others
  ContactSolver::Outcome outcome_[PALPATE_MAX_ORGANS] = {};
  JointOrgan member_[PALPATE_MAX_ORGANS];
  // [most_pairs + most_links] each:
  JointPair* pairs_ = nullptr;       // of all organs; behind them the links that act
  JointPair* together_ = nullptr;    // of those that are solved as one
  std::int32_t* number_ = nullptr;   // of together_ in pairs_
  std::int32_t* link_of_ = nullptr;  // [most_links] which link is which of those behind the pairs
  std::int32_t acting_links_ = 0;
  std::int32_t sweeps_ = 0;
  std::uint64_t search_bytes_ = 0, solver_bytes_ = 0, link_bytes_ = 0;
};

}  // namespace palpate
