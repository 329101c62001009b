#include "runtime/world/islands.h"

#include <algorithm>

#include "runtime/contact/touch_solve.h"

namespace palpate {
namespace {

// The constraints between organs ask the body for nothing: their target is where its offset has them.
void ask_for_nothing(TouchState& organ) {
  const ContactConstraints& set = organ.rows.set();
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    if (!is_between_organs(set.constraints[p].id.contact)) continue;
    organ.rows.set_target(p, {});
    organ.rows.set_target(p, -1 * organ.offset.left_of_target(set, p));
  }
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
    TouchStep& of_organ = step.of_organ[members[m]];
    TouchState& own = *of_organ.state;
    ask_for_nothing(own);
    prepared = own.body->prepare(of_organ) && prepared;
    organ_[members[m]] = {own.body->system(own), of_organ.acting, own.force};
    *operations += own.work.left();
  }
  return prepared;
}

void Islands::solve_island(WorldStep& step, const std::int32_t* members, std::int32_t count) {
  Operations operations = 0;
  if (!prepare(step, members, count, &operations)) {
    for (std::int32_t m = 0; m < count; ++m)
      outcome_[members[m]] = step.touch(members[m]).body->fail(step.of_organ[members[m]]);
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
  set_reached(step, joint_count);
  for (std::int32_t m = 0; m < count; ++m)
    outcome_[members[m]] = step.touch(members[m]).body->take_reactions(step.of_organ[members[m]], joint_.effort());
}

// Returns whether the laws are met.
bool Islands::solve_slipping(WorldStep& step, const std::int32_t* members, std::int32_t count, std::int32_t joint_count,
                             Operations operations) {
  for (int solve = 1;;) {
    const bool met = joint_.solve(organ_, members, count, together_, joint_count, operations);
    step.sweeps += joint_.effort().sweeps + joint_.effort().newton_steps;
    bool again = follow(step, members, count, joint_count);
    if (!again && solve++ < kMostSlipSolves) {
      for (std::int32_t m = 0; m < count; ++m) again = sources_ask_again(step.of_organ[members[m]]) || again;
      for (std::int32_t s = 0; s < step.source_count; ++s) again = step.sources[s]->asks_again(step) || again;
    }
    if (!again) return met;
    // A body has moved, or a grasp that slips its targets.
    for (std::int32_t m = 0; m < count; ++m) {
      ask_for_nothing(step.touch(members[m]));
      step.touch(members[m]).body->aim(step.of_organ[members[m]]);
    }
  }
}

// Whether a body has gone on under the reactions.
bool Islands::follow(WorldStep& step, const std::int32_t* members, std::int32_t count, std::int32_t joint_count) {
  const auto takes_steps = [&](std::int32_t organ) { return step.touch(organ).body->takes_steps(); };
  if (std::any_of(members, members + count, takes_steps)) set_reached(step, joint_count);
  bool went = false;
  for (std::int32_t m = 0; m < count; ++m)
    went = step.touch(members[m]).body->follow(step.of_organ[members[m]]) || went;
  return went;
}

// To the organ alone, a constraint between organs is what the solution has made of it.
void Islands::set_reached(WorldStep& step, std::int32_t joint_count) {
  for (std::int32_t q = 0; q < joint_count; ++q) {
    JointConstraint& joint = *together_[q];
    joint.gap = step.missed(joint).x;
    for (int side = 0; side < 2; ++side) {
      const std::int32_t p = joint.constraint[side];
      if (p < 0) continue;
      TouchState& own = step.touch(joint.organ[side]);
      const Vec3 reached = own.body->reached(own, p);
      // A body that goes on beside the touch has no laws of its own between organs: the touch solves them anew in each step.
      if (!own.body->responds_linearly() && !own.body->takes_steps())
        own.rows.settle(p, !gives_way(joint.law, joint.friction, 0, joint.reaction).released);
      own.rows.set_target(p, {});
      own.rows.set_target(p, reached - own.offset.left_of_target(own.rows.set(), p));
    }
  }
}

}  // namespace palpate
