// The tools of a world's step: checked once for all organs, with what each organ needs to know about them.
#pragma once

#include <cstdint>

#include "runtime/contact/tool_input.h"
#include "runtime/include/palpate/palpate_world.h"
#include "runtime/world/far_tools.h"

namespace palpate {

class WorldInput {
 public:
  // organs: the limits of each organ, [organ_count], which are copied. finds_far: organs ask which tools are far from them.
  bool create(SceneMemory& memory, const InputLimits* organs, std::int32_t organ_count, bool finds_far);

  // Takes the tools of a step. Returns the step flags.
  std::uint32_t take(const palpate_tool* tools, std::int32_t tool_count, double dt);
  // The tools as an organ gets them: sound, in the host's order, with the grips and the grasp that hold this organ. [count()], valid
  // until the next call.
  const palpate_tool* list_for(std::int32_t organ);
  // The step ends: its points become those of the last step.
  void keep_points();

  void forget();
  void forget_tool(std::int32_t id);

  std::int32_t count() const { return input_.sent(); }
  double dt() const { return input_.dt(); }
  // Of tool i of the step.
  std::int32_t place_of(std::int32_t id) const { return input_.place_of(id); }
  std::int32_t place(std::int32_t i) const { return input_.place_of_sent(i); }
  const Tool& tool(std::int32_t i) const { return input_.tool(place(i)); }
  const ToolsInWorld& in_world() const { return in_world_; }

 private:
  void look_at(std::int32_t i);

  // By the place of a tool: its points in the last step.
  struct Last {
    std::int32_t count = 0, unused = 0;  // in the place of padding, which a saved state would hold
    Vec3 low, high;                      // m, their box
  };
  ToolInput input_;
  ToolsInWorld in_world_;
  palpate_tool list_[PALPATE_MAX_TOOLS];
  Last last_[PALPATE_MAX_TOOLS];
  Vec3* last_points_[PALPATE_MAX_TOOLS] = {};  // [max_points]
  InputLimits limits_[PALPATE_MAX_ORGANS];
};

}  // namespace palpate
