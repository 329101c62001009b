// The caller's tools, checked and copied. A step works on the copies, which hold sound numbers whatever the device sent.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/include/palpate/palpate.h"
#include "runtime/include/palpate/palpate_grasps.h"
#include "runtime/include/palpate/palpate_needles.h"

namespace palpate {

// The bounds that the checks hold the input to.
struct InputLimits {
  std::int32_t surface_nodes = 0, triangles = 0, max_tools = 0, max_points = 0;
  bool has_triangles = false;  // the scene has triangles, so grips may name surface points
  bool has_grasps = false;     // tools may grasp
  bool has_needles = false;    // tools may have one
  bool has_positions = false;  // the scene has the surface nodes' positions, which torques need
};

// What a tool has besides its arrays. It outlives a step, because a tool with bad input keeps its last good one; a saved state
// holds all of it.
struct ToolValues {
  std::int32_t id = -1;     // -1: no tool has this place
  std::int32_t index = -1;  // of the tool in this step; -1: not sent
  bool is_new = false;      // this place had no tool in the last step, or another one
  bool hold = false, has_torque = false;
  bool has_grasp = false, has_needle = false;
  bool unused_flags[3] = {};  // in the place of padding, which a saved state would hold
  std::int32_t point_count = 0, grip_count = 0;
  std::uint32_t flags = 0;  // of this step
  std::int32_t organ = 0;   // of a world, that grips and grasp hold
  Vec3 reference;           // m, in the world, where the tool has a torque
  double disc_radius = 0, friction = 0;
  palpate_grasp grasp = {};    // where the tool has one
  palpate_needle needle = {};  // the same
};

// A tool keeps its place among the tools of the scene from step to step for as long as the host sends its id.
struct Tool : ToolValues {
  Vec3* points = nullptr;         // [point_count]
  palpate_grip* grips = nullptr;  // [grip_count]
};

class ToolInput {
 public:
  // organs: of a world, whose grips and grasps each have limits of their own: [organ_count], borrowed; nullptr: one organ.
  bool create(SceneMemory& memory, const InputLimits& limits, const InputLimits* organs = nullptr,
              std::int32_t organ_count = 1);

  // Copies the step's tools. A tool with any bad number keeps all of its last good input (nothing at first); so does dt, and so
  // do all tools where the list itself is bad. Points and grips beyond max_points are dropped, the first ones kept. Returns the
  // step flags. far: [tool_count], of tools whose points and grips are neither checked nor copied; nullptr: none is.
  std::uint32_t take(const palpate_tool* tools, std::int32_t tool_count, double dt, const bool* far = nullptr);

  void forget();
  // Forgets the last good input of the tool in place t.
  void forget_input(std::int32_t t);
  // The place of tool `index` of the step.
  std::int32_t place_of_sent(std::int32_t index) const { return place_[index]; }
  // The place of the tool with that id; -1: none.
  std::int32_t place_of(std::int32_t id) const;

  // Tools of the step.
  std::int32_t sent() const { return sent_; }
  // Places in use: those of the step's tools and, between them, places without points and grips.
  std::int32_t count() const { return count_; }
  Tool& tool(std::int32_t t) { return tools_[t]; }
  const Tool& tool(std::int32_t t) const { return tools_[t]; }
  double dt() const { return dt_; }
  const InputLimits& limits() const { return limits_; }
  // From now on tools may do so.
  void let_grasp() { limits_.has_grasps = true; }
  void let_have_needles() { limits_.has_needles = true; }

 private:
  bool is_sound(const palpate_tool& tool, std::int32_t points, std::int32_t grips) const;
  void free_place(std::int32_t t);
  void assign_places(const palpate_tool* tools, std::uint32_t stride, std::int32_t tool_count);
  void take_tool(const palpate_tool& from, Tool& tool, bool known, std::int32_t* room);
  static void take_far_tool(const palpate_tool& from, Tool& tool, std::int32_t* room);
  const InputLimits* limits_of(std::int32_t organ) const;

  InputLimits limits_;
  const InputLimits* organs_ = nullptr;
  std::int32_t organ_count_ = 1;
  Tool tools_[PALPATE_MAX_TOOLS];
  std::int32_t place_[PALPATE_MAX_TOOLS] = {};  // [sent] of each tool of the step
  std::int32_t sent_ = 0, count_ = 0;
  double dt_ = 1e-3;
};

}  // namespace palpate
