#include "runtime/world/islands.h"

#include <algorithm>

#include "runtime/contact/touch_solve.h"

namespace palpate {
namespace {

// The constraints of an organ, with what its offset leaves for the contacts.
const ContactConstraints& acting(TouchState& organ) {
  return organ.offset.acting(organ.rows.set());
}

}  // namespace

bool Islands::create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t count, std::int32_t most_joints) {
  std::int32_t rows = 3 * most_joints, constraints = most_joints, rows_of_organ = 0;
  for (std::int32_t k = 0; k < count; ++k) {
    const std::int32_t of_organ = organs[k]->touch.rows.set().constraint_capacity;
    rows += 3 * (of_organ - most_joints), constraints += of_organ - most_joints;
    rows_of_organ = std::max(rows_of_organ, 3 * of_organ);
  }
  joints_ = memory.array<JointConstraint>(static_cast<std::size_t>(most_joints));
  together_ = memory.array<JointConstraint*>(static_cast<std::size_t>(most_joints));
  return joint_.create(memory, count, rows_of_organ, rows, constraints);
}

void Islands::solve(WorldStep& step) {
  // Organs of one island get the number of the first one of them.
  std::int32_t label[PALPATE_MAX_ORGANS];
  for (std::int32_t k = 0; k < step.organ_count; ++k) label[k] = k, is_joint_[k] = false;
  const auto join = [&](std::int32_t a, std::int32_t b) {
    const std::int32_t one = label[a], other = label[b];
    for (std::int32_t k = 0; k < step.organ_count && one != other; ++k)
      if (label[k] == std::max(one, other)) label[k] = std::min(one, other);
  };
  for (std::int32_t i = 0; i < step.joint_count; ++i) {
    JointConstraint& joint = step.joints[i];
    if (is_held(joint)) {
      joint.gap -= joint.target.x;
      continue;
    }
    is_joint_[joint.organ[0]] = is_joint_[joint.organ[1]] = true;
    join(joint.organ[0], joint.organ[1]);
    if (joint.joined) join(joint.organ[0], step.joints[i - 1].organ[0]);
  }
  for (std::int32_t first = 0; first < step.organ_count; ++first) {
    std::int32_t members[PALPATE_MAX_ORGANS], count = 0;
    for (std::int32_t k = 0; k < step.organ_count; ++k)
      if (is_joint_[k] && label[k] == first) members[count++] = k;
    if (count > 0) solve_island(step, members, count);
  }
  for (std::int32_t k = 0; k < step.organ_count; ++k)
    step.solved[k] = !is_joint_[k] || outcome_[k] != ContactSolver::Outcome::unsolved;
}

bool Islands::prepare(WorldStep& step, const std::int32_t* members, std::int32_t count, Operations* operations) {
  bool prepared = true;
  for (std::int32_t m = 0; m < count; ++m) {
    TouchState& own = step.touch(members[m]);
    JointOrgan& organ = organ_[members[m]] = {&own.solver, &acting(own), own.force};
    prepared = own.solver.prepare(step.organs[members[m]]->context.tensors, *organ.set, &own.work) && prepared;
    *operations += own.work.left();
  }
  return prepared;
}

void Islands::solve_island(WorldStep& step, const std::int32_t* members, std::int32_t count) {
  Operations operations = 0;
  if (!prepare(step, members, count, &operations)) {
    for (std::int32_t m = 0; m < count; ++m) {
      TouchState& own = step.touch(members[m]);
      outcome_[members[m]] = own.solver.fail(own.rows.set(), own.force, own.modified);
    }
    step.flags |= PALPATE_STEP_UNSOLVED;
    return;
  }
  std::int32_t joint_count = 0;
  for (std::int32_t i = 0; i < step.joint_count; ++i) {
    JointConstraint& joint = step.joints[i];
    const bool is_here = std::find(members, members + count, joint.organ[0]) != members + count;
    if (is_here && !is_held(joint)) together_[joint_count++] = &joint;
  }
  if (!solve_slipping(step, members, count, joint_count, operations)) step.flags |= PALPATE_STEP_SOLVE_INEXACT;
  for (std::int32_t m = 0; m < count; ++m) take_reactions(step, members[m]);
  for (std::int32_t q = 0; q < joint_count; ++q) together_[q]->gap = step.missed(*together_[q]).x;
}

// Returns whether the laws are met.
bool Islands::solve_slipping(WorldStep& step, const std::int32_t* members, std::int32_t count, std::int32_t joint_count,
                             Operations operations) {
  for (int solve = 1;; ++solve) {
    const bool met = joint_.solve(organ_, members, count, together_, joint_count, operations);
    step.sweeps += joint_.effort().sweeps + joint_.effort().newton_steps;
    bool slips = false;
    for (std::int32_t m = 0; m < count && solve < kMostSlipSolves; ++m)
      slips = sources_ask_again(step.of_organ[members[m]]) || slips;
    for (std::int32_t s = 0; s < step.source_count && solve < kMostSlipSolves; ++s)
      slips = step.sources[s]->asks_again(step) || slips;
    if (!slips) return met;
    // A grasp that slips has moved its targets.
    for (std::int32_t m = 0; m < count; ++m) acting(step.touch(members[m]));
  }
}

// To the organ alone, a constraint between organs is what the solution has made of it.
void Islands::take_reactions(WorldStep& step, std::int32_t organ) {
  TouchState& own = step.touch(organ);
  const ContactConstraints& set = own.rows.set();
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    if (!is_between_organs(set.constraints[p].id.contact)) continue;
    own.rows.set_target(p, {});
    own.rows.set_target(p, own.solver.reached(p) - own.offset.left_of_target(set, p));
  }
  outcome_[organ] = own.solver.take_reactions(acting(own), joint_.effort(), own.force, own.modified);
}

}  // namespace palpate
