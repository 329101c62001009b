// Contact forces from imposed displacements, by a factor whose rows come and go with the contacts:
//     (H W H^T) r = d,   f = H^T r,   u~_j = (T^f_j)^-1 f_j.
// W_ab = C_ab is the compliance between contact nodes, H the rows of the constraints, d their targets u*, r their reactions. Discs add
// what the mesh does not resolve, ContactConstraint::local for each and disc_compliance.h between two: where H W H^T is written, that is
// a part of it.
// Source: Cotin, Delingette and Ayache 1999, eqs 7 to 10. The paper solves M u~ = u*, which is not symmetric; with forces as
// unknowns the same system is symmetric positive definite (docs/method.md).
#pragma once

#include <cmath>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/step_work.h"
#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/law_solver.h"
#include "runtime/contact/node_compliance.h"
#include "runtime/dense/updated_cholesky.h"

namespace palpate {

// Norms of reactions in the energy of the field that they make, sqrt(r^T (H W H^T) r), in sqrt(J). What the mesh does not resolve of
// discs (ContactConstraint::local, disc_compliance.h) moves no node and does not count.
struct ReactionNorms {
  double whole = 0;           // of all reactions
  double change_of_kept = 0;  // of the change since the last solve, of the constraints that kept their rows
  Operations operations = 0;
};
// The same of one constraint.
struct ConstraintNorms {
  double own = 0, own_change = 0;  // of its reactions alone; of their change, 0 where its rows are new
  double work = 0;                 // J: its reactions times the displacement by all reactions
  Vec3 displacement;               // m, of its nodes along the rows of its frame, by all reactions; imposed axes only
  bool kept = false;               // its rows were there in the last solve
};

class ContactSolver {
 public:
  enum class Outcome { solved, regularised, unsolved };

  // Near-dependent rows (a node held twice, two surface points of one triangle a micron apart, more than three in one triangle)
  // make A = D H W H^T D singular; D scales its diagonal to one. The factor is that of A + kShift I, and the solution is refined
  // up to kMostSolves - 1 times (iterated Tikhonov regularisation). Along an eigenvector of A with eigenvalue e the solution is
  // then (1 - (kShift / (e + kShift))^kMostSolves) / e times that part of D d. The factor falls with e and never exceeds
  // kMostSolves / kShift, so
  //     |D^-1 r| <= kMostSolves / kShift |D d|.
  // Separate contacts are met to (kShift / e)^2 or better, which is below single precision.
  static constexpr double kShift = 1e-6;
  static constexpr int kMostSolves = 4;

  // Two surface points of one triangle that move apart by d are met only if the triangle's vertices move by d over their distance in
  // edges, however much that is. So the reaction r_i of each row has a limit, in multiples of the force that the row alone would need
  // for the largest target d of the step:
  //     |r_i| <= most d / A_ii,      A = H W H^T here.
  // most is kMostForceNear where no contact node moves farther than the largest target, as with many nodes held at targets of their own.
  // It falls with the reciprocal of how many times farther one moves, down to kMostForce.
  // Where the solution above exceeds the limit, a second one is computed in the same way, with kSoftShift and kSoftSolves: contacts that
  // agree are met to (kSoftShift / (e + kSoftShift))^kSoftSolves, those that conflict meet at a mean. The answer is the point on the
  // line between the two that is nearest to the first one and within the limit. It changes continuously with the targets, and along
  // each eigenvector of D A D it is at most the exact solution. So r^T A r <= r^T d, and by |u_v|^2 <= |C_vv| r^T A r (surface_tree.h)
  // no node v of the organ moves farther than sqrt(most |C_vv| sum_i 1 / A_ii) d.
  // Under laws the limit is kMostForce for contacts that may release or slip, and a part of their laws. Of the others beside these, as
  // grips are, both solutions are solutions of the laws: in the second one only their rows are soft. Two grips that contradict each
  // other meet at a mean; to let each of them end at its limit would free the node between them. All reactions between two that obey
  // friction obey it, too.
  static constexpr double kMostForce = 64, kMostForceNear = 1024, kSoftShift = 0.15;
  static constexpr int kSoftSolves = 8;

