#include "runtime/contact/tool_input.h"

#include <algorithm>

#include "runtime/base/alignment.h"

namespace palpate {
namespace {

constexpr double kFarthest = 1e6;  // m, as palpate.h states
// s, the same. In the shortest one a velocity is below the largest double for any way between such places.
constexpr double kShortestStep = 1e-300, kLongestStep = 1e6;

bool is_sound_grip(const palpate_grip& grip, const InputLimits& limits) {
  if (grip.axes == 0 || grip.axes > 7 || !is_sound_point(grip.displacement)) return false;
  const int kind = enum_number(grip.kind);
  if (kind == PALPATE_GRIP_NODE) return grip.node >= 0 && grip.node < limits.surface_nodes;
  if (kind != PALPATE_GRIP_SURFACE_POINT) return false;
  return limits.has_triangles && is_sound_place(grip.triangle, grip.barycentric, limits);
}

// Whether each effect has one part at most, and a sound one.
bool are_sound_parts(const palpate_part* first, const InputLimits& organ) {
  bool has_part[kMostToolParts] = {};
  for (const palpate_part* part = first; part; part = part->next) {
    const ToolPart* const how = is_aligned(part) ? organ.reader_of(part->effect) : nullptr;
    if (!how || has_part[how->place] || !how->is_sound(part, organ)) return false;
    if (how->alone && first->next) return false;
    has_part[how->place] = true;
  }
  return true;
}

// Element i of a host's array, whose elements may be smaller or larger than this library's.
template <class T>
const T* element(const T* first, std::uint32_t stride, std::int32_t i) {
  return reinterpret_cast<const T*>(reinterpret_cast<const unsigned char*>(first) +
                                    stride * static_cast<std::size_t>(i));
}

// Whether all elements have the first one's size, and that size is one that some header may declare.
template <class T>
bool have_one_size(const T* first, std::int32_t count) {
  const std::uint32_t stride = struct_bytes_of(first);
  if (!is_struct_size<T>(stride)) return false;
  for (std::int32_t i = 1; i < count; ++i)
    if (struct_bytes_of(element(first, stride, i)) != stride) return false;
  return true;
}

// The id by which tool i of the list is known.
std::int32_t id_of(const palpate_tool& tool, std::int32_t i) {
  return tool.id == -1 ? i : tool.id;
}

// Whether every tool has an id and no two tools have the same one. stride: bytes from one tool to the next.
bool have_ids_of_their_own(const palpate_tool* tools, std::uint32_t stride, std::int32_t count) {
  for (std::int32_t i = 0; i < count; ++i) {
    const std::int32_t id = id_of(*element(tools, stride, i), i);
    if (id < 0) return false;
    for (std::int32_t other = 0; other < i; ++other)
      if (id_of(*element(tools, stride, other), other) == id) return false;
  }
  return true;
}

}  // namespace

bool is_sound_point(const double* p) {
  return std::fabs(p[0]) <= kFarthest && std::fabs(p[1]) <= kFarthest && std::fabs(p[2]) <= kFarthest;  // false for NaN
}

bool is_sound_place(std::int32_t triangle, const double* barycentric, const InputLimits& organ) {
  if (triangle < 0 || triangle >= organ.triangles || (organ.active && !organ.active[triangle])) return false;
  double sum = 0;
  for (int v = 0; v < 3; ++v) {
    if (!(barycentric[v] >= -1e-6 && barycentric[v] <= 1 + 1e-6)) return false;
    sum += barycentric[v];
  }
  return std::fabs(sum - 1) <= 1e-6;
}

bool ToolInput::create(SceneMemory& memory, const InputLimits& limits, const InputLimits* organs,
                       std::int32_t organ_count) {
  limits_ = limits, organs_ = organs, organ_count_ = organ_count;
  for (std::int32_t t = 0; t < limits.max_tools; ++t) {
    tools_[t].points = memory.array<Vec3>(static_cast<std::size_t>(limits.max_points));
    tools_[t].grips = memory.array<palpate_grip>(static_cast<std::size_t>(limits.max_points));
  }
  memory.keep(place_);
  memory.keep(sent_);
  memory.keep(count_);
  memory.keep(dt_);
  for (std::int32_t t = 0; t < limits.max_tools; ++t) {
    Tool& tool = tools_[t];
    memory.keep(static_cast<ToolValues&>(tool));
    memory.keep_array(tool.points, static_cast<std::size_t>(limits.max_points), tool.point_count);
    memory.keep_array(tool.grips, static_cast<std::size_t>(limits.max_points), tool.grip_count);
  }
  return !memory.failed();
}

bool ToolInput::read_part(SceneMemory& memory, const ToolPart& how) {
  limits_.part[how.place] = &how;
  for (std::int32_t t = 0; t < limits_.max_tools; ++t) {
    unsigned char* const copy = memory.array<unsigned char>(how.bytes);
    if (!copy) return false;
    Tool& tool = tools_[t];
    tool.part[how.place] = reinterpret_cast<palpate_part*>(copy);
    *tool.part[how.place] = {static_cast<std::uint32_t>(how.bytes), 0, how.effect, nullptr};
    tool.kept[how.place] = copy + sizeof(palpate_part);
    memory.keep_array(tool.kept[how.place], how.bytes - sizeof(palpate_part));
  }
  return !memory.failed();
}

void ToolInput::forget_input(std::int32_t t) {
  Tool& tool = tools_[t];
  tool.point_count = tool.grip_count = 0;
  tool.hold = tool.has_torque = tool.pulls = false, tool.disc_radius = tool.friction = 0, tool.flags = 0;
  std::fill_n(tool.has_part, kMostToolParts, false);
  tool.organ = 0, tool.held_back = Vec3{};
}

void ToolInput::free_place(std::int32_t t) {
  forget_input(t);
  tools_[t].id = tools_[t].index = -1;
}

void ToolInput::forget() {
  for (std::int32_t t = 0; t < PALPATE_MAX_TOOLS; ++t) free_place(t);
  sent_ = count_ = 0;
  dt_ = 1e-3;
}

std::int32_t ToolInput::place_of(std::int32_t id) const {
  for (std::int32_t t = 0; t < limits_.max_tools; ++t)
    if (id >= 0 && tools_[t].id == id) return t;
  return -1;
}

// nullptr where there is no such organ. A scene has one, whatever the tool says.
const InputLimits* ToolInput::limits_of(std::int32_t organ) const {
  if (!organs_) return &limits_;
  return organ >= 0 && organ < organ_count_ ? organs_ + organ : nullptr;
}

bool ToolInput::is_sound(const palpate_tool& tool, std::int32_t points, std::int32_t grips) const {
  const InputLimits* const of_organ = limits_of(tool.organ);
  if (!of_organ) return false;
  if (tool.point_count < 0 || tool.grip_count < 0) return false;
  if (!(tool.disc_radius >= 0 && tool.disc_radius <= 1 && tool.friction >= 0 && tool.friction <= 100)) return false;
  if (tool.has_torque && !(limits_.has_positions && is_sound_point(tool.reference))) return false;
  if ((tool.point_count > 0 && !tool.points) || (tool.grip_count > 0 && !tool.grips)) return false;
  if (!is_aligned(tool.points) || !is_aligned(tool.grips)) return false;
  for (std::int32_t i = 0; i < points; ++i)
    if (!is_sound_point(tool.points + 3 * static_cast<std::size_t>(i))) return false;
  if (!are_sound_parts(tool.parts, *of_organ)) return false;
  if (grips == 0) return true;
  if (!have_one_size(tool.grips, grips)) return false;
  const std::uint32_t stride = struct_bytes_of(tool.grips);
  for (std::int32_t i = 0; i < grips; ++i) {
    palpate_grip whole;
    const palpate_grip* const grip = element(tool.grips, stride, i);
    if (!has_known_fields_only(grip) || !is_sound_grip(whole_struct(grip, &whole, palpate_init_grip), *of_organ))
      return false;
  }
  return true;
}

// Each tool keeps the place that its id had in the last step; the places of tools that are no longer sent become free; a new
// tool takes the first free place. So the places, and with them all results, do not depend on the order of the list.
void ToolInput::assign_places(const palpate_tool* tools, std::uint32_t stride, std::int32_t tool_count) {
  for (std::int32_t t = 0; t < limits_.max_tools; ++t) tools_[t].index = -1;
  for (std::int32_t i = 0; i < tool_count; ++i) {
    place_[i] = place_of(id_of(*element(tools, stride, i), i));
    if (place_[i] >= 0) tools_[place_[i]].index = i;
  }
  for (std::int32_t t = 0; t < limits_.max_tools; ++t)
    if (tools_[t].index < 0 && tools_[t].id >= 0) free_place(t);
  for (std::int32_t i = 0; i < tool_count; ++i) {
    if (place_[i] >= 0) continue;
    std::int32_t t = 0;
    while (tools_[t].index >= 0) ++t;
    tools_[t].id = id_of(*element(tools, stride, i), i);
    tools_[t].index = i, tools_[t].is_new = true;
    place_[i] = t;
  }
  sent_ = tool_count, count_ = limits_.max_tools;
  while (count_ > 0 && tools_[count_ - 1].index < 0) --count_;
}

// known: this library knows all fields that the host has set. room: points and grips that may still come.
void ToolInput::take_tool(const palpate_tool& from, Tool& tool, bool known, std::int32_t* room) {
  const std::int32_t points = std::clamp(from.point_count, 0, *room),
                     grips = std::clamp(from.grip_count, 0, *room - points);
  if (known && is_sound(from, points, grips)) {
    for (std::int32_t i = 0; i < points; ++i) tool.points[i] = load3(from.points + 3 * static_cast<std::size_t>(i));
    const std::uint32_t stride = grips > 0 ? struct_bytes_of(from.grips) : 0;
    for (std::int32_t i = 0; i < grips; ++i) {
      palpate_grip whole;
      tool.grips[i] = whole_struct(element(from.grips, stride, i), &whole, palpate_init_grip);
    }
    if (points < from.point_count || grips < from.grip_count) tool.flags |= PALPATE_STEP_CONTACTS_DROPPED;
    tool.point_count = points, tool.grip_count = grips;
    tool.hold = from.hold != 0;
    tool.has_torque = from.has_torque != 0, tool.reference = load3(from.reference);
    tool.disc_radius = from.disc_radius, tool.friction = from.friction;
    tool.organ = from.organ;
    tool.pulls = tool.hold;
    std::fill_n(tool.has_part, kMostToolParts, false);
    for (const palpate_part* part = from.parts; part; part = part->next) {
      const ToolPart& how = *limits_.reader_of(part->effect);
      how.copy(part, tool.part[how.place]);
      tool.has_part[how.place] = true;
      tool.pulls = tool.pulls || how.pulls;
    }
  } else {
    tool.flags |= PALPATE_STEP_BAD_INPUT;
    tool.point_count = std::min(tool.point_count, *room);
    tool.grip_count = std::min(tool.grip_count, *room - tool.point_count);
  }
  *room -= tool.point_count + tool.grip_count;
}

// Whoever says that it is far has checked it, and cut it to the room that there is.
void ToolInput::take_far_tool(const palpate_tool& from, Tool& tool, std::int32_t* room) {
  tool.point_count = from.point_count, tool.grip_count = 0;
  tool.hold = tool.pulls = from.hold != 0;
  std::fill_n(tool.has_part, kMostToolParts, false);
  tool.has_torque = from.has_torque != 0, tool.reference = load3(from.reference);
  tool.disc_radius = from.disc_radius, tool.friction = from.friction, tool.organ = from.organ;
  *room -= tool.point_count;
}

std::uint32_t ToolInput::take(const palpate_tool* tools, std::int32_t tool_count, double dt, const bool* far) {
  std::uint32_t flags = 0;
  if (dt >= kShortestStep && dt <= kLongestStep)
    dt_ = dt;
  else
    flags |= PALPATE_STEP_BAD_INPUT;
  for (std::int32_t t = 0; t < limits_.max_tools; ++t) tools_[t].flags = 0, tools_[t].is_new = false;
  const std::int32_t taken = std::min(tool_count, limits_.max_tools);
  const bool is_list = tool_count == 0 || (tool_count > 0 && tools && is_aligned(tools) && have_one_size(tools, taken));
  const std::uint32_t stride = is_list && tool_count > 0 ? struct_bytes_of(tools) : 0;
  if (!is_list || !have_ids_of_their_own(tools, stride, taken)) {
    for (std::int32_t t = 0; t < limits_.max_tools; ++t)
      if (tools_[t].index >= 0) tools_[t].flags |= PALPATE_STEP_BAD_INPUT;
    return flags | PALPATE_STEP_BAD_INPUT;
  }
  if (tool_count > limits_.max_tools) flags |= PALPATE_STEP_CONTACTS_DROPPED;
  assign_places(tools, stride, taken);
  std::int32_t room = limits_.max_points;
  for (std::int32_t i = 0; i < taken; ++i) {
    const palpate_tool* sent = element(tools, stride, i);
    palpate_tool whole;
    const palpate_tool& from = whole_struct(sent, &whole, palpate_init_tool);
    Tool& tool = tools_[place_[i]];
    if (far && far[i])
      take_far_tool(from, tool, &room);
    else
      take_tool(from, tool, has_known_fields_only(sent), &room);
    flags |= tool.flags;
  }
  return flags;
}

}  // namespace palpate
