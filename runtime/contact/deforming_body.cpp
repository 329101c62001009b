#include "runtime/contact/deforming_body.h"

#include <algorithm>

namespace palpate {
namespace {

// Of an evaluation, for each tetrahedron; and of a solve, numbers of the factor for one operation.
constexpr Operations kOfATetrahedron = 12, kFactorNumbers = 6;

}  // namespace

LargeSolver::Created DeformingBody::create(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* order,
                                           std::int32_t order_count, std::int32_t node_capacity,
                                           std::int32_t constraint_capacity) {
  const auto rows = 3 * static_cast<std::size_t>(constraint_capacity), nodes = static_cast<std::size_t>(node_capacity);
  rows_ = memory.array<LargeRow>(rows), force_ = memory.array<double>(rows);
  nodes_ = memory.array<std::int32_t>(nodes), weights_ = memory.array<double>(nodes);
  if (memory.failed()) return LargeSolver::Created::no_memory;
  // The rows of a constraint share its nodes.
  const LargeSolver::Created created =
      solver_.create(memory, body, order, order_count, 3 * constraint_capacity, 3 * node_capacity);
  operations_ = kOfATetrahedron * body.tetrahedron_count + solver_.factor().numbers() / kFactorNumbers;
  return created;
}

std::int32_t DeformingBody::add_rows(const ContactConstraint& constraint, Vec3 target, std::int32_t count) {
  const std::int32_t group = count;
  int axis_of[3] = {}, imposed = 0;
  for (int axis = 0; axis < 3; ++axis)
    if (constraint.axes >> axis & 1u) axis_of[imposed++] = axis;
  for (int i = 0; i < imposed; ++i, ++count) {
    LargeRow& row = rows_[count];
    row = LargeRow{};
    row.first = constraint.first_node, row.count = constraint.node_count;
    row.group = group, row.target = target[axis_of[i]];
    for (int d = 0; d < 3; ++d)
      row.direction[d] = constraint.framed ? constraint.frame.m[axis_of[i]][d] : (d == axis_of[i] ? 1.0 : 0.0);
    for (int k = 0; k < imposed; ++k) row.compliance[k] = constraint.local.m[axis_of[i]][axis_of[k]];
  }
  return count;
}

LargeOutcome DeformingBody::solve(const ContactConstraints& set, StepWork* work, Vec3* force) {
  for (std::int32_t e = 0; e < set.node_count; ++e)
    nodes_[e] = set.nodes[e].node, weights_[e] = set.nodes[e].weight, force[e] = Vec3{};
  std::int32_t count = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) count = add_rows(set.constraints[p], set.target[p], count);
  const Operations fit = work->left() / std::max<Operations>(operations_, 1);
  const auto most = static_cast<std::int32_t>(std::clamp<Operations>(fit, 1, LargeSolver::kMostSteps));
  const LargeOutcome outcome = solver_.step({rows_, nodes_, weights_, count}, most, force_);
  work->add(operations_ * outcome.evaluations);
  for (std::int32_t r = 0; r < count; ++r)
    for (std::int32_t e = rows_[r].first; e < rows_[r].first + rows_[r].count; ++e)
      for (int d = 0; d < 3; ++d) force[e][d] += force_[r] * weights_[e] * rows_[r].direction[d];
  return outcome;
}

}  // namespace palpate