  // A law counts as met where it is missed by no more than kMet of the largest target of the step, plus kLeastMiss metres.
  static constexpr double kMet = 1e-6, kLeastMiss = 1e-9;

  struct Limits {
    std::int32_t nodes = 0, constraints = 0, columns = 0;  // most of each
    std::int32_t columns_of_surface = 0;                   // of these; the others are those of a corridor
    bool predicts = false;                                 // predict_without() and measure_norms() will be called
    Operations operations = INT64_MAX;                     // of a step (StepWork)
  };

  // Memory: at most 72 nodes^2 + 32 (3 constraints)^2 bytes, and 5 MB for laws and for systems without a factor.
  bool create(SceneMemory& memory, const Limits& limits);

  // Solves the step's constraints: force[e] (N) and modified[e] (u~, m) for each contact node e. Constraints that were there in
  // the last step keep their rows of the matrix and of the factor.
  //   solved       the targets are met, or the laws as far as doubt_of() tells
  //   regularised  some targets conflict; residual() says by how much they are missed
  //   unsolved     numbers of the bundle are not finite, or rounded until A is not definite: the outputs are zero
  // While contacts release or slip and their rows come and go, there is no factor; it is computed again when all stick, or nothing
  // changes and the step's work leaves room. There is none either where rows change and the step's work leaves no room for that.
  // Where the factor's solution breaks a law, or there is no factor, LawSolver goes on from the last step's reactions, for the
  // multiply-adds that the step's work leaves. It solves the system with the shift, and refines as above. What else finds no room:
  // the limit of the forces is then the one of kMostForce, and the second solution is that of LawSolver, or zero. Where not even
  // a sweep does, the last step's reactions act, with no more energy than they had.
  // Cost in multiply-adds: about 3 rows^2; for each changed constraint 9 (its nodes + 1) nodes, and for each of its rows
  // rows^2 / 2 to join and up to rows^2 to leave; of a disc some 300 for each other one; and for the laws. Only new nodes read the tensors.
  // again: the step has solved these constraints before, with other targets; what changed since the step before is then not known.
  Outcome solve(const Tensors& tensors, const ContactConstraints& set, Vec3* force, Vec3* modified, StepWork* work,
                bool again = false);

  // For organs that touch, whose systems are solved as one (runtime/world/joint_solver.h), in place of solve(). prepare() brings the
  // matrix up to date; false: a number is not finite. Then whoever solves sets the reactions of all rows, and take_reactions() takes them
  // over as solve() its own. The constraints of pairs have got as targets where the reactions bring them.
  bool prepare(const Tensors& tensors, const ContactConstraints& set, StepWork* work);
  Outcome take_reactions(const ContactConstraints& set, const LawEffort& effort, Vec3* force, Vec3* modified);
  std::int32_t rows_end() const { return rows_end_; }
  const RowsOfConstraint& rows_of(std::int32_t p) const { return rows_[p]; }
  const double* matrix_row(std::int32_t row) const { return matrix_ + static_cast<std::size_t>(row) * stride_; }
  double reaction_of(std::int32_t row) const { return reaction_[row]; }
  // coarse: N, the reaction before the last refinement, which took away what the shift does.
  void set_reaction(std::int32_t row, double reaction, double coarse) {
    reaction_[row] = reaction, coarse_[row] = coarse;
  }
  // m, of constraint p under the reactions that are set, along the rows of its frame.
  Vec3 reached(std::int32_t p) const;

