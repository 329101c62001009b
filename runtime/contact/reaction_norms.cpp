#include "runtime/contact/reaction_norms.h"

#include <algorithm>
#include <cmath>

#include "runtime/dense/dense_rows.h"

namespace palpate {
namespace {

// J: what reactions of constraint p do on its local part, which moves no node of the mesh.
double work_on_local(const ContactMatrix& matrix, const ContactConstraints& set, std::int32_t p,
                     const double* reaction) {
  double work = 0;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      if (const std::int32_t i = matrix.rows_of(p).at[a], j = matrix.rows_of(p).at[b]; i >= 0 && j >= 0)
        work += reaction[i] * set.constraints[p].local.m[a][b] * reaction[j];
  const std::int32_t row = matrix.rows_of(p).at[0], end = end_of_joined(set.constraints, set.constraint_count, p);
  for (std::int32_t q = p + 1; row >= 0 && q < end; ++q)
    work += reaction[row] * set.constraints[q].local.m[0][0] * reaction[row];
  return work;
}

// J, on the local part of a constraint: of its reactions, and of their change.
struct OnLocal {
  double reaction, change;
};
// The norms of constraint p alone. change: [rows] N, filled for its rows.
OnLocal measure_own(const ContactMatrix& matrix, const ContactConstraints& set, const SolvedReactions& solved,
                    std::int32_t p, double* change, ConstraintNorms* of) {
  *of = {};
  of->kept = matrix.is_kept(p) && !solved.again;
  const auto& rows = matrix.rows_of(p).at;
  for (const std::int32_t i : rows)
    if (i >= 0) change[i] = of->kept ? solved.reaction[i] - solved.last[i] : 0;
  double own = 0, own_change = 0;
  for (const std::int32_t i : rows)
    for (const std::int32_t j : rows) {
      if (i < 0 || j < 0) continue;
      own += solved.reaction[i] * matrix.rows().entry(i, j) * solved.reaction[j];
      own_change += change[i] * matrix.rows().entry(i, j) * change[j];
    }
  const OnLocal local = {work_on_local(matrix, set, p, solved.reaction), work_on_local(matrix, set, p, change)};
  of->own = std::sqrt(std::max(0.0, own - local.reaction));
  of->own_change = std::sqrt(std::max(0.0, own_change - local.change));
  return local;
}

}  // namespace

double energy_norm(const RowMatrix& matrix, const double* reaction) {
  const std::int32_t rows = matrix.rows_end;
  double energy = 0;
  for (std::int32_t row = 0; row < rows; ++row)
    if (reaction[row] != 0) energy += reaction[row] * dot_rows(rows, matrix.row(row), reaction);
  return std::sqrt(std::max(0.0, energy));
}

// The reactions do no more work on the tissue than their targets allow (law_solver.h), and the energy of their sum is no larger than
// the sum of theirs.
ReactionNorms bound_norms(const ContactMatrix& matrix, const ContactConstraints& set, const SolvedReactions& solved,
                          double* scratch, ConstraintNorms* each) {
  constexpr double rounding = 1e-6;
  ReactionNorms norms;
  double *const change = scratch, offered = 0, sum = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const OnLocal local = measure_own(matrix, set, solved, p, change, each + p);
    for (const std::int32_t i : matrix.rows_of(p).at)
      if (i >= 0) offered += (1 + rounding) * solved.reaction[i] * solved.target[i];
    // Else what discs share may be less than the sum of their parts, but not below 0.
    if (!matrix.couples()) offered -= local.reaction;
    sum += each[p].own;
  }
  norms.whole = std::min(std::sqrt(std::max(0.0, offered)), sum);
  norms.change_of_kept = INFINITY;
  norms.operations = 30 * Operations{set.constraint_count} / kDense;
  return norms;
}

ReactionNorms measure_norms(const ContactMatrix& matrix, const ContactConstraints& set, const SolvedReactions& solved,
                            double* scratch, ConstraintNorms* each) {
  ReactionNorms norms;
  double energy = 0, local_change = 0, *const change = scratch, *const between = scratch + matrix.rows().capacity;
  std::fill(change, change + matrix.rows().rows_end, 0.0);
  matrix.measure_between_discs(solved.reaction, between);
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const OnLocal local = measure_own(matrix, set, solved, p, change, each + p);
    for (int axis = 0; axis < 3; ++axis) {
      const std::int32_t i = matrix.rows_of(p).at[axis];
      if (i < 0) continue;
      each[p].displacement[axis] = dot_rows(matrix.rows().rows_end, matrix.rows().row(i), solved.reaction);
      each[p].work += solved.reaction[i] * (each[p].displacement[axis] - between[i]);
      each[p].displacement[axis] -= between[i];
      for (int other = 0; other < 3; ++other)
        if (const std::int32_t j = matrix.rows_of(p).at[other]; j >= 0)
          each[p].displacement[axis] -= set.constraints[p].local.m[axis][other] * solved.reaction[j];
    }
    each[p].work -= local.reaction, local_change += local.change;
    energy += each[p].work;
  }
  norms.whole = std::sqrt(std::max(0.0, energy));
  matrix.measure_between_discs(change, between);
  for (std::int32_t i = 0; i < matrix.rows().rows_end; ++i) local_change += change[i] * between[i];
  const double whole_change = energy_norm(matrix.rows(), change);
  norms.change_of_kept = std::sqrt(std::max(0.0, whole_change * whole_change - local_change));
  norms.operations = operations_to_measure(matrix);
  return norms;
}

Operations operations_to_measure(const ContactMatrix& matrix) {
  const Operations squared = Operations{matrix.rows().rows_end} * matrix.rows().rows_end, whole = 2 * squared / kDense;
  return matrix.couples() ? 2 * whole : whole;
}

}  // namespace palpate
