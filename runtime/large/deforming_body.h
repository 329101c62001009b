// Contacts under large deformation: constraints -> rows of large_solver.h -> forces at the contact nodes, and the displaced nodes.
//
// Contacts that may release or slip: the laws are solved on the linear response to the last state, free + C r, by the solver of the
// linear contacts (system_solver.h). That tells which rows hold and which friction acts on the others. The body takes its steps with
// these, and where the laws are then missed, both are done again. The laws act along the present normal of the surface: the frame
// of a constraint turns with it from step to step.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/step_work.h"
#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/system_solver.h"
#include "runtime/large/large_solver.h"
#include "runtime/large/turned_surface.h"

namespace palpate {

class DeformingBody {
 public:
  struct Limits {
    std::int32_t nodes = 0, constraints = 0;  // most of each in a step
    bool gives_way = false;                   // some constraints have laws under which they release or slip, or limits
    bool renews_metric = false;               // renew() does something
    Operations of_laws = kUnlimitedOperations;  // of a step, for its laws
    NewNodes new_nodes;                         // as LargeSolver::create
    Operations of_cut = 0;                      // that a cut adds to a solve, at most, beside a second one
  };
  // The laws count as met where they are missed by this share of the largest target; beyond kInexact the step says so.
  static constexpr double kLawMet = 0.01, kInexact = 0.05;
  // Times that a step solves the laws.
  static constexpr int kMostRounds = 4;

  // As LargeSolver::create.
  LargeSolver::Created create(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* order,
                              std::int32_t order_count, const Limits& limits, const double* preload);
  // For constraints with frames; after create(). As TurnedSurface::create. False where memory ends.
  bool follow_normals(SceneMemory& memory, const TurnedSurface::Source& surface) {
    return turned_.create(memory, surface);
  }

  // The mesh is cut: as LargeSolver.
  MeshFollower::Layout follow_mesh(AddedCompliance* added) { return solver_.follow_mesh(added); }
  void split(const MeshFollower::Split& split, bool replayed) { solver_.split(split, replayed); }
  void remove(std::int32_t tetrahedron) { solver_.remove(tetrahedron); }
  void take_loads(const MeshFollower::DividedLoad* loads, std::int32_t count) { solver_.take_loads(loads, count); }
  void take_supports(const MeshFollower::Support* supports, std::int32_t count) {
    solver_.take_supports(supports, count);
  }
  void changed(bool replayed) { solver_.changed(replayed); }
  void forget_changes() { solver_.forget_changes(); }

  // As LargeSolver. Targets, reactions, fields are those from the offset.
  bool take_offset(SceneMemory& memory, const HyperelasticBody& body, const OffsetRows& rows) {
    return solver_.take_offset(memory, body, rows);
  }
  void move_by(const double* amounts, const RowVolume* volumes) { solver_.move_by(amounts, volumes); }
  void tell_volumes(RowVolume* volumes) const { solver_.tell_volumes(volumes); }
  double take_given() { return solver_.take_given(); }

  struct Outcome : LargeOutcome {
    double missed = 0;     // m, by how much the worst contact misses its law; 0 where none gives way
    bool inexact = false;  // by more than kInexact of the largest target
  };
  // force: [node_count] N, of each contact node on the body. Takes the steps of the method that it needs, as many as `work` leaves or
  // LargeSolver::kFewestSteps, and counts them.
  // Whatever the outcome, no contact pulls that may not, and no friction exceeds what its law allows.
  Outcome solve(const ContactConstraints& set, StepWork* work, Vec3* force);

