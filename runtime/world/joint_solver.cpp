#include "runtime/world/joint_solver.h"

#include <algorithm>
#include <cmath>

#include "runtime/dense/dense_rows.h"

namespace palpate {
namespace {

// The solver ends where it misses the laws by this share of the largest target.
constexpr double kSettled = 1e-10;

}  // namespace

bool JointSolver::create(SceneMemory& memory, std::int32_t organ_count, std::int32_t rows_of_organ, std::int32_t rows,
                         std::int32_t constraints) {
  const auto all = static_cast<std::size_t>(rows);
  rows_of_organ_ = static_cast<std::size_t>(rows_of_organ);
  stride_ = odd_lines(all);
  matrix_ = memory.array<double>(all * stride_);
  for (double** array : {&soft_, &target_, &most_, &reaction_, &coarse_, &before_}) *array = memory.array<double>(all);
  constraints_ = memory.array<ContactConstraint>(static_cast<std::size_t>(constraints));
  rows_ = memory.array<RowsOfConstraint>(static_cast<std::size_t>(constraints));
  row_of_ = memory.array<std::int32_t>(static_cast<std::size_t>(organ_count) * rows_of_organ_);
  list_ = memory.array<std::int32_t>(rows_of_organ_);
  return laws_.create(memory, rows) && !memory.failed();
}

void JointSolver::list_rows(const JointOrgan* organs, std::int32_t organ_count, const JointPair* pairs,
                            std::int32_t pair_count) {
  rows_end_ = constraint_count_ = 0;
  const auto take_row = [&](double target, double reaction) {
    target_[rows_end_] = target, reaction_[rows_end_] = reaction;
    return rows_end_++;
  };
  for (std::int32_t o = 0; o < organ_count; ++o) {
    const ContactSolver& solver = *organs[o].solver;
    const ContactConstraints& set = *organs[o].set;
    std::fill(row_of(o), row_of(o) + solver.matrix().rows_end(), -1);
    for (std::int32_t p = 0; p < set.constraint_count && set.constraints[p].id.contact.source < ContactSource::pair;
         ++p) {
      const Vec3 target = target_of_rows(set, p);
      constraints_[constraint_count_] = set.constraints[p];
      RowsOfConstraint& rows = rows_[constraint_count_++] = {{-1, -1, -1}};
      for (int i = 0; i < 3; ++i)
        if (const std::int32_t row = solver.matrix().rows_of(p).at[i]; row >= 0)
          rows.at[i] = row_of(o)[row] = take_row(target[i], solver.reaction_of(row));
    }
  }
  RowsOfConstraint* first = nullptr;
  for (std::int32_t q = 0; q < pair_count; ++q) {
    const JointPair& pair = pairs[q];
    ContactConstraint& constraint = constraints_[constraint_count_] = ContactConstraint{};
    constraint.law = pair.law, constraint.friction = pair.friction, constraint.share = 1;
    const bool one_row = pair.law == ContactLaw::unilateral || pair.law == ContactLaw::sliding;
    constraint.axes = one_row ? 1 : 7, constraint.framed = true, constraint.joined = pair.joined;
    RowsOfConstraint& rows = rows_[constraint_count_++] = {{-1, -1, -1}};
    if (pair.joined) {
      join_row(organs, pair, first);
      continue;
    }
    first = &rows;
    for (int i = 0; i < 3; ++i)
      for (int side = 0; side < 2; ++side) {
        if (pair.constraint[side] < 0) continue;
        const std::int32_t row = organs[pair.organ[side]].solver->matrix().rows_of(pair.constraint[side]).at[i];
        if (row < 0) continue;
        if (rows.at[i] < 0) rows.at[i] = take_row(pair.target[i], pair.reaction[i]);
        row_of(pair.organ[side])[row] = rows.at[i];
      }
  }
}

// The rows of a pair that is joined are that of the first one.
void JointSolver::join_row(const JointOrgan* organs, const JointPair& pair, RowsOfConstraint* first) {
  for (int side = 0; side < 2; ++side) {
    if (pair.constraint[side] < 0) continue;
    const std::int32_t row = organs[pair.organ[side]].solver->matrix().rows_of(pair.constraint[side]).at[0];
    if (row < 0) continue;
    if (first->at[0] < 0) target_[rows_end_] = reaction_[rows_end_] = 0, first->at[0] = rows_end_++;
    row_of(pair.organ[side])[row] = first->at[0];
  }
  if (first->at[0] >= 0) target_[first->at[0]] += pair.target.x;
}

// A row that several pairs share has no less than a share of the largest compliance of one of them alone.
void JointSolver::bound_joined(const JointOrgan* organs, const JointPair* pairs, std::int32_t pair_count) {
  const std::int32_t first = constraint_count_ - pair_count;
  for (std::int32_t q = 0, leads = 0; q < pair_count; ++q) {
    if (!pairs[q].joined) leads = q;
    const std::int32_t row = rows_[first + leads].at[0];
    if (row < 0 || end_of_joined(constraints_, constraint_count_, first + leads) == first + leads + 1) continue;
    double own = 0;
    for (int side = 0; side < 2; ++side) {
      if (pairs[q].constraint[side] < 0) continue;
      const ContactSolver& solver = *organs[pairs[q].organ[side]].solver;
      if (const std::int32_t of_organ = solver.matrix().rows_of(pairs[q].constraint[side]).at[0]; of_organ >= 0)
        own += solver.matrix().row(of_organ)[of_organ];
    }
    entry(row, row) = std::max(entry(row, row), kLeastOfJoined * own);
  }
}

void JointSolver::sum_matrices(const JointOrgan* organs, std::int32_t organ_count, const JointPair* pairs,
                               std::int32_t pair_count) {
  for (std::int32_t i = 0; i < rows_end_; ++i) std::fill(&entry(i, 0), &entry(i, 0) + rows_end_, 0.0);
  for (std::int32_t o = 0; o < organ_count; ++o) {
    const std::int32_t* const to = row_of(o);
    std::int32_t used = 0;
    for (std::int32_t row = 0; row < organs[o].solver->matrix().rows_end(); ++row)
      if (to[row] >= 0) list_[used++] = row;
    for (std::int32_t i = 0; i < used; ++i) {
      const double* const from = organs[o].solver->matrix().row(list_[i]);
      double* const sum = &entry(to[list_[i]], 0);
      for (std::int32_t j = 0; j < used; ++j) sum[to[list_[j]]] += from[list_[j]];
    }
  }
  for (std::int32_t q = 0; q < pair_count; ++q)
    for (const std::int32_t row : rows_[constraint_count_ - pair_count + q].at)
      if (row >= 0) entry(row, row) *= 1 + pairs[q].give;
  bound_joined(organs, pairs, pair_count);
}

// As ContactSolver does: where rows that do not give way contradict one another, as clips from one place to two, a second solution in which
// these rows are soft is bounded. The answer is on the line between the two, as near to the first one as the limit of the forces allows.
void JointSolver::limit(const ContactSystem& system, double largest, std::int64_t operations) {
  const auto most = [&](std::int32_t i) { return ReactionLimit::kMostForceNear * largest / entry(i, i); };
  const auto is_limited = [&](std::int32_t i) { return !std::isfinite(most_[i]); };
  bool within = true;
  for (std::int32_t i = 0; i < rows_end_; ++i)
    within = within && (!is_limited(i) || std::fabs(reaction_[i]) <= most(i));
  const std::int64_t left = operations - effort_.operations;
  if (within || left < LawSolver::fewest_operations(system)) return;
  std::copy(reaction_, reaction_ + rows_end_, before_);
  for (std::int32_t i = 0; i < rows_end_; ++i)
    if (is_limited(i)) soft_[i] = ContactFactor::kSoftShift * entry(i, i), reaction_[i] = 0;
  laws_.solve(system, kSettled * largest, left, reaction_);
  double share = 1;
  for (std::int32_t i = 0; i < rows_end_; ++i)
    if (const double sharp = std::fabs(before_[i]), soft = std::fabs(reaction_[i]);
        is_limited(i) && sharp > most(i) && sharp > soft)
      share = std::min(share, std::max(0.0, (most(i) - soft) / (sharp - soft)));
  for (std::int32_t i = 0; i < rows_end_; ++i)
    coarse_[i] = reaction_[i] = reaction_[i] + share * (before_[i] - reaction_[i]);
}

bool JointSolver::solve(const JointOrgan* organs, std::int32_t organ_count, JointPair* pairs, std::int32_t pair_count,
                        std::int64_t operations) {
  list_rows(organs, organ_count, pairs, pair_count);
  sum_matrices(organs, organ_count, pairs, pair_count);
  double largest = 0;
  for (std::int32_t i = 0; i < rows_end_; ++i) largest = std::max(largest, std::fabs(target_[i]));
  ContactSystem system;
  system.matrix = matrix_, system.stride = stride_, system.rows_end = rows_end_;
  system.soft = soft_, system.target = target_, system.most = most_;
  system.constraints = constraints_, system.rows = rows_, system.constraint_count = constraint_count_;
  for (std::int32_t c = 0; c < constraint_count_; ++c) {
    const bool gives_way = may_give_way(constraints_[c]);
    for (const std::int32_t row : rows_[c].at) {
      if (row < 0) continue;
      soft_[row] = ContactFactor::kShift * entry(row, row);
      most_[row] = gives_way ? ReactionLimit::kMostForce * largest / entry(row, row) : INFINITY;
    }
  }
  const double met = ContactSolver::kMet * largest + ContactSolver::kLeastMiss;
  const bool is_met = laws_.solve_without_shift(system, kSettled * largest, met, ContactFactor::kMostSolves, operations,
                                                reaction_, coarse_) <= met;
  effort_ = laws_.effort();
  limit(system, largest, operations);
  effort_.sweeps = std::max(1, effort_.sweeps);  // laws have decided
  for (std::int32_t o = 0; o < organ_count; ++o)
    for (std::int32_t row = 0; row < organs[o].solver->matrix().rows_end(); ++row)
      if (const std::int32_t joint = row_of(o)[row]; joint >= 0)
        organs[o].solver->set_reaction(row, reaction_[joint], coarse_[joint]);
  for (std::int32_t q = 0; q < pair_count; ++q) {
    if (pairs[q].joined) {
      pairs[q].reaction = pairs[q - 1].reaction;
      continue;
    }
    const RowsOfConstraint& rows = rows_[constraint_count_ - pair_count + q];
    for (int i = 0; i < 3; ++i) pairs[q].reaction[i] = rows.at[i] < 0 ? 0 : reaction_[rows.at[i]];
  }
  return is_met;
}

}  // namespace palpate
