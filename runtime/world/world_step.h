// A step of a world as it goes on: what its organs, the sources of its rows and its solver pass on to one another.
#pragma once

#include <cstdint>

#include "runtime/contact/row_source.h"
#include "runtime/contact/touch_step.h"
#include "runtime/include/palpate/palpate_world_contacts.h"
#include "runtime/scene/scene.h"
#include "runtime/world/joint_solver.h"
#include "runtime/world/world_plan.h"

namespace palpate {

class WorldSource;

struct WorldStep {
  palpate_scene* const* organs = nullptr;  // [organ_count]
  std::int32_t organ_count = 0;
  std::uint64_t number = 0;  // from 1
  std::uint32_t flags = 0;
  TouchStep of_organ[PALPATE_MAX_ORGANS];
  // Of the world, in the order in which they request their rows.
  static constexpr std::int32_t kMostSources = 2;
  WorldSource* sources[kMostSources] = {};
  std::int32_t source_count = 0;
  JointConstraint* joints = nullptr;  // of this step, in that order
  std::int32_t joint_count = 0;
  bool solved[PALPATE_MAX_ORGANS] = {};  // whether the contacts of the organ have a solution
  std::int32_t sweeps = 0;               // of the joint systems

  TouchState& touch(std::int32_t organ) const { return organs[organ]->touch; }
  // m, along its rows: by how much the solution brings the two sides of a joint farther than its target.
  Vec3 missed(const JointConstraint& joint) const {
    Vec3 sum = -1 * joint.target;
    for (int side = 0; side < 2; ++side)
      if (const std::int32_t p = joint.constraint[side]; p >= 0)
        sum += touch(joint.organ[side]).body->reached(touch(joint.organ[side]), p);
    return sum;
  }
};

// What holds places of two organs against one another: pairs that touch, links. Its rows act on two organs, which are solved as one. So a
// source requests them when all organs have begun their steps, and ends when all organs have ended. No function is pure, as in body.h.
class WorldSource : public RowsFor<WorldStep, palpate_world_contacts> {
 public:
  // Of its begin(), request() and end().
  virtual WorldPass pass() const { return WorldPass::solve; }
  // That tell() adds to the contacts at most.
  virtual std::size_t most_told_bytes() const { return 0; }
  virtual void forget() {}

 protected:
  ~WorldSource() = default;
};

}  // namespace palpate
