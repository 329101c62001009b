// The hyperelastic body under contacts, solved a little further in every step.
//
// The body's energy E(u) is least under the rows W u = d of the contacts. A step moves the last state onto the new targets by the
// linear response, and then takes a few steps of the limited-memory BFGS method (Nocedal 1980, Math. Comp. 35) in the metric of the
// linear stiffness K, projected onto the contacts. The pairs of the method are kept from step to step: they hold what the state has
// taught about the tangent.
//     Y = K^-1 W^T, C = W Y + L;   multiplier = C^-1 (Y^T dE/du + L s), the force of each row on the body
// L is a compliance between a row and the body (contact_patch.h), and L s the displacement that it takes: W u + L s = d.
//
// A row may also be free, with a force that is given: contacts that have released have none, those that slip have their friction.
// It then adds W^T force to the body, and its target does not count.
//
// The metric may be renewed: renew() factors the tangent K(u) of a state, a slice in each call, and the factor then takes the place of
// K's in the method, Y and C included. What the touch superposes stays the response at rest (write_beyond_linear).
#pragma once

#include <cmath>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/row_matrix.h"
#include "runtime/large/block_factor.h"
#include "runtime/large/element_lanes.h"
#include "runtime/large/tangent.h"

namespace palpate {

// One row of W: the weighted mean displacement of some nodes along a direction.
struct LargeRow {
  std::int32_t first, count;  // of its nodes and weights
  double direction[3];
  double target;         // m
  std::int32_t group;    // first row of those that have the same nodes and weights: three at most, one after the other
  std::int32_t unused;   // in the place of padding, which a saved state would hold
  double compliance[3];  // m/N, of L between this row and rows group, group + 1, group + 2
};
struct LargeContacts {
  const LargeRow* rows = nullptr;
  const std::int32_t* nodes = nullptr;  // of the body
  const double* weights = nullptr;
  std::int32_t row_count = 0;
  const double* start = nullptr;  // [row_count] N, the force of each row in the last step; nullptr: not known
  // [row_count][beside_stride] m/N, L between rows of different groups, symmetric; nullptr: there is none
  const double* beside = nullptr;
  std::size_t beside_stride = 0;
};

// What a step says about itself.
struct LargeOutcome {
  std::int32_t steps = 0, evaluations = 0;
  // Square root of the energy that the state still has to lose, over the energy, as the metric K^-1 estimates it before the last move:
  // g.H g / gamma, g the gradient. At most kLost but where the step was given up.
  double residual = 0;
  double least_volume = 1;  // smallest J of a tetrahedron
  bool cut = false;         // the move to the targets was shortened: the rows miss them
  bool lost = false;        // the state is far from its solution: its residual was above kLost
  bool given_up = false;    // the step was undone: the state is that of the last step, and so are the forces
  bool unfinished = false;  // the steps allowed ended far from the tolerance
  bool failed = false;      // numbers were not finite: the body is at rest and the forces are zero
};

class LargeSolver {
 public:
  enum class Created { made, no_memory, not_definite, no_equilibrium };
  static constexpr int kPairs = 8;
  // Fewer steps than kFewestSteps do not bring a body back that a contact has disturbed: the next step disturbs it again.
  static constexpr int kMostSteps = 8, kFewestSteps = 3;
  // A state is solved where its residual (LargeOutcome) is below this; where targets stand still, below kStillTolerance.
  static constexpr double kTolerance = 0.01, kStillTolerance = 0.001;
  // A step that has given the body energy and ends with a larger residual than this is undone. So the energy grows along states near
  // equilibrium alone, whatever contacts do. The next step goes on by a part of its way.
  static constexpr double kLost = 0.5;
  // Without contacts the body is put to rest after so many steps, if it has not come there.
  static constexpr std::int32_t kStepsToRest = 250;
  // A step leaves its state unfinished where the residual (LargeOutcome) before the last move exceeds this.
  static constexpr double kUnfinished = 2 * kTolerance;
  // No step may bring a tetrahedron to this share of its volume.
  static constexpr double kLeastVolume = 0.02;

