// The caller's tools, checked and copied. A step works on the copies, which hold sound numbers whatever the device sent.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/include/palpate/palpate.h"

namespace palpate {

// The bounds that the checks hold the input to.
struct InputLimits {
  std::int32_t surface_nodes = 0, triangles = 0, max_tools = 0, max_points = 0;
  bool has_triangles = false;  // the scene has triangles, so grips may name surface points
};

struct Tool {
  Vec3* points = nullptr;         // [point_count]
  palpate_grip* grips = nullptr;  // [grip_count]
  std::int32_t point_count = 0, grip_count = 0;
  bool hold = false;
  double disc_radius = 0, friction = 0;
  std::uint32_t flags = 0;  // of this step
};

class ToolInput {
 public:
  bool create(SceneMemory& memory, const InputLimits& limits);

  // Copies the step's tools. A tool with any bad number keeps all of its last good input (nothing at first); so does dt.
  // Points and grips beyond max_points are dropped, the first ones kept. Returns the step flags.
  std::uint32_t take(const palpate_tool* tools, std::int32_t tool_count, double dt);

  void forget();

  std::int32_t count() const { return count_; }
  Tool& tool(std::int32_t t) { return tools_[t]; }
  double dt() const { return dt_; }

 private:
  bool is_sound(const palpate_tool& tool, std::int32_t points, std::int32_t grips) const;

  InputLimits limits_;
  Tool tools_[PALPATE_MAX_TOOLS];
  std::int32_t count_ = 0;
  double dt_ = 1e-3;
};

}  // namespace palpate
