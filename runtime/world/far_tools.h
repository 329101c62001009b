// Tools that are far from an organ of a world: a box test decides it, and none of their points is looked at.
//
// A tool is far from an organ in a step where the box that its points have swept since the last step, in the organ's frame, does not
// meet the box around the organ's surface as it was and is. All its points are then outside, and none has crossed the surface. When
// the tool comes near again, its points continue from where they were in the step before.
#pragma once

#include <cstdint>

#include "runtime/contact/step_part.h"
#include "runtime/scene/scene.h"

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

// Takes in the tools of one organ's steps, which the world has checked. Those that are far are left out of the organ's collision.
class OrganInput final : public StepPart {
 public:
  // tools: of the world, borrowed. Its part of a saved state is in that of the organ.
  void create(palpate_scene& organ, const ToolsInWorld* tools);

  bool take_input(TouchStep& step, const palpate_tool* tools, std::int32_t tool_count, double dt) override;
  // A tool that becomes far is outside with all of its points. One that comes near again was outside, where it was in the last step.
  void begin_step(TouchStep& step) override;
  void forget_tool(std::int32_t t) override { last_.far[t] = 0; }

  // Tools of the last step that were not far.
  std::int32_t near_count() const { return last_.near_count; }

 private:
  bool is_far(const TouchStep& step, std::int32_t i, const palpate_tool& tool, double dt) const;
  void come_near(TouchStep& step, std::int32_t t, const ToolInWorld& tool) const;
  // m, of a point of the world, in the organ's frame as it was in the last step.
  Vec3 before_in_organ(Vec3 p) const { return last_.is_posed ? last_.pose.to_body(p) : p; }

  const ToolsInWorld* tools_ = nullptr;
  // What the last step has left. By the place of a tool in the scene.
  struct Last {
    Pose pose;  // of the organ
    std::int32_t is_posed = 0;
    std::int32_t near_count = 0;
    std::int32_t far[PALPATE_MAX_TOOLS] = {};  // 1: it was far
  } last_;
};

}  // namespace palpate
