// The organs of a world that constraints between them join, directly or through others: each such island is solved as one.
#pragma once

#include <cstdint>

#include "runtime/world/world_step.h"

namespace palpate {

class Islands {
 public:
  // organs: [count], borrowed. most_joints: constraints between organs that a step may have.
  bool create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t count, std::int32_t most_joints);

  // When all organs have begun their steps and all rows are requested. Without create() there are none between organs.
  void solve(WorldStep& step);
  // How the solution ended that an organ's solver has taken over; nullptr: the organ is to be solved alone.
  const ContactSolver::Outcome* outcome(std::int32_t organ) const {
    return is_joint_[organ] ? outcome_ + organ : nullptr;
  }
  // [most_joints], for a WorldStep.
  JointConstraint* joints() const { return joints_; }

 private:
  void solve_island(WorldStep& step, const std::int32_t* members, std::int32_t count);
  bool prepare(WorldStep& step, const std::int32_t* members, std::int32_t count, Operations* operations);
  bool solve_slipping(WorldStep& step, const std::int32_t* members, std::int32_t count, std::int32_t joint_count,
                      Operations operations);
  bool follow(WorldStep& step, const std::int32_t* members, std::int32_t count, std::int32_t joint_count);
  void set_reached(WorldStep& step, std::int32_t organ);

  JointSolver joint_;
  JointOrgan organ_[PALPATE_MAX_ORGANS];
  bool is_joint_[PALPATE_MAX_ORGANS] = {};  // in this step, solved with others
  ContactSolver::Outcome outcome_[PALPATE_MAX_ORGANS] = {};
  JointConstraint* joints_ = nullptr;     // [most_joints]
  JointConstraint** together_ = nullptr;  // [most_joints] those of an island
};

}  // namespace palpate
