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
  for (double** array : {&soft_, &target_, &scale_, &reaction_, &coarse_, &met_}) *array = memory.array<double>(all);
  constraints_ = memory.array<ContactConstraint>(static_cast<std::size_t>(constraints));
  rows_ = memory.array<RowsOfConstraint>(static_cast<std::size_t>(constraints));
  row_of_ = memory.array<std::int32_t>(static_cast<std::size_t>(organ_count) * rows_of_organ_);
  list_ = memory.array<std::int32_t>(rows_of_organ_);
  return laws_.create(memory, rows) && limit_.create(memory, rows) && !memory.failed();
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

void JointSolver::set_reactions(const JointOrgan* organs, std::int32_t organ_count) {
  for (std::int32_t o = 0; o < organ_count; ++o)
    for (std::int32_t row = 0; row < organs[o].solver->matrix().rows_end(); ++row)
      if (const std::int32_t joint = row_of(o)[row]; joint >= 0)
        organs[o].solver->set_reaction(row, reaction_[joint], coarse_[joint]);
}

// Where rows that do not give way contradict one another, as clips from one place to two (ContactSolver::limit_grips()).
void JointSolver::limit(const JointOrgan* organs, std::int32_t organ_count, const ContactSystem& system, double largest,
                        std::int64_t operations) {
  constexpr auto beside = ReactionLimit::Rows::beside_laws;
  std::int64_t left = operations - effort_.operations;
  const double most = limit_.exceeded(beside, reaction_, [&] {
    double thrown = 0;
    for (std::int32_t o = 0; o < organ_count; ++o) {
      const std::int64_t nodes = organs[o].set->node_count;
      if (left < 9 * nodes * nodes) return -1.0;
      left -= 9 * nodes * nodes;
      thrown = std::max(thrown, organs[o].solver->largest_displacement(*organs[o].set, organs[o].force));
    }
    return thrown;
  });
  if (most == 0) return;
  for (std::int32_t i = 0; i < rows_end_; ++i)
    if (limit_.covers(beside, i)) soft_[i] = ContactFactor::kSoftShift * entry(i, i);
  std::copy(reaction_, reaction_ + rows_end_, met_);
  if (left >= LawSolver::fewest_operations(system)) {
    std::fill(reaction_, reaction_ + rows_end_, 0.0);
    laws_.solve_without_shift(system, kSettled * largest, ContactSolver::kMet * largest, ContactFactor::kSoftSolves,
                              left, reaction_, coarse_);
  } else {
    std::fill(reaction_, reaction_ + rows_end_, 0.0);
  }
  std::swap(reaction_, met_);
  limit_.go_within(beside, most, met_, reaction_);
  std::copy(reaction_, reaction_ + rows_end_, coarse_);
}

bool JointSolver::solve(const JointOrgan* organs, std::int32_t organ_count, JointPair* pairs, std::int32_t pair_count,
                        std::int64_t operations) {
  list_rows(organs, organ_count, pairs, pair_count);
  sum_matrices(organs, organ_count, pairs, pair_count);
  double largest = 0;
  for (std::int32_t i = 0; i < rows_end_; ++i) largest = std::max(largest, std::fabs(target_[i]));
  ContactSystem system;
  system.matrix = matrix_, system.stride = stride_, system.rows_end = rows_end_;
  system.soft = soft_, system.target = target_, system.most = limit_.of_laws();
  system.constraints = constraints_, system.rows = rows_, system.constraint_count = constraint_count_;
  for (std::int32_t i = 0; i < rows_end_; ++i) {
    scale_[i] = 1 / std::sqrt(entry(i, i));
    soft_[i] = ContactFactor::kShift * entry(i, i);
  }
  limit_.set(scale_, rows_end_, constraints_, rows_, constraint_count_, largest);
  const double met = ContactSolver::kMet * largest + ContactSolver::kLeastMiss;
  const bool is_met = laws_.solve_without_shift(system, kSettled * largest, met, ContactFactor::kMostSolves, operations,
                                                reaction_, coarse_) <= met;
  effort_ = laws_.effort();
  set_reactions(organs, organ_count);
  limit(organs, organ_count, system, largest, operations);
  set_reactions(organs, organ_count);
  effort_.sweeps = std::max(1, effort_.sweeps);  // laws have decided
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
