#include "runtime/world/joint_solver.h"

#include <algorithm>
#include <cmath>

#include "runtime/dense/dense_rows.h"

namespace palpate {

bool JointSolver::create(SceneMemory& memory, std::int32_t organ_count, std::int32_t rows_of_organ, std::int32_t rows,
                         std::int32_t constraints) {
  rows_of_organ_ = static_cast<std::size_t>(rows_of_organ);
  constraints_ = memory.array<ContactConstraint>(static_cast<std::size_t>(constraints));
  rows_ = memory.array<RowsOfConstraint>(static_cast<std::size_t>(constraints));
  row_of_ = memory.array<std::int32_t>(static_cast<std::size_t>(organ_count) * rows_of_organ_);
  list_ = memory.array<std::int32_t>(rows_of_organ_);
  return matrix_.create(memory, rows) && system_.create(memory, &matrix_, {0, kUnlimitedOperations, false}) &&
         !memory.failed();
}

void JointSolver::list_rows(const JointOrgan* organs, std::int32_t organ_count, const JointPair* pairs,
                            std::int32_t pair_count) {
  matrix_.rows_end = constraint_count_ = 0;
  double *const target = system_.targets(), *const reaction = system_.reactions();
  const auto take_row = [&](double of_target, double of_reaction) {
    target[matrix_.rows_end] = of_target, reaction[matrix_.rows_end] = of_reaction;
    return matrix_.rows_end++;
  };
  for (std::int32_t o = 0; o < organ_count; ++o) {
    const ContactSolver& solver = *organs[o].solver;
    const ContactConstraints& set = *organs[o].set;
    std::fill(row_of(o), row_of(o) + solver.matrix().rows().rows_end, -1);
    for (std::int32_t p = 0; p < set.constraint_count && !is_between_organs(set.constraints[p].id.contact); ++p) {
      const Vec3 aim = target_of_rows(set, p);
      constraints_[constraint_count_] = set.constraints[p];
      RowsOfConstraint& rows = rows_[constraint_count_++] = {{-1, -1, -1}};
      for (int i = 0; i < 3; ++i)
        if (const std::int32_t row = solver.matrix().rows_of(p).at[i]; row >= 0)
          rows.at[i] = row_of(o)[row] = take_row(aim[i], solver.system().reactions()[row]);
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
    if (first->at[0] < 0) {
      first->at[0] = matrix_.rows_end++;
      system_.targets()[first->at[0]] = system_.reactions()[first->at[0]] = 0;
    }
    row_of(pair.organ[side])[row] = first->at[0];
  }
  if (first->at[0] >= 0) system_.targets()[first->at[0]] += pair.target.x;
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
        own += solver.matrix().rows().row(of_organ)[of_organ];
    }
    matrix_.entry(row, row) = std::max(matrix_.entry(row, row), kLeastOfJoined * own);
  }
}

void JointSolver::sum_matrices(const JointOrgan* organs, std::int32_t organ_count, const JointPair* pairs,
                               std::int32_t pair_count) {
  const std::int32_t rows_end = matrix_.rows_end;
  for (std::int32_t i = 0; i < rows_end; ++i) std::fill(matrix_.row(i), matrix_.row(i) + rows_end, 0.0);
  for (std::int32_t o = 0; o < organ_count; ++o) {
    const std::int32_t* const to = row_of(o);
    std::int32_t used = 0;
    for (std::int32_t row = 0; row < organs[o].solver->matrix().rows().rows_end; ++row)
      if (to[row] >= 0) list_[used++] = row;
    for (std::int32_t i = 0; i < used; ++i) {
      const double* const from = organs[o].solver->matrix().rows().row(list_[i]);
      double* const sum = matrix_.row(to[list_[i]]);
      for (std::int32_t j = 0; j < used; ++j) sum[to[list_[j]]] += from[list_[j]];
    }
  }
  for (std::int32_t q = 0; q < pair_count; ++q)
    for (const std::int32_t row : rows_[constraint_count_ - pair_count + q].at)
      if (row >= 0) matrix_.entry(row, row) *= 1 + pairs[q].give;
  bound_joined(organs, pairs, pair_count);
}

void JointSolver::set_reactions() {
  for (std::int32_t o = 0; o < organ_count_; ++o)
    for (std::int32_t row = 0; row < organs_[o].solver->matrix().rows().rows_end; ++row)
      if (const std::int32_t joint = row_of(o)[row]; joint >= 0)
        organs_[o].solver->system().set_reaction(row, system_.reactions()[joint], system_.coarse()[joint]);
}

double JointSolver::farthest(Operations kept, StepWork* work) {
  set_reactions();
  double most = 0;
  for (std::int32_t o = 0; o < organ_count_; ++o) {
    const auto& [solver, set, force] = organs_[o];
    const Operations cost = 9 * Operations{set->node_count} * set->node_count / kDense;
    if (cost + kept > work->left()) return -1;
    work->add(cost);
    most = std::max(most, solver->matrix().largest_displacement(*set, solver->system().reactions(), force));
  }
  return most;
}

class JointSolver::Nodes final : public NodesOfRows {
 public:
  explicit Nodes(JointSolver& of) : of_(of) {}
  double farthest(const double*, Operations kept, StepWork* work) override { return of_.farthest(kept, work); }

 private:
  JointSolver& of_;
};

bool JointSolver::solve(const JointOrgan* organs, std::int32_t organ_count, JointPair* pairs, std::int32_t pair_count,
                        Operations operations) {
  organs_ = organs, organ_count_ = organ_count;
  list_rows(organs, organ_count, pairs, pair_count);
  sum_matrices(organs, organ_count, pairs, pair_count);
  for (std::int32_t i = 0; i < matrix_.rows_end; ++i) matrix_.scale[i] = 1 / std::sqrt(matrix_.entry(i, i));
  StepWork work;
  work.create(operations);
  work.begin();
  system_.begin({constraints_, rows_, constraint_count_});
  Nodes nodes(*this);
  system_.solve(nodes, &work);
  set_reactions();
  bool is_met = true;
  for (std::int32_t c = 0; c < constraint_count_; ++c) is_met = is_met && !system_.doubt_of(c).inexact;
  for (std::int32_t q = 0; q < pair_count; ++q) {
    if (pairs[q].joined) {
      pairs[q].reaction = pairs[q - 1].reaction;
      continue;
    }
    const RowsOfConstraint& rows = rows_[constraint_count_ - pair_count + q];
    for (int i = 0; i < 3; ++i) pairs[q].reaction[i] = rows.at[i] < 0 ? 0 : system_.reactions()[rows.at[i]];
  }
  return is_met;
}

}  // namespace palpate
