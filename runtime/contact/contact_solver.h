// Contact forces from imposed displacements, by a factor whose rows come and go with the contacts:
//     (H W H^T) r = d,   f = H^T r,   u~_j = (T^f_j)^-1 f_j.
// W_ab = C_ab is the compliance between contact nodes, H the rows of the constraints, d their targets u*, r their reactions.
// Source: Cotin, Delingette and Ayache 1999, eqs 7 to 10. The paper solves M u~ = u*, which is not symmetric; with forces as
// unknowns the same system is symmetric positive definite (docs/method.md).
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/contact_laws.h"
#include "runtime/contact/node_compliance.h"
#include "runtime/dense/updated_cholesky.h"

namespace palpate {

// Norms of reactions in the energy of the field that they make, sqrt(r^T (H W H^T) r), in sqrt(J).
struct ReactionNorms {
  double whole = 0;           // of all reactions
  double change_of_kept = 0;  // of the change since the last solve, of the constraints that kept their rows
  std::int64_t operations = 0;
};
// The same of one constraint.
struct ConstraintNorms {
  double own = 0, own_change = 0;  // of its reactions alone; of their change, 0 where its rows are new
  double work = 0;                 // J: its reactions times the displacement by all reactions
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
  //     |D^-1 r| <= kMostSolves / kShift |D d|:
  // as the gap between two conflicting targets closes, their force grows monotonically and stays finite. Separate contacts are
  // met to (kShift / e)^2 or better, which is below single precision.
  static constexpr double kShift = 1e-6;
  static constexpr int kMostSolves = 4;

  // predicts: predict_without() will be called. Memory: at most 72 node_capacity^2 + 16 (3 constraint_capacity)^2 bytes.
  bool create(SceneMemory& memory, std::int32_t node_capacity, std::int32_t constraint_capacity, std::int32_t columns,
              bool predicts);

  // Solves the step's constraints: force[e] (N) and modified[e] (u~, m) for each contact node e. Constraints that were there in
  // the last step keep their rows of the matrix and of the factor.
  //   solved       the targets are met
  //   regularised  some targets conflict; residual() says by how much they are missed
  //   unsolved     numbers of the bundle are not finite, or rounded until A is not definite: the outputs are zero
  // Where the solution breaks a law, projected Gauss-Seidel continues from the last step's reactions.
  // Cost in multiply-adds: about 3 rows^2; rows^2 per sweep; for each changed constraint 9 (its nodes + 1) nodes, and for each of
  // its rows rows^2 / 2 to join and up to rows^2 to leave. Only new nodes read the tensors.
  Outcome solve(const Tensors& tensors, const ContactConstraints& set, Vec3* force, Vec3* modified);
  const ContactResidual& residual() const { return residual_; }

  // Of constraint p of the last solve, in its frame: the reactions of its rows (N), and by how much they miss their targets (m).
  Vec3 reaction(std::int32_t p) const;
  Vec3 missed(const ContactConstraints& set, std::int32_t p) const {
    return palpate::missed(system(set.constraints, set.constraint_count), reaction_, p);
  }

  // modified[e] as it would be if the contact (tool, point) were gone and the others kept their targets and laws. False, with
  // nothing written, where the last solve had no such contact.
  // *norm: of the reactions that are left, sqrt(J).
  // Cost in multiply-adds: rows^2 per row of the contact, and ten sweeps where a law decides.
  bool predict_without(std::int32_t tool, std::int32_t point, Vec3* modified, double* norm);

  // Of the last solve, with its constraints; each: [constraint_count]. Cost: 2 rows^2 multiply-adds.
  ReactionNorms measure_norms(const ContactConstraints& set, ConstraintNorms* each);

  void forget();

 private:
  static constexpr int kMostRowsOfAContact = 9;  // a triangle's
  using Rows = RowsOfConstraint;
  bool update(const Tensors& tensors, const ContactConstraints& set);
  void match(const ContactConstraints& set);
  bool same(const ContactConstraints& set, const ContactConstraint& now, const ContactConstraint& before) const;
  void keep(const ContactConstraints& set);
  void drop_rows();
  const Mat3* spread_of(const ContactConstraints& set, const ContactConstraint& constraint);
  bool fill_rows(const ContactConstraints& set, std::int32_t p);
  bool append_rows(const std::int32_t* rows, std::int32_t count);
  std::int32_t take_row();
  double& entry(std::int32_t i, std::int32_t j) { return matrix_[static_cast<std::size_t>(i) * stride_ + j]; }

  ContactSystem system(const ContactConstraint* constraints, std::int32_t count) const;
  Outcome solve_factored();
  void solve_laws(const ContactSystem& laws);
  static void spread_reactions(const ContactConstraint* constraints, const Rows* rows, std::int32_t count,
                               const ContactNode* nodes, const double* reaction, Vec3* force);
  int rows_of(std::int32_t tool, std::int32_t point, std::int32_t row[kMostRowsOfAContact]) const;
  bool take_out(const std::int32_t* gone, int count, double* left);
  void hold_others_to_laws(std::int32_t tool, std::int32_t point, double* left);
  void measure_residual();
  double norm_of(const double* reaction) const;

  NodeCompliance compliance_;
  UpdatedCholesky factor_;
  std::int32_t capacity_ = 0;        // rows
  std::size_t stride_ = 0;           // numbers per row of the matrix
  std::int32_t rows_end_ = 0;        // all rows in use are below this number
  std::int32_t free_row_ = 0;        // all rows below this number are in use
  double* matrix_ = nullptr;         // [rows][stride] H W H^T, m/N
  double* scale_ = nullptr;          // [rows] D; 0: the row is not in use
  double* shift_ = nullptr;          // [rows] added to the scaled diagonal, kShift or more
  double* soft_ = nullptr;           // [rows] m/N, the same on the diagonal of the matrix
  double* target_ = nullptr;         // [rows] m
  double* reaction_ = nullptr;       // [rows] N
  double* last_ = nullptr;           // [rows] N, of the last step, for rows that stay
  double* work_ = nullptr;           // [2][rows]
  double* removal_ = nullptr;        // [kMostRowsOfAContact][rows], where predict_without() is called
  std::int32_t* row_at_ = nullptr;   // [rows] which row stands at each position of the factor
  std::int32_t* list_ = nullptr;     // [rows]
  std::int32_t* leaving_ = nullptr;  // [rows]
  std::int32_t leaving_count_ = 0;
  Mat3* spread_ = nullptr;  // [node_capacity] H C of the constraint whose rows are being filled

  Rows* rows_ = nullptr;       // [constraint_capacity] of this step
  bool* is_kept_ = nullptr;    // [constraint_capacity] its rows were there in the last step
  Rows* kept_rows_ = nullptr;  // [constraint_capacity] of the last step, like all kept_
  ContactNode* kept_node_ = nullptr;
  ContactConstraint* kept_constraint_ = nullptr;
  std::int32_t kept_constraints_ = 0, kept_nodes_ = 0;
  ContactResidual residual_;
};

}  // namespace palpate
