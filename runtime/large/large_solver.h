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
#include <utility>

#include "runtime/base/scene_memory.h"
#include "runtime/large/body_metric.h"
#include "runtime/large/hyperelastic_energy.h"
#include "runtime/large/large_rows.h"
#include "runtime/large/secant_pairs.h"
#include "runtime/large/soft_mode.h"

namespace palpate {

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
  bool unheld = false;      // the balance is not stable, or nearly neutral (soft_mode.h)
  bool failed = false;      // numbers were not finite: the body is at rest and the forces are zero
  bool lags() const { return cut || given_up || unfinished; }
};

class LargeSolver {
 public:
  enum class Created { made, no_memory, not_definite, no_equilibrium };
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
  // A volume counts as held where it is off by this share of what its triangles have swept; beyond kVolumeFar the step is unfinished.
  static constexpr double kVolumeMet = 1e-4, kVolumeFar = 0.01;

  // order: [free nodes] the nodes that are not held in all three dofs, as they are eliminated. max_rows, max_nodes: of contacts.
  // Memory: about 424 bytes a tetrahedron, the factor, 430 bytes and 12 max_rows bytes a node, 32 max_rows^2 bytes.
  // preload: [node_count][3] m, the linear displacement under dead loads, or nullptr. The body then rests where it is in equilibrium
  // with K preload, and all displacements start there. no_equilibrium: it is not found, because the loads are too large.
  // fewest_for_rough: numbers of a factor from which its rough copy gives the directions (block_factor.h).
  // renews: makes renew() possible, in four times the factor's memory and 500 bytes a tetrahedron more.
  // new_nodes: of a mesh that may be cut. With its first change the metric goes back to that at rest and is not renewed any more.
  Created create(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* order, std::int32_t order_count,
                 std::int32_t max_rows, std::int32_t max_nodes, const double* preload = nullptr, bool renews = false,
                 std::int64_t fewest_for_rough = BlockFactor::kFewestForRough, const NewNodes& new_nodes = {});
  // m, displacement of a node by the preload; zero without one.
  void rest_displacement(std::int32_t node, float out[3]) const {
    for (int i = 0; i < 3; ++i) out[i] = energy_.base() ? energy_.base()[at(node) + static_cast<std::size_t>(i)] : 0.0f;
  }

  // The mesh is cut, between steps: as MeshFollower says. Cost of changed(): an evaluation, and six solves for each row's nodes.
  MeshFollower::Layout follow_mesh(AddedCompliance* added);
  void split(const MeshFollower::Split& split, bool replayed);
  void remove(std::int32_t tetrahedron) { energy_.remove(tetrahedron); }
  void take_loads(const MeshFollower::DividedLoad* loads, std::int32_t count) { energy_.take_loads(loads, count); }
  void take_supports(const MeshFollower::Support* supports, std::int32_t count) {
    energy_.take_supports(supports, count);
  }
  void changed(bool replayed);
  void forget_changes() { energy_.forget_changes(); }

  // What moves the body from outside, as HyperelasticEnergy has it: displacements and targets of rows are relative to it.
  bool take_offset(SceneMemory& memory, const HyperelasticBody& body, const OffsetRows& rows);
  // Before a step: its amounts, and of pressures which volumes are held, by rows. The body goes as far on the way to them as leaves no tetrahedron
  // nearly flat. Cost: an evaluation, where the amounts are other ones than in the last step. A volume that is held takes a solve when that begins and
  // when its surface has turned or grown, and three solves for each row's nodes.
  void move_by(const double* amounts, const RowVolume* volumes);
  // Pressures and volumes of the state.
  void tell_volumes(RowVolume* volumes) const;
  // m, of a node by the offset, added.
  void add_moved(std::int32_t node, float out[3]) const {
    for (std::size_t i = 0; i < 3 && energy_.moved(); ++i) out[i] += energy_.moved()[at(node) + i];
  }
  // J, that moving has given the body since the last call, its displacement from the offset kept.
  double take_given() { return std::exchange(moved_.given, 0); }