  // order: [free nodes] the nodes that are not held in all three dofs, as they are eliminated. max_rows, max_nodes: of contacts.
  // Memory: about 424 bytes a tetrahedron, the factor, 250 bytes and 12 max_rows bytes a node, 32 max_rows^2 bytes.
  // preload: [node_count][3] m, the linear displacement under dead loads, or nullptr. The body then rests where it is in equilibrium
  // with K preload, and all displacements start there. no_equilibrium: it is not found, because the loads are too large.
  // fewest_for_rough: numbers of a factor from which its rough copy gives the directions (block_factor.h).
  // renews: makes renew() possible, in four times the factor's memory and 500 bytes a tetrahedron more.
  Created create(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* order, std::int32_t order_count,
                 std::int32_t max_rows, std::int32_t max_nodes, const double* preload = nullptr, bool renews = false,
                 std::int64_t fewest_for_rough = BlockFactor::kFewestForRough);
  // m, displacement of a node by the preload; zero without one.
  void rest_displacement(std::int32_t node, float out[3]) const {
    for (int i = 0; i < 3; ++i)
      out[i] = base_ ? base_[3 * static_cast<std::size_t>(place_[node]) + static_cast<std::size_t>(i)] : 0.0f;
  }

  // force: [row_count] N, of each row on the body, all of which hold. most_steps: 1 .. ; where targets and rows are those of the
  // last step and that was solved, nothing is computed.
  // Cost of a step: an evaluation (element_lanes.h) and a solve (block_factor.h); new nodes or weights take three solves.
  LargeOutcome step(const LargeContacts& contacts, std::int32_t most_steps, double* force);

  // The parts of a step, for contacts that do not always hold: take(), then hold() and improve(), once or more often; then forces().
  // False where a number is not finite.
  bool take(const LargeContacts& contacts);
  // free: [row_count] m, where each row would be without the forces of all rows, in the linear response to the last state.
  // With forces r the rows are at free + C r, the part of L included.
  void find_free(double* free) const;
  const RowMatrix& compliance() const { return compliance_; }  // [row_count][row_count] m/N, C
  // holds: [row_count] whether the row is held, at place[row] (m); nullptr: all are, at their targets. Else it has no force, and
  // before it had start[row]. False as take().
  bool hold(const std::uint8_t* holds, const double* place, const double* start, LargeOutcome* outcome);
  // Takes steps until the body is in equilibrium, at most most_steps.
  void improve(std::int32_t most_steps, LargeOutcome* outcome);
  const double* carried() const { return multiplier_; }  // [row_count] N, the force of each row after improve()
  // [row_count] N. Completes the outcome. Numbers that are not finite put the body to rest, without forces.
  void forces(bool sound, double* force, LargeOutcome* outcome);
  double on_row(std::int32_t row) const { return on_row(row, u_); }  // m, W u

  // What forces of the rows first .. end - 1 do in the linear response. force: [row_count] N. At a node, m; an upper bound of its
  // length over all nodes, m; on all rows, m, without L.
  void response_at(const double* force, std::int32_t first, std::int32_t end, std::int32_t node, double out[3]) const;
  double response_bound(const double* force, std::int32_t first, std::int32_t end) const;
  void response_on_rows(const double* force, double* out) const;
  // The bound for one force ([3] N) on all nodes of a row.
  double spot_response_bound(std::int32_t row, const double* force) const {
    const double* const largest = largest_response_ + 3 * static_cast<std::size_t>(spot_of(row).slot);
    return std::abs(force[0]) * largest[0] + std::abs(force[1]) * largest[1] + std::abs(force[2]) * largest[2];
  }
  const double* direction(std::int32_t row) const { return row_[row].direction; }
  // x <- C^-1 x, of the rows that hold; zero for the others.
  void solve_held(double* x) const { solve_contacts(x); }
  bool holds(std::int32_t row) const { return holds_[row] != 0; }
  // Changes where the row's nodes or weights do.
  std::int64_t response_id(std::int32_t row) const {
    const std::int32_t slot = spot_of(row).slot;
    return (static_cast<std::int64_t>(slot) << 32) + generation_[slot];
  }

  // Solves since the last call that new nodes or weights took, three for each.
  std::int32_t take_response_solves() {
    const std::int32_t solves = response_solves_;
    return response_solves_ = 0, solves;
  }

  // Goes on with a new metric, between steps: the first of kSlices calls begins with the state as it is, the last one replaces the metric
  // and drops the pairs. Where the tangent is not definite, the metric stays, and the next call begins anew. A call counts, not the time,
  // so that the same steps and calls have the same bits. At rest it does nothing. Cost: a slice of the factorisation; the last one
  // a pass over the factor and three solves for each row's nodes.
  static constexpr std::int32_t kSlices = 16;
  void renew();
  // Of the metric now: 0 K at rest, else the K(u) of how many renewals since rest.
  std::int32_t renewals() const { return renewal_.count; }

  void forget();  // back to rest
  // Completes a restored state (scene_memory.h) by what follows from it. Cost: three solves for each row's nodes; with a renewed metric,
  // up to two factorisations.
  void restored();

