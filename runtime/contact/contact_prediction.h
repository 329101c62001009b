// Predicts the contacts without one of them, from the solution with all of them.
#pragma once

#include <cstdint>

#include "runtime/contact/contact_factor.h"
#include "runtime/contact/contact_matrix.h"
#include "runtime/contact/law_solver.h"

namespace palpate {

class ContactPrediction {
 public:
  bool create(SceneMemory& memory, ContactMatrix* matrix, ContactFactor* factor, LawSolver* laws);
  bool exists() const { return without_ != nullptr; }
  // The last solution is no more: neither are predictions from it.
  void forget() { last_ = {}; }

  // The last solution.
  struct Solution {
    ContactSystem system;    // of the constraints that the matrix holds
    const double* reaction;  // [rows_end] N
    double tolerance;        // m, to which laws are solved
    bool by_laws;            // LawSolver decided: the factor does not meet it
  };
  // force[e] as it would be if the contact and those that end() has named were gone, and the others kept their
  // targets and laws. False, with nothing written, where the last solve had no such contact, or `most` operations do not suffice
  // (operations()). *norm, *apart: of the reactions that are left, and of what changed in them, sqrt(J).
  // Cost in multiply-adds: rows^2 per row of the contact, and what LawSolver takes where a law decides.
  bool predict(const Solution& of, const ContactId& contact, Operations most, Vec3* force, double* norm, double* apart,
               Operations* work);
  // The fewest operations of predict().
  Operations operations(const ContactSystem& system, const ContactId& contact) const;
  // The contact ends: until the next solve all predictions are of the others alone. Its rows leave the factor now, which the next
  // solve then does not do. Its prediction, where there is one, holds the others to their targets and laws. Else the next prediction
  // does so.
  void end(const double* reaction, const ContactId& contact);
  // [rows_end] N, that the last predict() has left.
  const double* reactions() const { return without_; }

 private:
  // N, of the contacts that have not ended.
  const double* left_of(const double* reaction) const { return matrix_->held().any_ended ? without_ended_ : reaction; }
  std::int64_t hold_others_to_laws(const Solution& of, const ContactId& contact, std::int64_t most);

  ContactMatrix* matrix_ = nullptr;
  ContactFactor* factor_ = nullptr;
  LawSolver* laws_ = nullptr;
  double* removal_ = nullptr;             // [kMostRowsOfAContact][rows]
  double* change_ = nullptr;              // [rows]
  RowsOfConstraint* others_ = nullptr;    // [constraints] the rows of those that are left
  double* without_ = nullptr;             // [rows] N
  double* without_ended_ = nullptr;       // [rows] N, without the contacts that have ended since the last solve
  ContactId last_;                        // whose prediction the last one is; index -1: there is none
  bool met_ = false, ended_met_ = false;  // the reactions meet the targets of all contacts that are left
};

}  // namespace palpate
