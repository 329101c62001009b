#include "runtime/contact/reaction_limit.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// m, along the axis along which a contact node moves most; the square of a length of 1e-290 m would be zero. force: [node_count],
// overwritten.
double largest_displacement(const ContactMatrix& matrix, const ContactConstraints& set, const double* reaction,
                            Vec3* force) {
  std::fill(force, force + set.node_count, Vec3{});
  spread_reactions(set.constraints, matrix.rows(), set.constraint_count, set.nodes, reaction, force);
  double most = 0;
  for (std::int32_t e = 0; e < set.node_count; ++e) {
    const Vec3 u = matrix.displacement(set, force, e);
    most = std::max({most, std::fabs(u.x), std::fabs(u.y), std::fabs(u.z)});
  }
  return most;
}

}  // namespace

bool ReactionLimit::create(SceneMemory& memory, const ContactMatrix* matrix) {
  matrix_ = matrix;
  most_ = memory.array<double>(static_cast<std::size_t>(matrix->capacity()));
  return !memory.failed();
}

void ReactionLimit::set(const ContactConstraint* constraints, std::int32_t count, double most_target) {
  most_target_ = most_target;
  std::fill(most_, most_ + matrix_->rows_end(), INFINITY);
  if (std::none_of(constraints, constraints + count, may_give_way)) return;
  for (std::int32_t p = 0; p < count; ++p) {
    if (!may_give_way(constraints[p])) continue;
    for (const std::int32_t row : matrix_->rows_of(p).at)
      if (row >= 0) most_[row] = kMostForce * most_target_ * matrix_->scale(row) * matrix_->scale(row);
  }
}

// The largest reaction over the force that its row alone would need for the largest target; kMostForce where none exceeds it, as a
// rule: all rows are asked that first, without a branch.
double ReactionLimit::largest_share(Rows rows, const double* reaction) const {
  const std::int32_t rows_end = matrix_->rows_end();
  const auto exceeds = [&](std::int32_t row, double share) {
    return (matrix_->scale(row) != 0) & (std::fabs(reaction[row]) > share * alone(row));
  };
  bool any = false;
  for (std::int32_t row = 0; row < rows_end; ++row) any |= exceeds(row, kMostForce);
  double most = kMostForce;
  for (std::int32_t row = 0; row < rows_end && any; ++row)
    if (covers(rows, row) && exceeds(row, most)) most = std::fabs(reaction[row]) / alone(row);
  return most;
}

double ReactionLimit::exceeded(Rows rows, const ContactConstraints& set, const double* reaction, Operations kept,
                               Vec3* force, StepWork* work) const {
  const double share = largest_share(rows, reaction);
  if (!(share > kMostForce)) return 0;
  const Operations cost = 9 * Operations{set.node_count} * set.node_count / kDense;
  if (cost + kept > work->left()) return kMostForce;
  work->add(cost);
  const double thrown = largest_displacement(*matrix_, set, reaction, force) / most_target_,
               most = std::clamp(kMostForceNear / thrown, kMostForce, kMostForceNear);
  return share > most ? most : 0;
}

void ReactionLimit::go_within(Rows rows, double most, const double* soft, double* reaction) const {
  const std::int32_t rows_end = matrix_->rows_end();
  const double within = 1 / std::max(1.0, largest_share(rows, soft) / most);
  double way = 1;
  for (std::int32_t row = 0; row < rows_end; ++row) {
    const double scale = matrix_->scale(row), from = within * soft[row], whole = reaction[row] - from,
                 room = most * most_target_ * scale * scale - (whole > 0 ? from : -from);
    if (scale != 0 && covers(rows, row) && std::fabs(whole) * way > room) way = std::max(0.0, room / std::fabs(whole));
  }
  for (std::int32_t row = 0; row < rows_end; ++row) {
    const double from = within * soft[row];
    if (matrix_->scale(row) != 0) reaction[row] = from + way * (reaction[row] - from);
  }
}

}  // namespace palpate
