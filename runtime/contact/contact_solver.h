// Contact forces from imposed displacements:
//     (H W H^T) r = d,   f = H^T r,   u~_j = (T^f_j)^-1 f_j.
// H W H^T is the contact matrix (contact_matrix.h), d the targets u* of its rows, r their reactions.
// Source: Cotin, Delingette and Ayache 1999, eqs 7 to 10. The paper solves M u~ = u*, which is not symmetric; with forces as
// unknowns the same system is symmetric positive definite (docs/method.md).
#pragma once

#include <cmath>
#include <cstdint>

#include "runtime/contact/contact_prediction.h"
#include "runtime/contact/reaction_limit.h"
#include "runtime/contact/reaction_norms.h"

namespace palpate {

class ContactSolver {
 public:
  enum class Outcome { solved, regularised, unsolved };

  // A law counts as met where it is missed by no more than kMet of the largest target of the step, plus kLeastMiss metres.
  static constexpr double kMet = 1e-6, kLeastMiss = 1e-9;

  struct Limits {
    ContactMatrix::Limits of;           // predicts: predict_without() and measure_norms() will be called
    Operations operations = INT64_MAX;  // of a step (StepWork)
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
  // multiply-adds that the step's work leaves. It solves the system with the shift, and refines as the factor does. What else finds no
  // room: the limit of the forces is then the one of ReactionLimit::kMostForce, and the second solution is that of LawSolver, or zero.
  // Where not even a sweep does, the last step's reactions act, with no more energy than they had.
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
  // coarse: N, the reaction before the last refinement, which took away what the shift does.
  void set_reaction(std::int32_t row, double reaction, double coarse) {
    reaction_[row] = reaction, coarse_[row] = coarse;
  }

  // m: how far the reactions move a contact node at most. force: [node_count], overwritten.
  double largest_displacement(const ContactConstraints& set, Vec3* force) const {
    return palpate::largest_displacement(matrix_, set, reaction_, force);
  }

  const ContactMatrix& matrix() const { return matrix_; }
  double reaction_of(std::int32_t row) const { return reaction_[row]; }
  // Of constraint p of the last solve, in its frame: the reactions of its rows (N); where they bring it, and by how much it misses its
  // target (m).
  Vec3 reaction(std::int32_t p) const { return matrix_.reaction(reaction_, p); }
  Vec3 reached(std::int32_t p) const { return matrix_.reached(reaction_, p); }
  Vec3 missed(const ContactConstraints& set, std::int32_t p) const {
    return palpate::missed(system(set.constraints, set.constraint_count), reaction_, p);
  }
  const ContactResidual& residual() const { return residual_; }
  const LawEffort& effort() const { return effort_; }  // all zero where the factor alone solved the system

  // Why constraint p of the last solve is not to be trusted, where laws decided.
  struct Doubt {
    bool inexact;   // its law is missed: LawSolver came to its limit
    bool conflict;  // the shift alone makes its law hold: contacts conflict
  };
  Doubt doubt_of(std::int32_t p) const { return decided_ ? doubt_[p] : Doubt{}; }

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
    return operations_to_solve_for(matrix_.rows_end() + changes.rows, matrix_.held().count + changes.constraints);
  }

  // For measuring: the system of the last solve.
  ContactSystem last_system() const {
    ContactSystem last = system_held();
    last.shared = shares_ ? &shared_ : nullptr;
    return last;
  }

  // ContactPrediction's, of the last solve.
  bool predict_without(const ContactId& contact, Operations most, Vec3* modified, double* norm, double* apart,
                       Operations* work) {
    return prediction_.predict(solution(), contact, most, modified, norm, apart, work);
  }
  Operations operations_to_predict(const ContactId& contact) const {
    return prediction_.operations(system_held(), contact);
  }
  void end(const ContactId& contact) {
    if (prediction_.exists()) prediction_.end(reaction_, contact);
  }
  // m, in x, y, z: how far the discs of the last solve, without those of the contact, move another disc beyond what the mesh
  // shows of it. predicted: under the reactions that predict_without() has left. Cost: kOfTwoDiscs for each.
  Vec3 beyond_mesh(const ContactDisc& disc, const ContactId& contact, bool predicted) const {
    return matrix_.beyond_mesh(predicted ? prediction_.reactions() : reaction_, disc, contact);
  }

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