  // Contacts that come, go or move in a step.
  struct Changes {
    Operations contacts = 0, begun = 0;                 // begun: of these, that come
    std::int32_t rows = 0, constraints = 0, nodes = 0;  // of those that come
    std::int32_t discs = 0;                             // of these constraints, those with a disc
  };
  // Their rows leave the factor and join it, where there is one, and their nodes' compliance is read.
  Operations operations_to_renew(const Changes& changes) const;
  // What solve() takes at least after them.
  Operations operations_to_solve(const Changes& changes) const {
    return operations_to_solve_for(rows_end_ + changes.rows, kept_constraints_ + changes.constraints);
  }
  // Whether constraint p has the rows of the last solve.
  bool holds(const ContactConstraints& set, std::int32_t p) const;
  // Whether constraint p of this step's solves has the rows that it had in the last step.
  bool stayed(std::int32_t p) const { return stayed_[p]; }
  // The constraint of the last solve, whose nodes are kept_nodes() + first_node; nullptr where it had none of that tool, point and part.
  // number: which it had as a rule, the one that it has now.
  const ContactConstraint* kept(const ContactConstraint& like, std::int32_t number) const;
  const ContactNode* kept_nodes() const { return kept_node_; }
  std::int32_t contact_nodes() const { return kept_nodes_; }  // of the last solve
  const ContactResidual& residual() const { return residual_; }
  const LawEffort& effort() const { return effort_; }  // all zero where the factor alone solved the system
  bool laws_decided() const { return decided_ != 0; }  // in the last solve, LawSolver

  // Why constraint p of the last solve is not to be trusted, where laws decided.
  struct Doubt {
    bool inexact;   // its law is missed: LawSolver came to its limit
    bool conflict;  // the shift alone makes its law hold: contacts conflict
  };
  Doubt doubt_of(std::int32_t p) const { return decided_ ? doubt_[p] : Doubt{}; }

  // For measuring: the system of the last solve, and the reactions ([rows_end] N) with which LawSolver starts on it.
  ContactSystem last_system() const {
    ContactSystem last = system(kept_constraint_, kept_constraints_);
    last.shared = shares_ ? &shared_ : nullptr;
    return last;
  }
  const double* last_start() const { return last_; }

  // Of constraint p of the last solve, in its frame: the reactions of its rows (N), of a joined one those of the rows that it shares; and by
  // how much its own rows miss their targets (m).
  Vec3 reaction(std::int32_t p) const;
  Vec3 missed(const ContactConstraints& set, std::int32_t p) const {
    return palpate::missed(system(set.constraints, set.constraint_count), reaction_, p);
  }

  // modified[e] as it would be if the contact (tool, point) and those that end() has named were gone, and the others kept their
  // targets and laws. False, with nothing written, where the last solve had no such contact, or `most` operations do not suffice
  // (operations_to_predict()).
  // *norm, *apart: of the reactions that are left, and of what changed in them, sqrt(J).
  // Cost in multiply-adds: rows^2 per row of the contact, and what LawSolver takes where a law decides.
  bool predict_without(std::int32_t tool, std::int32_t point, Operations most, Vec3* modified, double* norm,
                       double* apart, Operations* work);
  // The contact ends: until the next solve() all predictions are of the others alone. Its rows leave the factor now, which the next
  // solve() then does not do.
  void end(std::int32_t tool, std::int32_t point);
  // The fewest operations of predict_without().
  Operations operations_to_predict(std::int32_t tool, std::int32_t point) const;

  // m/N, of constraints p and q of the last solve along x, y and z, without their local parts: the weighted displacement of the nodes of p
  // per unit of a force on those of q, weighted alike. Cost: 9 multiply-adds for each pair of their nodes.
  Mat3 compliance_between_nodes(const ContactConstraints& set, std::int32_t p, std::int32_t q) const;
  // Constraints of the last solve that stick and have no frame, whose targets move alike.
  struct MovedAlike {
    std::int32_t constraint[2] = {-1, -1};  // -1: none
  };
  // N/m, [3 count][3 count]: by how much the sum of the reactions of such constraints grows along x, y and z as those of the same or another
  // group move, while all rows hold that now hold. Where the step's work has no room for that, by how much it would if each row were
  // alone, which is less. kept: operations that are to be left. Cost in multiply-adds: 3 count rows^2 and, where laws decided, rows^3 / 6.
  static constexpr int kMostMovedAlike = PALPATE_MAX_TOOLS;
  void measure_stiffness(const ContactConstraints& set, const MovedAlike* groups, int count, Operations kept,
                         StepWork* work, double* stiffness);
  // m, of contact node e of the last solve, under the forces of all of them. Cost: 9 multiply-adds for each.
  Vec3 displacement(const ContactConstraints& set, const Vec3* force, std::int32_t e) const;

