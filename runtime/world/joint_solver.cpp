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

std::int32_t JointSolver::take_row(double target, double reaction) {
  system_.targets()[matrix_.rows_end] = target, system_.reactions()[matrix_.rows_end] = reaction;
  return matrix_.rows_end++;
}

void JointSolver::list_rows_of_organs() {
  matrix_.rows_end = constraint_count_ = 0;
  for (std::int32_t m = 0; m < member_count_; ++m) {
    const std::int32_t o = members_[m];
    const BodySystem& body = organs_[o].body;
    const ContactConstraints& set = *organs_[o].set;
    std::fill(row_of(o), row_of(o) + matrix_of(o).rows_end, -1);
    for (std::int32_t p = 0; p < set.constraint_count && !is_between_organs(set.constraints[p].id.contact); ++p) {
      constraints_[constraint_count_] = set.constraints[p];
      RowsOfConstraint& rows = rows_[constraint_count_++] = {{-1, -1, -1}};
      for (int i = 0; i < 3; ++i)
        if (const std::int32_t row = body.rows_of[p].at[i]; row >= 0)
          rows.at[i] = row_of(o)[row] = take_row(body.system->targets()[row], body.system->reactions()[row]);
    }
  }
}

// Row i of the constraint that a joint has on one side, in that organ; -1: none.
std::int32_t JointSolver::row_of_side(const JointConstraint& joint, int side, int i) const {
  const std::int32_t p = joint.constraint[side];
  return p < 0 ? -1 : organs_[joint.organ[side]].body.rows_of[p].at[i];
}

// m, of row i of a joint: bodies that stand elsewhere without reactions leave less of its target.
double JointSolver::left_of_target(const JointConstraint& joint, int i) const {
  double left = joint.target[i];
  for (int side = 0; side < 2; ++side)
    if (const std::int32_t row = row_of_side(joint, side, i); row >= 0)
      left += organs_[joint.organ[side]].body.system->targets()[row];
  return left;
}

// The row of a joint that is joined is that of the first one.
void JointSolver::list_rows_of_joints() {
  RowsOfConstraint* rows = nullptr;
  for (std::int32_t q = 0; q < joint_count_; ++q) {
    const JointConstraint& joint = *joints_[q];
    ContactConstraint& constraint = constraints_[constraint_count_] = ContactConstraint{};
    constraint.law = joint.law, constraint.friction = joint.friction, constraint.share = 1;
    const bool one_row = joint.law == ContactLaw::unilateral || joint.law == ContactLaw::sliding;
    constraint.axes = one_row ? 1 : 7, constraint.framed = true, constraint.joined = joint.joined;
    rows_[constraint_count_] = {{-1, -1, -1}};
    if (!joint.joined) rows = rows_ + constraint_count_;
    ++constraint_count_;
    for (int i = 0; i < (joint.joined ? 1 : 3); ++i)
      for (int side = 0; side < 2; ++side) {
        const std::int32_t row = row_of_side(joint, side, i);
        if (row < 0) continue;
        if (rows->at[i] < 0)
          rows->at[i] = joint.joined ? take_row(0, 0) : take_row(left_of_target(joint, i), joint.reaction[i]);
        row_of(joint.organ[side])[row] = rows->at[i];
      }
    if (joint.joined && rows->at[0] >= 0) system_.targets()[rows->at[0]] += left_of_target(joint, 0);
  }
}

// A row that several joints share has no less than a share of the largest compliance of one of them alone.
void JointSolver::bound_joined() {
  const std::int32_t first = constraint_count_ - joint_count_;
  for (std::int32_t q = 0, leads = 0; q < joint_count_; ++q) {
    if (!joints_[q]->joined) leads = q;
    const std::int32_t row = rows_[first + leads].at[0];
    if (row < 0 || end_of_joined(constraints_, constraint_count_, first + leads) == first + leads + 1) continue;
    double own = 0;
    for (int side = 0; side < 2; ++side)
      if (const std::int32_t of_organ = row_of_side(*joints_[q], side, 0); of_organ >= 0)
        own += matrix_of(joints_[q]->organ[side]).row(of_organ)[of_organ];
    matrix_.entry(row, row) = std::max(matrix_.entry(row, row), kLeastOfJoined * own);
  }
}