  // force: [row_count] N, of each row on the body, all of which hold. most_steps: 1 .. ; where targets and rows are those of the
  // last step and that was solved, nothing is computed.
  // Cost of a step: an evaluation (element_lanes.h) and a solve (block_factor.h); new nodes or weights take three solves, and a place in a triangle or a
  // tetrahedron three for each corner that is not known (node_columns.h).
  LargeOutcome step(const LargeContacts& contacts, std::int32_t most_steps, double* force);

  // The parts of a step, for contacts that do not always hold: take(), then hold() and improve(), once or more often; then forces().
  // False where a number is not finite.
  bool take(const LargeContacts& contacts);
  // free: [row_count] m, where each row would be without the forces of all rows, in the linear response to the last state.
  // With forces r the rows are at free + C r, the part of L included.
  void find_free(double* free) const;
  const RowMatrix& compliance() const { return rows_.compliance(); }  // [row_count][row_count] m/N, C
  // holds: [row_count] whether the row is held, at place[row] (m); nullptr: all are, at their targets. Else it has no force, and
  // before it had start[row]. False as take().
  bool hold(const std::uint8_t* holds, const double* place, const double* start, LargeOutcome* outcome);
  // Takes steps until the body is in equilibrium, at most most_steps.
  void improve(std::int32_t most_steps, LargeOutcome* outcome);
  const double* carried() const { return of_rows_.multiplier; }  // [row_count] N, the force of each row after improve()
  // [row_count] N. Completes the outcome. Numbers that are not finite put the body to rest, without forces.
  void forces(bool sound, double* force, LargeOutcome* outcome);
  double on_row(std::int32_t row) const { return rows_.on_row(row, u_); }  // m, W u

  // What forces of the rows first .. end - 1 do in the linear response. force: [row_count] N. At a node, m; an upper bound of its
  // length over all nodes, m; on all rows, m, without L.
  void response_at(const double* force, std::int32_t first, std::int32_t end, std::int32_t node, double out[3]) const {
    rows_.response_at(force, first, end, node, out);
  }
  double response_bound(const double* force, std::int32_t first, std::int32_t end) const {
    return rows_.response_bound(force, first, end);
  }
  void response_on_rows(const double* force, double* out) const { rows_.response_on_rows(force, out); }
  // The bound for one force ([3] N) on all nodes of a row.
  double spot_response_bound(std::int32_t row, const double* force) const {
    return rows_.spot_response_bound(row, force);
  }
  void response_between(std::int32_t row, std::int32_t part, std::int32_t other, std::int32_t other_part,
                        double* out) const {
    rows_.between(row, part, other, other_part, out);
  }
  const double* direction(std::int32_t row) const { return rows_.row(row).direction; }
  // x <- C^-1 x, of the rows that hold; zero for the others.
  void solve_held(double* x) const { rows_.solve(x); }
  bool holds(std::int32_t row) const { return rows_.holds(row); }
  // Changes where the row's nodes or weights do.
  std::int64_t response_id(std::int32_t row) const { return rows_.response_id(row); }

  // Solves since the last call that new nodes or weights took.
  std::int32_t take_response_solves() { return rows_.take_solves(); }

  // Goes on with a new metric, between steps: the first of kSlices calls begins with the state as it is, the last one replaces the metric
  // and drops the pairs. Where the tangent is not definite, the metric stays, and the next call begins anew. A call counts, not the time,
  // so that the same steps and calls have the same bits. At rest it does nothing. Cost: a slice of the factorisation; the last one
  // a pass over the factor and three solves for each row's nodes.
  static constexpr std::int32_t kSlices = BodyMetric::kSlices;
  void renew();
  // Of the metric now: 0 K at rest, else the K(u) of how many renewals since rest.
  std::int32_t renewals() const { return metric_.renewals(); }

  void forget();  // back to rest
  // Completes a restored state (scene_memory.h) by what follows from it. Cost: three solves for each row's nodes; with a renewed metric,
  // up to two factorisations.
  void restored();