  // Of the change of all reactions in the last solve, sqrt(J); below 0: it is not known, because constraints came or went or have new rows.
  // Cost: rows^2 multiply-adds.
  double change_norm(const ContactConstraints& set) const;
  // Of the last solve, with its constraints; each: [constraint_count] (reaction_norms.h).
  ReactionNorms measure_norms(const ContactConstraints& set, ConstraintNorms* each) {
    return palpate::measure_norms(matrix_, set, solved(), work_, each);
  }
  Operations operations_to_measure() const { return palpate::operations_to_measure(matrix_); }
  ReactionNorms bound_norms(const ContactConstraints& set, ConstraintNorms* each) {
    return palpate::bound_norms(matrix_, set, solved(), work_, each);
  }

  void forget();
  // Completes a restored state (scene_memory.h) by what follows from it.
  void restored(const Tensors& tensors);

 private:
  // What a law's part of solve() takes at least: three looks at the system (law_solver.h).
  static Operations operations_to_solve_for(Operations rows, Operations constraints) {
    return 3 * (rows * rows + 200 * constraints) / kDense;
  }
  Operations entries_of(const Changes& changes) const;
  Operations squared_rows() const { return Operations{matrix_.rows_end()} * matrix_.rows_end(); }
  bool update(const Tensors& tensors, const ContactConstraints& set, StepWork* work);
  void make_room_for_changes(StepWork* work);
  bool renew_factor(StepWork* work);
  bool contacts_give_way(const ContactSystem& laws) const;
  std::int32_t find_rows_that_hold(const ContactConstraints& set, std::int32_t* rows) const;
  ContactSystem system(const ContactConstraint* constraints, std::int32_t count) const;
  ContactSystem system_held() const { return system(matrix_.held().constraints, matrix_.held().count); }
  ContactPrediction::Solution solution() const;
  SolvedReactions solved() const { return {reaction_, last_, target_, again_}; }
  void take_targets(const ContactConstraints& set);
  void set_limits(const ContactConstraint* constraints, std::int32_t count);
  double thrown(const ContactConstraints& set, Operations kept, Vec3* force, StepWork* work) const;
  bool write_forces(const ContactConstraints& set, Vec3* force, Vec3* modified) const;
  Outcome fail(const ContactConstraints& set, Vec3* force, Vec3* modified);
  enum class Limiting { within, limited, no_room };
  Limiting limit_forces(const ContactConstraints& set, Operations kept, Vec3* force, StepWork* work);
  void limit_grips(const ContactSystem& laws, const ContactConstraints& set, Vec3* force, StepWork* work);
  void solve_laws(const ContactSystem& laws, int most_solves, Operations kept, StepWork* work);
  static Operations operations_to_look(const ContactSystem& laws);
  void decide_by_laws(const ContactSystem& laws, const ContactConstraints& set, bool solved, Vec3* force,
                      StepWork* work);
  void measure_laws(const ContactSystem& laws);
  void measure_residual();

  ContactMatrix matrix_;
  ContactFactor factor_;
  ReactionLimit limit_;
  ContactPrediction prediction_;
  LawSolver laws_;
  SharedNodes shared_;
  double* target_ = nullptr;      // [rows] m
  double most_target_ = 0;        // m, the largest size of a target
  double* reaction_ = nullptr;    // [rows] N
  double* last_ = nullptr;        // [rows] N, of the last step, for rows that stay
  double* coarse_ = nullptr;      // [rows] N, the reactions before a refinement
  double* softened_ = nullptr;    // [rows] m/N, soft() with kSoftShift where contacts do not give way
  double* work_ = nullptr;        // [3][rows]
  Doubt* doubt_ = nullptr;        // [2][constraint_capacity] in the second half: before grips were limited
  std::int32_t* list_ = nullptr;  // [rows]
  LawEffort effort_;
  ContactResidual residual_;
  double energy_ = 0, last_energy_ = 0;  // J, r^T A r: of the last solve; of the one before
  // 1: in the last solve laws decided that some contacts release, slip or are at a limit. Then the factor does not solve the next step
  // either, as a rule: it is not renewed.
  std::int32_t gives_way_ = 0;
  std::int32_t decided_ = 0;           // 1: LawSolver had to decide in the last solve
  bool limited_ = false;               // the last solve brought forces within their limit
  bool shares_ = false;                // the last solve went through shared_
  bool again_ = false;                 // the last solve was one more of its step
  std::int32_t last_constraints_ = 0;  // of the solve before
};

}  // namespace palpate
