// Tools that are far from an organ of a world: a box test decides it, and none of their points is looked at.
//
// A tool is far from an organ in a step where the box that its points have swept since the last step, in the organ's frame, does not
// meet the box around the organ's surface as it was and is. All its points are then outside, and none has crossed the surface. When
// the tool comes near again, its points continue from where they were in the step before.
#pragma once

#include <cstdint>

#include "runtime/contact/deformed_surface.h"
#include "runtime/pose/pose.h"

namespace palpate {

// One tool of a step, as the world knows it. In the world's frame.
struct ToolInWorld {
  Vec3 low, high;                // m, box of its points
  Vec3 low_before, high_before;  // m, the same in the last step
  double moved = 0;              // m, the longest way of one of its points since then
  const Vec3* before = nullptr;  // [before_count] m, its points in the last step; none: the tool is new
  std::int32_t before_count = 0;
  std::int32_t point_count = 0;
  std::uint32_t flags = 0;  // that the step raises for it before the organ looks at it
};

// The tools of a step of a world, in the order of the list that an organ gets.
struct ToolsInWorld {
  ToolInWorld tool[PALPATE_MAX_TOOLS];
  std::uint32_t flags = 0;  // that concern no tool
  bool finds_far = false;   // the box test is made
};

// What an organ of a world remembers from step to step. By the place of a tool in the scene.
struct FarTools {
  Pose pose;  // of the organ in the last step
  std::int32_t is_posed = 0;
  std::int32_t near_count = 0;                // tools of the last step that were not far
  std::int32_t far[PALPATE_MAX_TOOLS] = {};   // 1: it was far in the last step
  std::int32_t held[PALPATE_MAX_TOOLS] = {};  // its points that were in contact

  void forget(std::int32_t t) { far[t] = held[t] = 0; }
  // m, of a point of the world, in the organ's frame as it was in the last step.
  Vec3 before_in_organ(Vec3 p) const { return is_posed ? pose.to_body(p) : p; }
};

// Whether the tool is far from the organ, none of whose contacts it holds. surface: as the last step has left it. farthest: m, the motion
// in one step beyond which a point counts as lost, which is not for a box to decide. Cost: some 200 multiply-adds.
bool is_far(const ToolInWorld& tool, const DeformedSurface& surface, const OrganPose& organ, const FarTools& last,
            double farthest);

}  // namespace palpate