  // m, displacement of a node.
  void displacement(std::int32_t node, float out[3]) const {
    for (int i = 0; i < 3; ++i) out[i] = u_[at(node) + static_cast<std::size_t>(i)];
  }
  // out: [count][3] m, the displacements of nodes 0 .. count - 1 less the linear response to the forces of the rows, u - Y force.
  // force: [row_count] N. Cost: three numbers a node for each row.
  void write_beyond_linear(const double* force, std::int32_t count, float* out);
  double energy() const { return now_.energy; }
  // J, of an energy, by rounding and by what a step leaves of it.
  double energy_noise(double energy) const { return energy_.noise() + kTolerance * kTolerance * std::abs(energy); }
  const BlockFactor& factor() const { return metric_.rest(); }

  // As SoftMode::quotient().
  double softest() const { return soft_.quotient(); }

  // For measuring.
  double evaluate_once() { return energy_.evaluate(u_, f_).energy; }
  void solve_once(bool roughly) {
    if (roughly)
      metric_.now().solve_roughly(trial_f_);
    else
      metric_.now().solve(trial_f_);
  }

 private:
  std::size_t at(std::int32_t node) const { return 3 * static_cast<std::size_t>(energy_.place(node)); }
  bool create_vectors(SceneMemory& memory);
  bool settle(double load_share);
  bool find_rest();
  void keep(SceneMemory& memory);
  bool set_held(const std::uint8_t* holds, const double* start);
  double find_move(const double* place);
  bool move(LargeOutcome* outcome);
  BodyMove direction() { return {p_, image_, trial_f_, of_rows_.p}; }
  bool has_volumes(const RowVolume* volumes) const;
  bool begin_volumes(const RowVolume* volumes);
  bool has_turned(std::int32_t i, std::int32_t k);
  void take_volumes(bool anew);
  void correct_volumes();
  double worst_volume() const;
  void find_multipliers();
  double descend();
  void measure_scale(int pair);
  bool search(double slope, LargeOutcome* outcome);
  void begin_step();
  void give_up();
  void leave_metric();
  void come_to_rest();
  bool is_moved_from_outside() const;
  bool nothing_acts() const;
  double little_energy() const;
  bool rest_is_balance() const;

  // Of the last move_by(): evaluations that no step has told yet; the body was moved; it is not where the amounts have it.
  struct Moved {
    double given = 0;
    std::int32_t evaluations = 0;
    bool now = false, cut = false;
  };
  HyperelasticEnergy energy_;
  BodyMetric metric_;
  LargeRows rows_;
  SecantPairs pairs_;
  SoftMode soft_;
  float *u_ = nullptr, *trial_ = nullptr;    // [3 nodes] m
  float *f_ = nullptr, *trial_f_ = nullptr;  // [length] N, dE/du
  float *g_ = nullptr, *p_ = nullptr;        // [length] projected gradient, N; direction, m
  float* image_ = nullptr;                   // [length] N, the metric times p
  // [most rows] N: s of each row, in a trial and before this step; the multipliers; the parts of g and p; sums.
  struct RowVectors {
    double *local, *other_local, *trial_local, *local_before, *multiplier, *g, *p, *work, *work2;
  } of_rows_ = {};
  // What a step leaves to the next one, beside vectors, rows and pairs.
  struct Kept {
    double energy, peak_energy, least_volume, residual;
    double reach;  // the part of the way to the targets that a step tries
    std::int32_t pairs_of_other_contacts;
    std::int32_t at_rest;
    std::int32_t solved;        // 1: to kTolerance; 2: to kStillTolerance
    std::int32_t alone, still;  // steps without contacts; steps of the method at targets that stand still
    std::int32_t unused;
  };
  Kept now_ = {};
  // Where this step began, to which give_up() returns.
  Kept before_ = {};
  float *u_before_ = nullptr, *f_before_ = nullptr;  // as u_ and f_
  Moved moved_;
  double tolerance_ = kTolerance;
  bool rows_changed_ = false;
  bool still_ = false;      // the targets are those of the last step
  bool shortened_ = false;  // the move to the targets, beyond now_.reach
  bool stuck_ = false;      // no direction led on
};

}  // namespace palpate