  // m, in x, y, z: how far the discs of the last solve, without those of the contact (tool, point), move another disc beyond what the mesh
  // shows of it. predicted: under the reactions that predict_without() has left. Cost: kOfTwoDiscs for each.
  Vec3 beyond_mesh(const ContactDisc& disc, std::int32_t tool, std::int32_t point, bool predicted) const;
  std::int32_t discs() const { return kept_discs_; }  // of the last solve

  // Of the change of all reactions in the last solve, sqrt(J); below 0: it is not known, because constraints came or went or have new rows.
  // Cost: rows^2 multiply-adds.
  double change_norm(const ContactConstraints& set) const;
  // Of the last solve, with its constraints; each: [constraint_count]. Cost: 2 rows^2 multiply-adds.
  ReactionNorms measure_norms(const ContactConstraints& set, ConstraintNorms* each);
  Operations operations_to_measure() const { return 2 * squared_rows() / kDense + operations_to_measure_discs(); }
  // In its place where a step has no room for it: an upper bound of the norm of all reactions, none for their change, and of each
  // constraint neither its displacement nor its work. Cost: some 30 multiply-adds for each constraint.
  ReactionNorms bound_norms(const ContactConstraints& set, ConstraintNorms* each);

  void forget();
  // Completes a restored state (scene_memory.h) by what follows from it.
  void restored(const Tensors& tensors);

 private:
  static constexpr int kMostRowsOfAContact = 9;  // a triangle's
  using Rows = RowsOfConstraint;
  // What a law's part of solve() takes at least: three looks at the system (law_solver.h).
  static Operations operations_to_solve_for(Operations rows, Operations constraints) {
    return 3 * (rows * rows + 200 * constraints) / kDense;
  }
  Operations entries_of(const Changes& changes) const;
  Operations operations_to_measure_discs() const { return couples() ? 2 * squared_rows() / kDense : 0; }
  bool couples() const { return kept_discs_ > 1; }
  static Operations upkeep_of(Operations rows, Operations leave, Operations join);
  // Whether a step has room to keep a factor of so many rows while contacts change.
  bool affords_factor(Operations rows) const { return upkeep_of(rows, 1, 1) <= most_operations_ / 4; }
  bool update(const Tensors& tensors, const ContactConstraints& set, StepWork* work);
  void make_room_for_changes(StepWork* work);
  void match(const ContactConstraints& set);
  bool same(const ContactConstraints& set, const ContactConstraint& now, const ContactConstraint& before) const;
  void keep(const ContactConstraints& set);
  void drop_rows();
  std::int32_t close_up();
  bool same_with_joined(const ContactConstraints& set, std::int32_t p, std::int32_t k) const;
  const Mat3* spread_of(const ContactConstraints& set, const ContactConstraint& constraint);
  Mat3 between(const ContactConstraints& set, const Mat3* spread, const ContactConstraint& one,
               const ContactConstraint& other) const;
  void take_rows(const ContactConstraint& constraint, const Mat3& own, bool leads, Rows* rows);
  void bound_joined(Rows* rows);
  bool fill_rows(const ContactConstraints& set, std::int32_t p);
  void remember_between(const Rows& rows, const Rows& columns, const Mat3& between, bool add);
  void measure_between_discs(const double* reaction, double* moved) const;
  void write_scaled(const std::int32_t* order, const std::int32_t* rows, std::int32_t count, double shift,
                    UpdatedCholesky* factor);
  bool append_rows(const std::int32_t* rows, std::int32_t count);
  std::int32_t find_rows_that_hold(const ContactConstraints& set, std::int32_t* rows) const;
  void leave_factor();
  bool factor_again(StepWork* work);
  bool factored() const { return factor_.size() == used_rows_; }
  bool contacts_give_way(const ContactSystem& laws) const;
  std::int32_t take_row();
  double& entry(std::int32_t i, std::int32_t j) { return matrix_[static_cast<std::size_t>(i) * stride_ + j]; }

