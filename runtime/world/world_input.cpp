#include "runtime/world/world_input.h"

#include <algorithm>

#include "runtime/base/host_struct.h"

namespace palpate {

bool WorldInput::create(SceneMemory& memory, const InputLimits* organs, std::int32_t organ_count, bool finds_far) {
  std::copy(organs, organs + organ_count, limits_);
  in_world_.finds_far = finds_far;
  InputLimits all = organs[0];
  for (std::int32_t k = 1; k < organ_count; ++k) all.has_positions = all.has_positions && organs[k].has_positions;
  if (!input_.create(memory, all, limits_, organ_count)) return false;
  for (int place = 0; place < kMostToolParts; ++place) {
    const auto reads = [place](const InputLimits& organ) { return organ.part[place] != nullptr; };
    const InputLimits* const organ = std::find_if(limits_, limits_ + organ_count, reads);
    if (organ != limits_ + organ_count && !input_.read_part(memory, *organ->part[place])) return false;
  }
  for (std::int32_t t = 0; finds_far && t < all.max_tools; ++t) {
    memory.keep(last_[t]);
    last_points_[t] = memory.array<Vec3>(static_cast<std::size_t>(all.max_points));
    memory.keep_array(last_points_[t], static_cast<std::size_t>(all.max_points), last_[t].count);
  }
  return !memory.failed();
}

std::uint32_t WorldInput::take(const palpate_tool* tools, std::int32_t tool_count, double dt) {
  const std::uint32_t flags = input_.take(tools, tool_count, dt);
  in_world_.flags = flags;
  for (std::int32_t i = 0; i < count(); ++i) look_at(i);
  return flags;
}

void WorldInput::look_at(std::int32_t i) {
  const Tool& tool = this->tool(i);
  ToolInWorld& seen = in_world_.tool[i];
  seen = ToolInWorld{};
  seen.flags = tool.flags, seen.point_count = tool.point_count;
  if (!in_world_.finds_far || tool.point_count == 0) return;
  Last& last = last_[place(i)];
  if (tool.is_new) last = Last{};
  seen.low = seen.high = tool.points[0];
  for (std::int32_t p = 1; p < tool.point_count; ++p)
    for (int d = 0; d < 3; ++d)
      seen.low[d] = std::min(seen.low[d], tool.points[p][d]), seen.high[d] = std::max(seen.high[d], tool.points[p][d]);
  seen.before = last_points_[place(i)], seen.before_count = last.count;
  seen.low_before = last.low, seen.high_before = last.high;
  for (std::int32_t p = 0; p < std::min(tool.point_count, last.count); ++p)
    seen.moved = std::max(seen.moved, length(tool.points[p] - seen.before[p]));
}

const palpate_tool* WorldInput::list_for(std::int32_t organ) {
  for (std::int32_t i = 0; i < count(); ++i) {
    const Tool& from = tool(i);
    const bool holds = from.organ == organ;
    palpate_tool& to = list_[i];
    to = palpate_default_tool();
    to.id = from.id, to.organ = from.organ;
    to.points = &from.points->x, to.point_count = holds || !input_.is_alone(from) ? from.point_count : 0;
    to.grips = from.grips, to.grip_count = holds ? from.grip_count : 0;
    for (int place = 0; place < kMostToolParts; ++place)
      if (holds && from.has_part[place]) palpate_add_part(&to.parts, from.part[place]);
    to.disc_radius = from.disc_radius, to.friction = from.friction;
    to.hold = from.hold, to.has_torque = from.has_torque;
    store3(from.reference, to.reference);
  }
  return list_;
}

void WorldInput::keep_points() {
  for (std::int32_t t = 0; in_world_.finds_far && t < input_.count(); ++t) {
    const Tool& tool = input_.tool(t);
    Last& last = last_[t];
    last.count = tool.index < 0 ? 0 : tool.point_count;
    if (last.count == 0) continue;
    std::copy(tool.points, tool.points + last.count, last_points_[t]);
    last.low = in_world_.tool[tool.index].low, last.high = in_world_.tool[tool.index].high;
  }
}

void WorldInput::forget() {
  input_.forget();
  for (Last& last : last_) last = Last{};
}

void WorldInput::forget_tool(std::int32_t id) {
  const std::int32_t t = input_.place_of(id);
  if (t < 0) return;
  input_.forget_input(t);
  last_[t] = Last{};
}

}  // namespace palpate