  // Where several bodies are solved as one, in place of solve(): begin() and aim(); then whoever solves sets the reactions of laws(), follow()
  // takes the body where they bring it, and aim() begins anew where it has gone on; at last end(), whose forces are the last reactions.
  // begin(), follow(): false as LargeSolver::take(). *went: the laws are to be solved again.
  bool begin(const ContactConstraints& set, StepWork* work);
  void aim(const ContactConstraints& set);
  bool follow(const ContactConstraints& set, bool* went);
  Outcome end(const ContactConstraints& set, bool sound, StepWork* work, Vec3* force);
  SystemSolver& laws() { return laws_; }
  const RowsOfConstraint* rows_of_constraints() const { return rows_of_; }
  // m, along its rows: where the reactions of laws() bring constraint p in the linear response.
  Vec3 reached(std::int32_t p) const;

  // Of constraint p of the last solve(), in the frame that has turned with the surface: the force on the body (N), and by how much
  // its rows miss their targets (m).
  Vec3 reaction(std::int32_t p) const { return reaction_[p]; }
  Vec3 missed(std::int32_t p) const;
  const Mat3& frame(std::int32_t p) const { return frames_[p]; }  // the turned one
  // Rad, by which the frame of the worst contact that may slide is off the surface's normal after the last solve(), of `set`.
  double off(const ContactConstraints& set) const;
  // N/m, in the organ's axes, of the linear response to the constraint alone, along the rows that hold.
  Mat3 own_stiffness(std::int32_t p) const;
  // m/N, in the organ's axes, of the linear response at the constraint to a force on it alone.
  Mat3 own_compliance(std::int32_t p) const;
  // m/N, in x, y and z, of the linear response: of the nodes of constraint p by a force on those of q. No other row holds.
  Mat3 compliance_between(std::int32_t p, std::int32_t q) const;
  // SystemSolver::measure_stiffness(), in the linear response. Cost: rows^2 for each number of a row.
  void measure_stiffness(const SystemSolver::MovedAlike* groups, int count, double* stiffness);
  const LawEffort& effort() const { return effort_; }
  const LargeSolver& solver() const { return solver_; }
  double energy() const { return solver_.energy(); }  // J
  // [rows] N, of each row of the last solve(): constraint after constraint, axis after axis.
  const double* row_forces() const { return force_; }
  // Of the last solve(), for measuring: its rows, their nodes and weights; the place, m, at which a row is held that holds.
  LargeContacts last_rows() const {
    return {rows_.list,
            rows_.nodes,
            rows_.weights,
            rows_.count,
            nullptr,
            rows_.has_beside ? rows_.beside : nullptr,
            3 * static_cast<std::size_t>(constraint_capacity_),
            rows_.joins,
            rows_.join_count};
  }
  double place(std::int32_t row) const { return laws_decided_ ? place_[row] : rows_.list[row].target; }