  // m, displacement of a node.
  void displacement(std::int32_t node, float out[3]) const {
    for (int i = 0; i < 3; ++i) out[i] = u_[3 * static_cast<std::size_t>(place_[node]) + static_cast<std::size_t>(i)];
  }
  // out: [count][3] m, the displacements of nodes 0 .. count - 1 less the linear response to the forces of the rows, u - Y force.
  // force: [row_count] N. Cost: three numbers a node for each row.
  void write_beyond_linear(const double* force, std::int32_t count, float* out);
  double energy() const { return now_.energy; }
  // J, of an energy, by rounding and by what a step leaves of it.
  double energy_noise(double energy) const { return noise_ + kTolerance * kTolerance * std::abs(energy); }
  const BlockFactor& factor() const { return factor_; }

  // For measuring.
  double evaluate_once() { return evaluate(u_, f_).energy; }
  void solve_once(bool roughly) {
    if (roughly)
      metric().solve_roughly(trial_f_);
    else
      metric().solve(trial_f_);
  }

 private:
  using Elements = ElementLanes<EightFloats>;
  // The nodes and weights that the rows of a group share, and where their responses are.
  struct Spot {
    std::int32_t first, count;  // of its nodes and weights
    std::int32_t row, rows;     // its rows
    std::int32_t slot;          // of its three columns of Y
  };
  // A renewal, from call to call.
  struct Renewal {
    std::int32_t count = 0;   // as renewals()
    std::int32_t slices = 0;  // done of the next metric
    std::int32_t active = 0;  // the metric is a renewed one
    std::int32_t pairs = 0;   // kept since it began
  };
  bool prepare_renewals(SceneMemory& memory, const HyperelasticBody& body, double of_held);
  bool make_slice(std::int32_t slice);
  void take_metric();
  void take_rest_metric();
  void copy_state(float* to) const;
  void find_all_responses();
  const BlockFactor& metric() const { return renewal_.active ? renewed_ : factor_; }
  Elements::Energy evaluate(const float* u, float* f);
  bool take_load(SceneMemory& memory, const HyperelasticBody& body, const BlockRows& stiffness, const double* preload);
  bool take_supports(SceneMemory& memory, const HyperelasticBody& body);
  double add_supports(const float* u, float* f) const;
  bool settle(double load_share);
  bool find_rest();
  void keep(SceneMemory& memory);
  void take_spots(const LargeContacts& contacts);
  bool same_spot(const LargeContacts& contacts, std::int32_t row, const Spot& before) const;
  void take_rows(const LargeContacts& contacts);
  void take_beside(const LargeContacts& contacts);
  void find_responses(const Spot& spot);
  void forget_local_moves();
  void measure_spots();
  bool fill_compliance();
  bool factor_contacts();
  void solve_contacts(double* x) const;
  void on_spot(const Spot& spot, const float* field, double sum[3]) const;
  double on_row(std::int32_t row, const float* field) const;
  void add_rows(const double* force, float* field) const;
  void add_responses(const double* force, double factor, float* field) const;
  void add_rest_responses(const double* force, double factor, float* field) const;
  template <class Column>
  void add_columns_of(const double* force, double factor, float* field, Column column) const;
  void responses_times(const float* force, double* out) const;
  double times_compliance(const double* a, const double* b) const;
  double beside(std::int32_t i, std::int32_t j) const {
    return beside_[static_cast<std::size_t>(i) * stride_ + static_cast<std::size_t>(j)];
  }
  void compliance_times(const double* a, double* out) const;
  void project(float* p, double* local);
  void find_multipliers();
  double descend();
  bool search(double slope, LargeOutcome* outcome);
  void begin_step();
  void give_up();
  void keep_pair(double share);
  void drop_pairs() { now_.pair_count = now_.pair_first = now_.pairs_since_scale = 0, now_.scale = 1; }
  void come_to_rest();
  bool nothing_acts() const;
  int pair(int age) const { return (now_.pair_first + now_.pair_count - 1 - age) % kPairs; }  // 0: the newest
  float* response(const Spot& spot, int axis) const {
    return responses_ + static_cast<std::size_t>(3 * spot.slot + axis) * length_;
  }
  float* rest_response(const Spot& spot, int axis) const {
    return rest_responses_ ? rest_responses_ + static_cast<std::size_t>(3 * spot.slot + axis) * length_
                           : response(spot, axis);
  }
  const Spot& spot_of(std::int32_t row) const { return spots_[row_spot_[row]]; }

