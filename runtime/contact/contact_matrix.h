// The contact matrix H W H^T, whose rows come and go with the constraints of the steps.
// W_ab = C_ab is the compliance between contact nodes. H has the rows of the constraints. Discs add the compliance that the mesh does not
// resolve: ContactConstraint::local for each, disc_compliance.h between two. H W H^T includes it.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/contact_laws.h"
#include "runtime/contact/node_compliance.h"
#include "runtime/contact/row_matrix.h"

namespace palpate {

// The constraints of the last solve, and where their rows are.
struct HeldConstraints {
  ContactNode* nodes = nullptr;              // [node_capacity]
  ContactConstraint* constraints = nullptr;  // [constraint_capacity]
  RowsOfConstraint* rows = nullptr;          // [constraint_capacity]
  std::int32_t count = 0, node_count = 0;
  std::int32_t discs = 0;  // constraints with a disc; of a contact that has several, the first
  bool* ended = nullptr;   // [constraint_capacity] of contacts that have ended since
  bool any_ended = false;
};

class ContactMatrix {
 public:
  struct Limits {
    std::int32_t nodes = 0, constraints = 0, columns = 0;  // most of each
    std::int32_t columns_of_surface = 0;                   // of these; the others are those of a corridor
    std::int32_t surface_nodes = 0;                        // where a body changes (changed_body.h)
    bool predicts = false;                                 // what discs share is asked for
    const Offset* offset = nullptr;
  };
  // Memory: at most 72 nodes^2 + 16 (3 constraints)^2 bytes.
  bool create(SceneMemory& memory, const Limits& limits);
  void forget();
  // Completes a restored state (scene_memory.h) by what follows from it.
  void restored(const Tensors& tensors);

  // A step brings the matrix up to date by these four, in their order.
  // Finds which constraints were there in the last solve. again: the step has solved before. False where a number is not finite.
  bool match(const Tensors& tensors, const ContactConstraints& set, const double* reaction, bool again);
  // Rows of constraints that are gone have no scale and no reaction any more.
  void drop_leaving(double* reaction);
  // Fills the rows of constraints that are new; of one that had others in the last solve they begin with the reactions of these. False
  // where a number is not finite.
  bool add_coming(const ContactConstraints& set, double* reaction);
  void keep(const ContactConstraints& set);

  // Of the match.
  const std::int32_t* coming() const { return coming_; }
  std::int32_t coming_count() const { return coming_count_; }
  std::int32_t leaving_count() const { return leaving_count_; }
  std::int32_t joining_rows() const { return joining_rows_; }  // that the constraints without rows will take at most
  std::int32_t changed_contacts() const { return changed_contacts_; }  // that have new rows or none any more
  bool is_kept(std::int32_t p) const { return is_kept_[p]; }           // constraint p had its rows in the last solve
  bool stayed(std::int32_t p) const { return stayed_[p]; }             // the same, of the first solve of a step
  bool is_renewed() const { return is_renewed_; }                      // in this step: the compliance is another one

  const RowMatrix& rows() const { return matrix_; }
  const RowsOfConstraint* rows_of_constraints() const { return rows_; }
  const RowsOfConstraint& rows_of(std::int32_t p) const { return rows_[p]; }
  const HeldConstraints& held() const { return held_; }
  const NodeCompliance& compliance() const { return compliance_; }

  // Whether constraint p has the rows of the last solve.
  bool holds(const ContactConstraints& set, std::int32_t p) const;
  // The constraint of the last solve; nullptr where it had none of that contact and part. number: which it had as a rule, the one that
  // it has now.
  const ContactConstraint* kept(const ContactConstraint& like, std::int32_t number) const;
  bool is_of(std::int32_t p, const ContactId& contact) const { return held_.constraints[p].id.contact == contact; }
  // Rows of the contact in the last solve. Returns how many there are.
  int rows_of(const ContactId& contact, std::int32_t row[kMostRowsOfAContact]) const;
  // The contact is not found in the next match. Its rows keep their scales, but for those that retire() names.
  void end(const ContactId& contact);
  void retire(const std::int32_t* rows, int count);