  ContactSystem system(const ContactConstraint* constraints, std::int32_t count) const;
  template <class Shift>
  double refine(const UpdatedCholesky& factor, Shift shift, int most_solves, double* reaction);
  Outcome solve_factored();
  void take_targets(const ContactConstraints& set);
  void set_limits(const ContactConstraint* constraints, std::int32_t count);
  bool write_forces(const ContactConstraints& set, Vec3* force, Vec3* modified) const;
  Outcome fail(const ContactConstraints& set, Vec3* force, Vec3* modified);
  double largest_displacement(const ContactConstraints& set, Vec3* force) const;
  enum class Limited { all, beside_laws };  // rows that are limited here; beside_laws: those that the laws do not limit
  bool is_limited(Limited rows, std::int32_t row) const { return rows == Limited::all || !std::isfinite(most_[row]); }
  double largest_share(Limited rows, const double* reaction) const;
  // kept: operations that come after it.
  double limit_of(Limited rows, const ContactConstraints& set, Operations kept, Vec3* force, StepWork* work) const;
  void go_within(Limited rows, double most, const double* soft);
  enum class Limiting { within, limited, no_room };
  Limiting limit_forces(const ContactConstraints& set, Operations kept, Vec3* force, StepWork* work);
  void limit_grips(const ContactSystem& laws, const ContactConstraints& set, Vec3* force, StepWork* work);
  void solve_laws(const ContactSystem& laws, int most_solves, Operations kept, StepWork* work);
  static Operations operations_to_look(const ContactSystem& laws);
  void decide_by_laws(const ContactSystem& laws, const ContactConstraints& set, bool solved, Vec3* force,
                      StepWork* work);
  void measure_laws(const ContactSystem& laws);
  static Vec3 force_of(const ContactConstraint& constraint, const Rows& rows, const double* reaction);
  static void spread_reactions(const ContactConstraint* constraints, const Rows* rows, std::int32_t count,
                               const ContactNode* nodes, const double* reaction, Vec3* force);
  int rows_of(std::int32_t tool, std::int32_t point, std::int32_t row[kMostRowsOfAContact]) const;
  bool take_out(const std::int32_t* gone, int count, double* left);
  bool may_take_out() const;
  void forget_ended();
  bool is_of(std::int32_t p, std::int32_t tool, std::int32_t point) const {
    return kept_constraint_[p].tool == tool && kept_constraint_[p].point == point;
  }
  // N, of the contacts that have not ended.
  const double* reactions_left() const { return any_ended_ ? without_ended_ : reaction_; }
  std::int64_t hold_others_to_laws(std::int32_t tool, std::int32_t point, std::int64_t most, double* left);
  void measure_residual();
  double norm_of(const double* reaction) const;
  double work_on_local(const ContactConstraints& set, std::int32_t p, const double* reaction) const;
  Operations squared_rows() const { return Operations{rows_end_} * rows_end_; }

