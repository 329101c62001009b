#include "runtime/contact/contact_prediction.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact/reaction_norms.h"

namespace palpate {

bool ContactPrediction::create(SceneMemory& memory, ContactMatrix* matrix, ContactFactor* factor, LawSolver* laws) {
  matrix_ = matrix, factor_ = factor, laws_ = laws;
  const auto rows = static_cast<std::size_t>(matrix->rows().capacity);
  removal_ = memory.array<double>(kMostRowsOfAContact * rows);
  change_ = memory.array<double>(rows);
  others_ = memory.array<RowsOfConstraint>(rows / 3);
  without_ = memory.array<double>(rows);
  without_ended_ = memory.array<double>(rows);
  return !memory.failed();
}

// With a sweep, which laws may ask for.
Operations ContactPrediction::operations(const ContactSystem& system, const ContactId& contact) const {
  std::int32_t own[kMostRowsOfAContact];
  const Operations squared = Operations{matrix_->rows().rows_end} * matrix_->rows().rows_end;
  return (2 * matrix_->rows_of(contact, own) + 2) * squared / kDense + operations_of_sweep(system) / kDense + 1;
}

bool ContactPrediction::predict(const Solution& of, const ContactId& contact, Operations most, Vec3* force,
                                double* norm, double* apart, Operations* work) {
  std::int32_t own[kMostRowsOfAContact];
  const int count = matrix_->rows_of(contact, own);
  if (count == 0 || operations(of.system, contact) > most) return false;
  const std::int32_t rows = matrix_->rows().rows_end;
  double* const left = without_;
  forget();
  std::copy(left_of(of.reaction), left_of(of.reaction) + rows, left);
  const Operations taken = (2 * count + 2) * (Operations{rows} * rows) / kDense;
  *work += taken;
  // By the factor, where it has the rows of all contacts that are left, and their reactions meet all of their targets.
  met_ = !of.by_laws && factor_->exists() && (!matrix_->held().any_ended || ended_met_);
  if (met_ && !factor_->take_out(own, count, removal_, left)) return false;
  for (int k = 0; k < count; ++k) left[own[k]] = 0;
  // As much is left for the queries that read the prediction.
  *work += hold_others_to_laws(of, contact, (most - taken) / 2 * kDense) / kDense;
  last_ = contact;
  *norm = energy_norm(matrix_->rows(), left);
  for (std::int32_t row = 0; row < rows; ++row) change_[row] = left[row] - of.reaction[row];
  *apart = energy_norm(matrix_->rows(), change_);
  const HeldConstraints& held = matrix_->held();
  std::fill(force, force + held.node_count, Vec3{});
  spread_reactions(held.constraints, held.rows, held.count, held.nodes, left, force);
  return true;
}

// Returns the multiply-adds that it took. A constraint without rows takes no part.
std::int64_t ContactPrediction::hold_others_to_laws(const Solution& of, const ContactId& contact, std::int64_t most) {
  const HeldConstraints& held = matrix_->held();
  for (std::int32_t p = 0; p < held.count; ++p) {
    const bool is_gone = held.ended[p] || matrix_->is_of(p, contact);
    others_[p] = is_gone ? RowsOfConstraint{{-1, -1, -1}} : held.rows[p];
  }
  ContactSystem others = of.system;
  others.rows = others_;
  std::int64_t taken = 0;
  met_ = met_ && obeys_laws(others, without_);
  if (!met_ && most >= LawSolver::fewest_operations(others)) {
    laws_->solve(others, of.tolerance, most, without_);
    taken = laws_->effort().operations;
  } else if (!met_) {
    do {  // one sweep at least
      taken += operations_of_sweep(others);
    } while (sweep_contacts(others, without_) > 0 && taken < most);
  }
  return taken;
}

void ContactPrediction::end(const double* reaction, const ContactId& contact) {
  std::int32_t own[kMostRowsOfAContact];
  const int count = matrix_->rows_of(contact, own);
  const bool was_predicted = contact == last_;
  const double* const left = was_predicted ? without_ : left_of(reaction);
  if (left != without_ended_) std::copy(left, left + matrix_->rows().rows_end, without_ended_);
  for (int k = 0; k < count; ++k) without_ended_[own[k]] = 0;
  ended_met_ = was_predicted && met_;
  matrix_->end(contact);
  forget();
  if (!factor_->exists()) return;
  matrix_->retire(own, count);
  factor_->remove_rows();
}

}  // namespace palpate