  // What the rows of discs move beyond the mesh by the reactions of other discs, m, [rows_end].
  void measure_between_discs(const double* reaction, double* moved) const;
  bool couples() const { return held_.discs > 1; }

  // m, in x, y, z: how far the discs, without those of the contact, move another disc beyond what the mesh shows of it.
  Vec3 beyond_mesh(const double* reaction, const ContactDisc& disc, const ContactId& contact) const;

  // N, of constraint p in its frame: the reactions of its rows, of a joined one those of the rows that it shares.
  Vec3 reaction(const double* reaction, std::int32_t p) const;
  // m, of constraint p under the reactions, along the rows of its frame.
  Vec3 reached(const double* reaction, std::int32_t p) const;
  // m, along the axis along which the reactions move a contact node most; the square of a length of 1e-290 m would be zero. Below 0: the
  // step's work has no room for the answer, with what is kept for later work. force: [node_count], overwritten. Cost: 9 multiply-adds
  // for each pair of nodes.
  double largest_displacement(const ContactConstraints& set, const double* reaction, Vec3* force, Operations kept,
                              StepWork* work) const;
  // [count of the offset]: g (offset.h) of the forces of one contact of the last solve.
  void find_given(const Offset& offset, const double* reaction, const ContactId& contact, double* given) const;
  // m, of contact node e under forces on all of them. Cost: 9 multiply-adds for each.
  Vec3 displacement(const ContactConstraints& set, const Vec3* force, std::int32_t e) const;
  // m/N, of constraints p and q along x, y and z, without their local parts. Cost: 9 multiply-adds for each pair of their nodes.
  Mat3 compliance_between_nodes(const ContactConstraints& set, std::int32_t p, std::int32_t q) const;

 private:
  using Rows = RowsOfConstraint;
  bool same(const ContactConstraints& set, const ContactConstraint& now, const ContactConstraint& before) const;
  bool same_with_joined(const ContactConstraints& set, std::int32_t p, std::int32_t k) const;
  bool holds_all(const ContactConstraints& set) const;
  void forget_ended();
  const Mat3* spread_of(const ContactConstraints& set, const ContactConstraint& constraint);
  const Mat3& between(const ContactConstraints& set, const Mat3* spread, const ContactConstraint& one,
                      const ContactConstraint& other, Mat3* sum) const;
  Rows take_rows(const ContactConstraint& constraint, const Mat3& own, bool leads);
  void bound_joined(Rows* rows);
  bool fill_rows(const ContactConstraints& set, std::int32_t p);
  void remember_between(const Rows& rows, const Rows& columns, const Mat3& between, bool couple, bool add);

  NodeCompliance compliance_;
  std::int32_t free_row_ = 0;  // all rows below this number are in use
  RowMatrix matrix_;           // H W H^T
  double* between_ = nullptr;  // [rows][stride] m/N, the part of it between discs; where Limits::predicts
  bool has_coupled_ = false;   // some of between_ is not zero, or has been
  Mat3* spread_ = nullptr;     // [node_capacity] H C of the constraint whose rows are being filled
  double most_joined_ = 0;     // m/N, while rows are filled: the largest compliance of one of those that share a row
  Rows* rows_ = nullptr;       // [constraint_capacity] of this step
  HeldConstraints held_;
  bool* is_kept_ = nullptr;  // [constraint_capacity]
  bool* stayed_ = nullptr;   // [constraint_capacity]
  bool is_renewed_ = false;
  bool unchanged_ = false;           // the constraints of this solve are those of the last one
  Vec3* carried_ = nullptr;          // [constraint_capacity] N, the last reaction of a constraint that gets new rows
  std::int32_t* leaving_ = nullptr;  // [rows]
  std::int32_t* coming_ = nullptr;   // [rows]
  std::int32_t leaving_count_ = 0, coming_count_ = 0, joining_rows_ = 0, changed_contacts_ = 0;
};

// f = H^T r: adds the reactions of the rows (N) to the forces of their contact nodes.
void spread_reactions(const ContactConstraint* constraints, const RowsOfConstraint* rows, std::int32_t count,
                      const ContactNode* nodes, const double* reaction, Vec3* force);

}  // namespace palpate