  Elements elements_;
  BlockFactor factor_;
  // Where the metric is renewed:
  BlockFactor renewed_;
  BlockFactor::Work work_on_metric_;
  Tangent tangent_;
  Renewal renewal_;
  std::int32_t next_supernode_ = 0;
  float *of_metric_ = nullptr, *of_next_ = nullptr;  // [3 nodes] m, the states of the metric and of the next one
  float* rest_responses_ = nullptr;                  // as responses_, of K at rest
  std::int32_t nodes_ = 0, rows_ = 0;                // nodes of the body; those that can move
  std::size_t length_ = 0;                           // of vectors over the dofs of rows_, padded with zeros
  std::int32_t* place_ = nullptr;                    // [nodes]
  std::int32_t* held_ = nullptr;                     // single held dofs, as indices of vectors
  std::int32_t held_count_ = 0;
  std::int32_t* support_place_ = nullptr;  // [support_count][2]
  double* support_stiffness_ = nullptr;    // [support_count][9] N/m
  std::int32_t support_count_ = 0;
  float *u_ = nullptr, *trial_ = nullptr;    // [3 nodes] m
  float *f_ = nullptr, *trial_f_ = nullptr;  // [length] N, dE/du
  // Under a preload: where the body rests and the place of a state, [3 nodes] m; the load there, [length] N.
  float *base_ = nullptr, *absolute_ = nullptr, *load_ = nullptr;
  double base_energy_ = 0;  // J
  double noise_ = 0;        // J, of an energy, by the rounding of the preload's
  double load_share_ = 1, tolerance_ = kTolerance;
  float *g_ = nullptr, *p_ = nullptr;  // [length] projected gradient, N; direction, m
  float* moves_[kPairs] = {};          // [length] s of each pair
  float* changes_[kPairs] = {};        // [length] z
  double* local_moves_[kPairs] = {};   // [max_rows] the part of s and of z in the rows' own compliance
  // What a step leaves to the next one, beside vectors and rows.
  struct Kept {
    double curvature[kPairs];  // s . z of each pair
    double scale;              // gamma
    double energy, peak_energy, least_volume, residual;
    std::int32_t pair_first, pair_count, pairs_since_scale, row_count, spot_count, pairs_of_other_contacts;
    double reach;  // the part of the way to the targets that a step tries
    std::int32_t at_rest;
    std::int32_t solved;        // 1: to kTolerance; 2: to kStillTolerance
    std::int32_t alone, still;  // steps without contacts; steps of the method at targets that stand still
    std::int32_t has_beside, unused;
  };
  Kept now_ = {};
  // Where this step began, to which give_up() returns.
  Kept before_ = {};
  float *u_before_ = nullptr, *f_before_ = nullptr;  // as u_ and f_
  double* local_before_ = nullptr;                   // [max_rows]
  bool still_ = false;                               // the targets are those of the last step
  bool shortened_ = false;                           // the move to the targets, beyond now_.reach
  bool stuck_ = false;                               // no direction led on

  std::int32_t max_rows_ = 0, max_nodes_ = 0, max_spots_ = 0;
  std::size_t stride_ = 0;                         // numbers from one row of the matrices to the next
  LargeRow *row_ = nullptr, *next_row_ = nullptr;  // [max_rows] of the last step, with places in place of nodes
  Spot *spots_ = nullptr, *next_spots_ = nullptr;  // [max_spots]
  std::int32_t *row_place_ = nullptr, *next_place_ = nullptr;  // [max_nodes]
  double *row_weight_ = nullptr, *next_weight_ = nullptr;      // [max_nodes]
  std::int32_t* row_spot_ = nullptr;                           // [max_rows]
  bool* slot_used_ = nullptr;                                  // [max_spots]
  float* responses_ = nullptr;                                 // [max_spots][3][length] columns of Y, along x, y and z
  std::int32_t* generation_ = nullptr;                         // [max_spots] counts what was in the slot
  double* largest_response_ = nullptr;                         // [max_spots][3] m/N, the longest displacement of a node
  double* between_spots_ = nullptr;                            // [max_rows][stride] W Y along x, y and z of the spots
  RowMatrix compliance_;                                       // [max_rows][max_rows] C
  double* beside_ = nullptr;                                   // [max_rows][stride] L between rows of different groups
  double* contact_ = nullptr;                        // [max_rows][stride] Cholesky factor of C, of the rows that hold
  std::uint8_t* holds_ = nullptr;                    // [max_rows]
  double* applied_ = nullptr;                        // [max_rows] N, of rows that do not hold
  double *local_ = nullptr, *next_local_ = nullptr;  // [max_rows] N, s of each row
  double *multiplier_ = nullptr, *local_g_ = nullptr, *local_p_ = nullptr, *trial_local_ = nullptr, *work_ = nullptr,
         *work2_ = nullptr;  // [max_rows]
  bool spots_changed_ = false, rows_changed_ = false;
  std::int32_t response_solves_ = 0;
};

}  // namespace palpate