void JointSolver::sum_matrices() {
  const std::int32_t rows_end = matrix_.rows_end;
  for (std::int32_t i = 0; i < rows_end; ++i) std::fill(matrix_.row(i), matrix_.row(i) + rows_end, 0.0);
  for (std::int32_t m = 0; m < member_count_; ++m) {
    const RowMatrix& of_organ = matrix_of(members_[m]);
    const std::int32_t* const to = row_of(members_[m]);
    std::int32_t used = 0;
    for (std::int32_t row = 0; row < of_organ.rows_end; ++row)
      if (to[row] >= 0) list_[used++] = row;
    for (std::int32_t i = 0; i < used; ++i) {
      const double* const from = of_organ.row(list_[i]);
      double* const sum = matrix_.row(to[list_[i]]);
      for (std::int32_t j = 0; j < used; ++j) sum[to[list_[j]]] += from[list_[j]];
    }
  }
  for (std::int32_t q = 0; q < joint_count_; ++q)
    for (const std::int32_t row : rows_[constraint_count_ - joint_count_ + q].at)
      if (row >= 0) matrix_.entry(row, row) *= 1 + joints_[q]->give;
  bound_joined();
}

void JointSolver::set_reactions() {
  for (std::int32_t m = 0; m < member_count_; ++m)
    for (std::int32_t row = 0; row < matrix_of(members_[m]).rows_end; ++row)
      if (const std::int32_t joint = row_of(members_[m])[row]; joint >= 0)
        organs_[members_[m]].body.system->set_reaction(row, system_.reactions()[joint], system_.coarse()[joint]);
}

double JointSolver::farthest(Operations kept, StepWork* work) {
  set_reactions();
  double most = 0;
  for (std::int32_t m = 0; m < member_count_; ++m) {
    const auto& [body, set, force] = organs_[members_[m]];
    if (!body.nodes) continue;
    const double moved = body.nodes->largest_displacement(*set, body.system->reactions(), force, kept, work);
    if (moved < 0) return -1;
    most = std::max(most, moved);
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

bool JointSolver::solve(const JointOrgan* organs, const std::int32_t* members, std::int32_t member_count,
                        JointConstraint* const* joints, std::int32_t joint_count, Operations operations) {
  organs_ = organs, members_ = members, member_count_ = member_count, joints_ = joints, joint_count_ = joint_count;
  list_rows_of_organs();
  list_rows_of_joints();
  sum_matrices();
  for (std::int32_t i = 0; i < matrix_.rows_end; ++i) matrix_.scale[i] = 1 / std::sqrt(matrix_.entry(i, i));
  StepWork work;
  work.create(operations);
  work.begin();
  system_.begin({constraints_, rows_, constraint_count_});
  Nodes nodes(*this);
  system_.solve(nodes, &work);
  set_reactions();
  // Where vertices of two organs lie on one another, their pairs say the same, and laws end slowly.
  constexpr double least_miss = 1e-7;  // m
  bool is_met = true;
  for (std::int32_t c = 0; c < constraint_count_; ++c) is_met = is_met && !system_.doubt_of(c).inexact;
  is_met = is_met || system_.residual().displacement <= least_miss;
  for (std::int32_t q = 0; q < joint_count_; ++q) {
    JointConstraint& joint = *joints[q];
    const RowsOfConstraint& rows = rows_[constraint_count_ - joint_count_ + q];
    for (int i = 0; i < 3; ++i) joint.reaction[i] = rows.at[i] < 0 ? 0 : system_.reactions()[rows.at[i]];
    if (joint.joined) joint.reaction = joints[q - 1]->reaction;
  }
  return is_met;
}

}  // namespace palpate