  // Displacements of nodes 0 .. count - 1, [count][3] m.
  void write_field(std::int32_t count, float* out) const {
    for (std::int32_t n = 0; n < count; ++n) solver_.displacement(n, out + 3 * static_cast<std::int64_t>(n));
  }
  // The same, less the linear response to the forces of the last solve().
  void write_beyond_linear(std::int32_t count, float* out) { solver_.write_beyond_linear(force_, count, out); }
  // m, of a node: from the offset, and with it.
  Vec3 moved_by_contacts(std::int32_t node) const {
    float u[3];
    solver_.displacement(node, u);
    return {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
  }
  Vec3 displacement(std::int32_t node) const {
    float u[3];
    solver_.displacement(node, u);
    solver_.add_moved(node, u);
    return {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
  }

  // m, of a node, by the preload; displacements start there.
  Vec3 rest_displacement(std::int32_t node) const {
    float u[3];
    solver_.rest_displacement(node, u);
    return {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
  }

  // Between solves: LargeSolver::renew(), where the limits ask for it.
  void renew() { solver_.renew(); }
  void forget();
  void restored() { solver_.restored(); }
  Operations fewest_operations() const { return LargeSolver::kFewestSteps * operations_; }
  Operations operations_to_renew() const { return 3 * solve_operations_; }  // of a contact that comes or moves
  // No step takes more: moves that are halved ten times, as many searches, and the responses of all constraints.
  Operations most_operations() const {
    return (12 * kMostRounds + 10 * LargeSolver::kMostSteps) * operations_ +
           constraint_capacity_ * operations_to_renew() + kOfTwoDiscs * constraint_capacity_ * constraint_capacity_ / 2;
  }
  std::int64_t factor_numbers() const { return solver_.factor().numbers(); }

 private:
  // Of a constraint, from step to step.
  struct Kept {
    ConstraintId id;
    std::int32_t known, unused;  // known: 1 where the last step had it
    double force[3];             // N, along the axes of its frame
    Vec3 turned;                 // the unit normal along which its laws act, less that at rest
  };
  void find_known(const ContactConstraints& set);
  Mat3 present_frame(const ContactConstraints& set, std::int32_t p);
  std::int32_t add_rows(const ContactConstraints& set, std::int32_t p, std::int32_t count);
  void join_row(const ContactConstraints& set, std::int32_t p);
  LargeContacts take_rows(const ContactConstraints& set, StepWork* work);
  void take_targets(const ContactConstraints& set);
  double largest_target(const ContactConstraints& set) const;
  static bool is_met(double missed, double most);
  void take_start(const ContactConstraints& set);
  bool fill_beside(const ContactConstraints& set, StepWork* work);
  void keep(const ContactConstraints& set);
  bool solve_laws(const ContactConstraints& set, StepWork* work, Outcome* outcome);
  void find_left();
  void write_forces(const ContactConstraints& set, const Outcome& outcome, StepWork* work, Vec3* force);
  double begin_laws(const ContactConstraints& set, const double* carried);
  void drop_held_rows(const ContactConstraints& set);
  void decide(const ContactConstraints& set, const double* reaction);
  void obey(const ContactConstraint& constraint, std::int32_t p);
  double reached(std::int32_t r, const double* reaction) const;

  LargeSolver solver_;
  TurnedSurface turned_;
  SystemSolver laws_;  // where contacts give way
  LawEffort effort_;
  struct Rows {
    LargeRow* list = nullptr;       // [3 constraint_capacity]
    std::int32_t* nodes = nullptr;  // [node_capacity]
    double* weights = nullptr;      // [node_capacity]
    double* beside = nullptr;       // [3 constraint_capacity]^2 m/N, between the discs of two constraints
    LargeJoin* joins = nullptr;     // [constraint_capacity]
    std::int32_t count = 0, join_count = 0;
    bool has_beside = false;
  } rows_;
  std::int32_t constraint_capacity_ = 0, kept_count_ = 0;
  RowsOfConstraint* rows_of_ = nullptr;         // [constraint_capacity]
  std::int32_t* lead_ = nullptr;                // [constraint_capacity] the constraint that has its rows
  Mat3* frames_ = nullptr;                      // [constraint_capacity]
  Vec3* reaction_ = nullptr;                    // [constraint_capacity] N
  Kept *kept_ = nullptr, *now_ = nullptr;       // [constraint_capacity] of the last step; of this one
  double *force_ = nullptr, *start_ = nullptr;  // [3 constraint_capacity] N
  // Where contacts give way:
  double* place_ = nullptr;                           // [3 constraint_capacity] m, where each row is held
  double *free_ = nullptr, *ahead_ = nullptr;         // [3 constraint_capacity] m
  std::uint8_t *holds_ = nullptr, *slips_ = nullptr;  // [3 constraint_capacity]
  bool laws_decided_ = false;                         // in the last solve()
  // Of a step, where several bodies are solved as one:
  struct Joint {
    Outcome outcome;
    const double* carried = nullptr;  // [rows] N, of the last state
    std::int32_t rounds = 0;
  } joint_;
  std::int32_t most_steps_ = 0;  // of a step
  Operations operations_ = 0, solve_operations_ = 0, of_laws_ = 0;
};

}  // namespace palpate
