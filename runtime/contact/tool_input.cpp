#include "runtime/contact/tool_input.h"

#include <algorithm>

#include "runtime/base/alignment.h"

namespace palpate {
namespace {

constexpr double kFarthest = 1e6;  // m, as palpate.h states

bool is_sound_point(const double* p) {
  return std::fabs(p[0]) <= kFarthest && std::fabs(p[1]) <= kFarthest && std::fabs(p[2]) <= kFarthest;  // false for NaN
}

bool is_sound_grip(const palpate_grip& grip, const InputLimits& limits) {
  if (grip.axes == 0 || grip.axes > 7 || !is_sound_point(grip.displacement)) return false;
  if (grip.node >= 0) return grip.node < limits.surface_nodes;
  if (!limits.has_triangles || grip.triangle < 0 || grip.triangle >= limits.triangles) return false;
  double sum = 0;
  for (const double k : grip.barycentric) {
    if (!(k >= -1e-6 && k <= 1 + 1e-6)) return false;
    sum += k;
  }
  return std::fabs(sum - 1) <= 1e-6;
}

}  // namespace

bool ToolInput::create(SceneMemory& memory, const InputLimits& limits) {
  limits_ = limits;
  for (std::int32_t t = 0; t < limits.max_tools; ++t) {
    tools_[t].points = memory.array<Vec3>(static_cast<std::size_t>(limits.max_points));
    tools_[t].grips = memory.array<palpate_grip>(static_cast<std::size_t>(limits.max_points));
  }
  return !memory.failed();
}

void ToolInput::forget() {
  for (Tool& tool : tools_) tool.point_count = tool.grip_count = 0, tool.hold = false, tool.flags = 0;
  count_ = 0;
  dt_ = 1e-3;
}

bool ToolInput::is_sound(const palpate_tool& tool, std::int32_t points, std::int32_t grips) const {
  if (tool.point_count < 0 || tool.grip_count < 0) return false;
  if (!(tool.disc_radius >= 0 && tool.disc_radius <= 1 && tool.friction >= 0 && tool.friction <= 100)) return false;
  if ((tool.point_count > 0 && !tool.points) || (tool.grip_count > 0 && !tool.grips)) return false;
  if (!is_aligned(tool.points) || !is_aligned(tool.grips)) return false;
  for (std::int32_t i = 0; i < points; ++i)
    if (!is_sound_point(tool.points + 3 * static_cast<std::size_t>(i))) return false;
  for (std::int32_t i = 0; i < grips; ++i)
    if (!is_sound_grip(tool.grips[i], limits_)) return false;
  return true;
}

std::uint32_t ToolInput::take(const palpate_tool* tools, std::int32_t tool_count, double dt) {
  std::uint32_t flags = 0;
  if (dt > 0 && dt <= 1e6)
    dt_ = dt;
  else
    flags |= PALPATE_STEP_BAD_INPUT;
  for (Tool& tool : tools_) tool.flags = 0;
  if (tool_count < 0 || (tool_count > 0 && !tools) || !is_aligned(tools)) {
    for (std::int32_t t = 0; t < count_; ++t) tools_[t].flags |= PALPATE_STEP_BAD_INPUT;
    return flags | PALPATE_STEP_BAD_INPUT;
  }
  if (tool_count > limits_.max_tools) flags |= PALPATE_STEP_CONTACTS_DROPPED;
  tool_count = std::min(tool_count, limits_.max_tools);
  for (std::int32_t t = tool_count; t < count_; ++t) tools_[t].point_count = tools_[t].grip_count = 0;
  count_ = tool_count;

  std::int32_t room = limits_.max_points;
  for (std::int32_t t = 0; t < count_; ++t) {
    const palpate_tool& from = tools[t];
    Tool& tool = tools_[t];
    const std::int32_t points = std::clamp(from.point_count, 0, room),
                       grips = std::clamp(from.grip_count, 0, room - points);
    if (is_sound(from, points, grips)) {
      for (std::int32_t i = 0; i < points; ++i) tool.points[i] = load3(from.points + 3 * static_cast<std::size_t>(i));
      std::copy(from.grips, from.grips + grips, tool.grips);
      if (points < from.point_count || grips < from.grip_count) tool.flags |= PALPATE_STEP_CONTACTS_DROPPED;
      tool.point_count = points, tool.grip_count = grips;
      tool.hold = from.hold != 0;
      tool.disc_radius = from.disc_radius, tool.friction = from.friction;
    } else {
      tool.flags |= PALPATE_STEP_BAD_INPUT;
      tool.point_count = std::min(tool.point_count, room);
      tool.grip_count = std::min(tool.grip_count, room - tool.point_count);
    }
    room -= tool.point_count + tool.grip_count;
    flags |= tool.flags;
  }
  return flags;
}

}  // namespace palpate
