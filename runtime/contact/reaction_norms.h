// Norms of reactions in the energy of the field that they make, sqrt(r^T (H W H^T) r), in sqrt(J). What the mesh does not resolve of
// discs (ContactConstraint::local, disc_compliance.h) moves no node and does not count.
#pragma once

#include "runtime/base/step_work.h"
#include "runtime/contact/contact_matrix.h"

namespace palpate {

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

// What was solved, [rows_end] each.
struct SolvedReactions {
  const double *reaction, *last;  // N; last: of the solve before, for rows that stayed
  const double* target;           // m
  bool again;                     // the step had solved before: what changed since the step before is not known
};

// sqrt(J), with the discs' part. Rows that are not in use have a reaction of zero. Cost: rows^2 multiply-adds.
double energy_norm(const RowMatrix& matrix, const double* reaction);

// scratch: [2][capacity] scratch; each: [constraint_count]. Cost: operations_to_measure().
ReactionNorms measure_norms(const ContactMatrix& matrix, const ContactConstraints& set, const SolvedReactions& solved,
                            double* scratch, ConstraintNorms* each);
Operations operations_to_measure(const ContactMatrix& matrix);

// In its place where a step has no room for it: an upper bound of the norm of all reactions, none for their change, and of each
// constraint neither its displacement nor its work. Cost: some 30 multiply-adds for each constraint.
ReactionNorms bound_norms(const ContactMatrix& matrix, const ContactConstraints& set, const SolvedReactions& solved,
                          double* scratch, ConstraintNorms* each);

}  // namespace palpate
