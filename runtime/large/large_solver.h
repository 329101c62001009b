// The hyperelastic body under contacts, solved a little further in every step.
//
// The body's energy E(u) is least under the rows W u = d of the contacts. A step moves the last state onto the new targets by the
// linear response, and then takes a few steps of the limited-memory BFGS method (Nocedal 1980, Math. Comp. 35) in the metric of the
// linear stiffness K, projected onto the contacts. The pairs of the method are kept from step to step: they hold what the state has
// taught about the tangent.
//     Y = K^-1 W^T, C = W Y + L;   multiplier = C^-1 (Y^T dE/du + L s), the force of each row on the body
// L is a compliance between a row and the body (contact_patch.h), and L s the displacement that it takes: W u + L s = d.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/large/block_factor.h"
#include "runtime/large/element_lanes.h"

namespace palpate {

// One row of W: the weighted mean displacement of some nodes along a direction.
struct LargeRow {
  std::int32_t first, count;  // of its nodes and weights
  double direction[3];
  double target;         // m
  std::int32_t group;    // first row of those that share the next line
  std::int32_t unused;   // in the place of padding, which a saved state would hold
  double compliance[3];  // m/N, of L between this row and rows group, group + 1, group + 2
};
struct LargeContacts {
  const LargeRow* rows = nullptr;
  const std::int32_t* nodes = nullptr;  // of the body
  const double* weights = nullptr;
  std::int32_t row_count = 0;
};

// What a step says about itself.
struct LargeOutcome {
  std::int32_t steps = 0, evaluations = 0;
  double residual = 0;      // square root of the energy that one more step would still find, over the energy
  double least_volume = 1;  // smallest J of a tetrahedron
  bool cut = false;         // the move to the targets was shortened: the rows miss them
  bool unfinished = false;  // the steps allowed ended far from the tolerance
  bool failed = false;      // numbers were not finite: the body is at rest and the forces are zero
};

class LargeSolver {
 public:
  enum class Created { made, no_memory, not_definite };
  static constexpr int kPairs = 8;
  static constexpr int kMostSteps = 8;
  // A state is solved where one more step would find less than this share's square of the energy.
  static constexpr double kTolerance = 0.01;
  // It is unfinished where this share's square was left before the last step.
  static constexpr double kUnfinished = 0.05;
  // No step may bring a tetrahedron to this share of its volume.
  static constexpr double kLeastVolume = 0.02;

  // order: [free nodes] the nodes that are not held in all three dofs, as they are eliminated. max_rows, max_nodes: of contacts.
  // Memory: about 420 bytes a tetrahedron, the factor, 250 bytes and 12 max_rows bytes a node.
  Created create(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* order, std::int32_t order_count,
                 std::int32_t max_rows, std::int32_t max_nodes);

  // force: [row_count] N, of each row on the body. most_steps: 1 .. ; where targets and rows are those of the last step and that was
  // solved, nothing is computed.
  // Cost of a step: an evaluation (element_lanes.h) and a solve (block_factor.h); a new row takes a solve of its own.
  LargeOutcome step(const LargeContacts& contacts, std::int32_t most_steps, double* force);

  void forget();  // back to rest
  // Completes a restored state (scene_memory.h) by what follows from it. Cost: a solve for each row.
  void restored();

  // m, displacement of a node.
  void displacement(std::int32_t node, float out[3]) const {
    for (int i = 0; i < 3; ++i) out[i] = u_[3 * static_cast<std::size_t>(place_[node]) + static_cast<std::size_t>(i)];
  }
  double energy() const { return now_.energy; }
  const BlockFactor& factor() const { return factor_; }

  // For measuring.
  double evaluate_once() { return evaluate(u_, f_).energy; }
  void solve_once() { factor_.solve(trial_f_); }

 private:
  using Elements = ElementLanes<EightFloats>;
  Elements::Energy evaluate(const float* u, float* f);
  void keep(SceneMemory& memory);
  void take_rows(const LargeContacts& contacts);
  void find_response(std::int32_t row);
  bool same_row(const LargeContacts& contacts, std::int32_t row, std::int32_t kept) const;
  bool factor_contacts();
  void solve_contacts(double* x) const;
  double on_row(std::int32_t row, const float* field) const;
  void add_row(std::int32_t row, double factor, float* field) const;
  double times_compliance(const double* a, const double* b) const;
  void compliance_times(const double* a, double* out) const;
  void project(float* p, double* local);
  bool move_to_targets(LargeOutcome* outcome);
  void find_multipliers();
  double descend(LargeOutcome* outcome);
  bool search(double slope, LargeOutcome* outcome);
  void keep_pair(double share);
  void drop_pairs() { now_.pair_count = now_.pair_first = now_.pairs_since_scale = 0, now_.scale = 1; }
  int pair(int age) const { return (now_.pair_first + now_.pair_count - 1 - age) % kPairs; }  // 0: the newest

  Elements elements_;
  BlockFactor factor_;
  std::int32_t nodes_ = 0, rows_ = 0;  // nodes of the body; those that can move
  std::size_t length_ = 0;             // of vectors over the dofs of rows_, padded with zeros
  std::int32_t* place_ = nullptr;      // [nodes]
  std::int32_t* held_ = nullptr;       // single held dofs, as indices of vectors
  std::int32_t held_count_ = 0;
  float *u_ = nullptr, *trial_ = nullptr;    // [3 nodes] m
  float *f_ = nullptr, *trial_f_ = nullptr;  // [length] N, dE/du
  float *g_ = nullptr, *p_ = nullptr;        // [length] projected gradient, N; direction, m
  float* moves_[kPairs] = {};                // [length] s of each pair
  float* changes_[kPairs] = {};              // [length] z
  double* local_moves_[kPairs] = {};         // [max_rows] the part of s and of z in the rows' own compliance
  // What a step leaves to the next one, beside vectors and rows.
  struct Kept {
    double curvature[kPairs];  // s . z of each pair
    double scale;              // gamma
    double energy, peak_energy, least_volume, residual;
    std::int32_t pair_first, pair_count, pairs_since_scale, row_count;
    std::int32_t pairs_of_other_contacts, solved, at_rest, unused;
  };
  Kept now_ = {};

  std::int32_t max_rows_ = 0, max_nodes_ = 0;
  LargeRow* row_ = nullptr;            // [max_rows] of the last step, with places in place of nodes
  std::int32_t* row_place_ = nullptr;  // [max_nodes]
  double* row_weight_ = nullptr;       // [max_nodes]
  LargeRow* next_row_ = nullptr;
  std::int32_t* next_place_ = nullptr;
  double* next_weight_ = nullptr;
  std::int32_t *slot_ = nullptr, *next_slot_ = nullptr;  // [max_rows] of each row in responses_
  bool* slot_used_ = nullptr;
  float** responses_ = nullptr;                      // [max_rows] -> [length] columns of Y
  double* contact_ = nullptr;                        // [max_rows][max_rows] Cholesky factor of C
  double *local_ = nullptr, *next_local_ = nullptr;  // [max_rows] N, s of each row
  double *multiplier_ = nullptr, *local_g_ = nullptr, *local_p_ = nullptr, *trial_local_ = nullptr, *work_ = nullptr,
         *work2_ = nullptr;  // [max_rows]
  bool rows_changed_ = false;
};

}  // namespace palpate
