// Contact forces from imposed displacements:
//     (H W H^T) r = d,   f = H^T r,   u~_j = (T^f_j)^-1 f_j.
// H W H^T is the contact matrix (contact_matrix.h), d the targets u* of its rows, r their reactions.
// Source: Cotin, Delingette and Ayache 1999, eqs 7 to 10. The paper solves M u~ = u*, which is not symmetric; with forces as
// unknowns the same system is symmetric positive definite (docs/method.md).
#pragma once

#include <cmath>
#include <cstdint>

#include "runtime/contact/contact_prediction.h"
#include "runtime/contact/reaction_norms.h"
#include "runtime/contact/system_solver.h"

namespace palpate {

class ContactSolver {
 public:
  using Outcome = SystemSolver::Outcome;
  using Doubt = SystemSolver::Doubt;

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

  // For several organs whose systems are solved as one, in place of solve(). prepare() brings the
  // matrix up to date; false: a number is not finite. take_targets() writes those of the system. Then whoever solves sets the reactions of all
  // rows, and take_reactions() takes them over as solve() its own. The constraints between organs have got as targets where the reactions bring them.
  bool prepare(const Tensors& tensors, const ContactConstraints& set, StepWork* work);
  void take_targets(const ContactConstraints& set);
  Outcome take_reactions(const ContactConstraints& set, const LawEffort& effort, Vec3* force, Vec3* modified);
  // Ends a solve without contact forces; the next step begins anew.
  Outcome fail(const ContactConstraints& set, Vec3* force, Vec3* modified);
  const SystemSolver& system() const { return system_; }
  SystemSolver& system() { return system_; }
  const ContactMatrix& matrix() const { return matrix_; }
  // Of constraint p of the last solve, in its frame: the reactions of its rows (N); where they bring it, and by how much it misses its
  // target (m).
  Vec3 reaction(std::int32_t p) const { return matrix_.reaction(system_.reactions(), p); }
  Vec3 reached(std::int32_t p) const { return matrix_.reached(system_.reactions(), p); }
  Vec3 missed(const ContactConstraints& set, std::int32_t p) const {
    return palpate::missed(system_.system(rows_for(set)), system_.reactions(), p);
  }
  const ContactResidual& residual() const { return system_.residual(); }
  const LawEffort& effort() const { return system_.effort(); }
  Doubt doubt_of(std::int32_t p) const { return system_.doubt_of(p); }

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
    return SystemSolver::operations_for(matrix_.rows().rows_end + changes.rows,
                                        matrix_.held().count + changes.constraints);
  }

  // For measuring: the system of the last solve.
  ContactSystem last_system() const {
    ContactSystem last = system_.system(held_rows());
    last.shared = shares_ ? &shared_ : nullptr;
    return last;
  }

  // ContactPrediction's, of the last solve.
  bool predict_without(const ContactId& contact, Operations most, Vec3* force, double* norm, double* apart,
                       Operations* work) {
    return prediction_.predict(solution(), contact, most, force, norm, apart, work);
  }
  // m, u~ of contact node e of the last solve under a force.
  Vec3 modified(std::int32_t e, Vec3 force) const {
    return matrix_.compliance().modified(matrix_.compliance().slot_of_contact_node(e), force);
  }
  Operations operations_to_predict(const ContactId& contact) const {
    return prediction_.operations(system_.system(held_rows()), contact);
  }
  void end(const ContactId& contact) {
    if (prediction_.exists()) prediction_.end(system_.reactions(), contact);
  }
  // m, in x, y, z: how far the discs of the last solve, without those of the contact, move another disc beyond what the mesh
  // shows of it. predicted: under the reactions that predict_without() has left. Cost: kOfTwoDiscs for each.
  Vec3 beyond_mesh(const ContactDisc& disc, const ContactId& contact, bool predicted) const {
    return matrix_.beyond_mesh(predicted ? prediction_.reactions() : system_.reactions(), disc, contact);
  }

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
  ConstraintRows rows_for(const ContactConstraints& set) const {
    return {set.constraints, matrix_.rows_of_constraints(), set.constraint_count};
  }
  ConstraintRows held_rows() const {
    return {matrix_.held().constraints, matrix_.rows_of_constraints(), matrix_.held().count};
  }
  ContactPrediction::Solution solution() const {
    return {system_.system(held_rows()), system_.reactions(), system_.tolerance(), system_.by_laws()};
  }
  SolvedReactions solved() const { return {system_.reactions(), system_.last(), system_.targets(), again_}; }
  Operations entries_of(const Changes& changes) const;
  bool update(const Tensors& tensors, const ContactConstraints& set, StepWork* work);
  void make_room_for_changes(StepWork* work);
  bool write_forces(const ContactConstraints& set, Vec3* force, Vec3* modified) const;

  ContactMatrix matrix_;
  SystemSolver system_;
  ContactPrediction prediction_;
  SharedNodes shared_;
  bool shares_ = false;                // the last solve went through shared_
  double* work_ = nullptr;             // [2][rows]
  bool again_ = false;                 // the last solve was one more of its step
  std::int32_t last_constraints_ = 0;  // of the solve before
};

}  // namespace palpate