  NodeCompliance compliance_;
  UpdatedCholesky factor_;
  UpdatedCholesky soft_factor_;  // of A + kSoftShift I, in the order of factor_; without rows where it is not computed
  std::int32_t capacity_ = 0;    // rows
  std::size_t stride_ = 0;       // numbers per row of the matrix
  std::int32_t rows_end_ = 0;    // all rows in use are below this number
  std::int32_t free_row_ = 0;    // all rows below this number are in use
  double* matrix_ = nullptr;     // [rows][stride] H W H^T, m/N
  double* between_ = nullptr;    // [rows][stride] m/N, the part of it between discs; where predict_without() is called
  double* scale_ = nullptr;      // [rows] D; 0: the row is not in use
  double* shift_ = nullptr;      // [rows] added to the scaled diagonal, kShift or more
  double* soft_ = nullptr;       // [rows] m/N, the same on the diagonal of the matrix
  double* target_ = nullptr;     // [rows] m
  double most_target_ = 0;       // m, the largest size of a target
  double* reaction_ = nullptr;   // [rows] N
  double* last_ = nullptr;       // [rows] N, of the last step, for rows that stay
  double* work_ = nullptr;       // [3][rows]
  double* removal_ = nullptr;    // [kMostRowsOfAContact][rows], where predict_without() is called
  // Where predict_without() is called; met: the reactions meet the targets of all contacts that are left.
  double* without_ = nullptr;                            // [rows] N, of the last prediction
  std::int32_t without_tool_ = -1, without_point_ = -1;  // whose that is; -1: there is none
  bool without_met_ = false;
  double* without_ended_ = nullptr;  // [rows] N, without the contacts that have ended since the last solve
  bool* ended_ = nullptr;            // [constraint_capacity] the kept constraints of these
  bool any_ended_ = false, ended_met_ = false;
  std::int32_t* row_at_ = nullptr;  // [rows] the rows in use, in the order of the factor
  std::int32_t used_rows_ = 0;
  // 1: in the last solve laws decided that some contacts release, slip or are at a limit. Then the factor does not solve the next step
  // either, as a rule: it is not renewed.
  std::int32_t gives_way_ = 0;
  std::int32_t decided_ = 0;       // 1: LawSolver had to decide in the last solve
  bool limited_ = false;           // the last solve brought forces within their limit
  std::int32_t joining_rows_ = 0;  // new rows of a step
  Operations most_operations_ = INT64_MAX;
  bool again_ = false;                 // the last solve was one more of its step
  std::int32_t last_constraints_ = 0;  // of the solve before
  std::int32_t* list_ = nullptr;       // [rows]
  std::int32_t* leaving_ = nullptr;    // [rows]
  std::int32_t leaving_count_ = 0;
  std::int32_t changed_contacts_ = 0;  // that have new rows or none any more
  Mat3* spread_ = nullptr;             // [node_capacity] H C of the constraint whose rows are being filled

  double most_joined_ = 0;     // m/N, while rows are filled: the largest compliance of one of those that share a row
  Rows* rows_ = nullptr;       // [constraint_capacity] of this step
  bool* is_kept_ = nullptr;    // [constraint_capacity] its rows were there in the last step
  bool* stayed_ = nullptr;     // [constraint_capacity] the same, of the first solve of a step
  Vec3* carried_ = nullptr;    // [constraint_capacity] N, the last step's reaction of a contact that got new rows
  Rows* kept_rows_ = nullptr;  // [constraint_capacity] of the last step, like all kept_
  ContactNode* kept_node_ = nullptr;
  ContactConstraint* kept_constraint_ = nullptr;
  std::int32_t kept_constraints_ = 0, kept_nodes_ = 0;
  std::int32_t kept_discs_ = 0;  // constraints with a disc, of a grasp's parts the first
  ContactResidual residual_;
  double energy_ = 0, last_energy_ = 0;  // J, r^T A r: of the last solve; of the one before

  LawSolver laws_;
  SharedNodes shared_;
  bool shares_ = false;  // the last solve went through shared_
  LawEffort effort_;
  Doubt* doubt_ = nullptr;      // [2][constraint_capacity] in the second half: before grips were limited
  double* most_ = nullptr;      // [rows] N, the limits of the reactions
  double* coarse_ = nullptr;    // [rows] N, the reactions before a refinement
  double* softened_ = nullptr;  // [rows] m/N, soft_ with kSoftShift where contacts do not give way
  double* met_ = nullptr;       // [rows] N, the reactions that the limit changes
};

}  // namespace palpate
