#include "runtime/world/far_tools.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact/touch_step.h"

namespace palpate {
namespace {

struct Box {
  Vec3 low, high;
};

// The box, along the organ's axes, around a box of the world.
Box in_organ(const Pose& pose, Vec3 low, Vec3 high) {
  const Vec3 middle = pose.to_body(0.5 * (low + high)), half = 0.5 * (high - low);
  Vec3 reach;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) reach[i] += std::fabs(pose.axes.m[j][i]) * half[j];
  return {middle - reach, middle + reach};
}

// m: how far the point of the world moves in the organ's frame between two poses, wherever it is within `reach` of the first one.
double largest_turn(const Pose& before, const Pose& now, double reach) {
  double squares = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const double change = now.axes.m[i][j] - before.axes.m[i][j];
      squares += change * change;
    }
  return length(now.position - before.position) + std::sqrt(squares) * reach;
}

// Whether one of the tool's points may have met the surface, or lies inside. last: the organ's pose in the last step; nullptr: it had none.
// farthest: m, the motion in one step beyond which a point counts as lost, which is not for a box to decide. Cost: some 200 multiply-adds.
bool may_meet(const ToolInWorld& tool, const DeformedSurface& surface, const OrganPose& organ, const Pose* last,
              double farthest) {
  if (tool.point_count == 0) return true;
  Box swept = {tool.low, tool.high}, before = {tool.low_before, tool.high_before};
  double moved = tool.moved, size = length(tool.low) + length(tool.high);
  if (organ.is_set()) {
    const Pose& now = organ.pose();
    swept = in_organ(now, tool.low, tool.high);
    size += 2 * length(now.position);
  }
  if (last) {
    before = in_organ(*last, tool.low_before, tool.high_before);
    size += 2 * length(last->position);
  }
  if (organ.is_set() || last) {
    const Pose rest, &then = last ? *last : rest, &now = organ.is_set() ? organ.pose() : rest;
    moved += largest_turn(then, now, length(tool.low - then.position) + length(tool.high - then.position));
  }
  if (tool.before_count > 0) {
    if (!(moved <= farthest)) return true;
    for (int i = 0; i < 3; ++i)
      swept.low[i] = std::min(swept.low[i], before.low[i]), swept.high[i] = std::max(swept.high[i], before.high[i]);
  }
  return surface.may_hold(swept.low, swept.high, 1e-14 * size);
}

}  // namespace

void OrganInput::create(palpate_scene& organ, const ToolsInWorld* tools) {
  tools_ = tools;
  organ.memory.keep(last_);
  organ.touch.parts.add_first(this);
}

// The pose of the step comes first, because it decides which tools are far.
bool OrganInput::take_input(TouchStep& step, const palpate_tool* tools, std::int32_t tool_count, double dt) {
  TouchState& state = *step.state;
  state.organ.begin_step(dt);
  bool far[PALPATE_MAX_TOOLS] = {};
  step.finds_far = true;
  const bool looks = tools_->finds_far && step.context->def.collision != PALPATE_COLLISION_OFF;
  for (std::int32_t i = 0; looks && i < tool_count; ++i) far[i] = is_far(step, i, tools[i], dt);
  step.flags = state.input.take(tools, tool_count, dt, far) | tools_->flags;
  last_.near_count = 0;
  for (std::int32_t i = 0; i < tool_count; ++i) {
    const std::int32_t t = state.input.place_of_sent(i);
    step.far[t] = far[i];
    last_.near_count += !far[i];
    if (tools_->tool[i].flags) step.raise(t, tools_->tool[i].flags);
  }
  return true;
}

// A tool that holds the organ is not.
bool OrganInput::is_far(const TouchStep& step, std::int32_t i, const palpate_tool& tool, double dt) const {
  const TouchState& state = *step.state;
  if (tool.grip_count > 0 || tool.parts) return false;
  const std::int32_t t = state.input.place_of(tool.id);
  for (std::int32_t p = 0; t >= 0 && p < state.input.tool(t).point_count; ++p)
    if (state.points.of_tool[t][p].contact) return false;
  return !may_meet(tools_->tool[i], state.deformed, state.organ, last_.is_posed ? &last_.pose : nullptr,
                   step.context->def.max_tool_speed * dt);
}

void OrganInput::come_near(TouchStep& step, std::int32_t t, const ToolInWorld& tool) const {
  TouchState& state = *step.state;
  const std::int32_t known = std::min(tool.before_count, state.input.tool(t).point_count);
  for (std::int32_t i = 0; i < known; ++i) {
    PointState& point = state.points.of_tool[t][i];
    point = PointState{};
    point.known = true, point.last = before_in_organ(tool.before[i]);
  }
}

void OrganInput::begin_step(TouchStep& step) {
  const TouchState& state = *step.state;
  for (std::int32_t t = 0; t < state.input.count(); ++t) {
    const Tool& tool = state.input.tool(t);
    if (tool.index < 0) continue;
    if (step.far[t] && !last_.far[t]) forget_points(step.context->def, *step.state, t, 0);
    if (!step.far[t] && last_.far[t]) come_near(step, t, tools_->tool[tool.index]);
    last_.far[t] = step.far[t];
  }
  last_.pose = state.organ.pose(), last_.is_posed = state.organ.is_set();
}

}  // namespace palpate
