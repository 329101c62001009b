#include "runtime/contact/touch_step.h"

#include <algorithm>

namespace palpate {
namespace {

// A copy of it is quicker than a new one, which is made in pieces and then copied across them.
constexpr Deformed kUndeformed;

}  // namespace

void TouchStep::begin(const StepContext& of_scene, TouchState& of_steps) {
  context = &of_scene, state = &of_steps, out = nullptr;
  flags = 0, unasked = 0, taken = acting = nullptr, deformed = kUndeformed;
  is_solved = follows = finds_far = false;
  std::fill(far, far + PALPATE_MAX_TOOLS, false);
}

Vec3 TouchStep::drawn(const Tool& tool, const palpate_grip& grip) const {
  const Vec3 drawn = load3(grip.displacement);
  return is_zero(tool.held_back) ? drawn : drawn - state->organ.vector_to_organ(tool.held_back);
}

Vec3 TouchStep::holder(const Tool& tool, std::int32_t point) const {
  if (point < tool.point_count) return this->point(tool, point);
  const palpate_grip& grip = tool.grips[point - tool.point_count];
  const auto at_rest = [&](std::int32_t node) {
    return load3(state->surface.rest + 3 * static_cast<std::size_t>(node));
  };
  if (grip.kind == PALPATE_GRIP_NODE) return at_rest(grip.node) + drawn(tool, grip);
  Vec3 sum = drawn(tool, grip);
  for (int v = 0; v < 3; ++v)
    sum += grip.barycentric[v] *
           at_rest(state->surface.triangles[3 * static_cast<std::size_t>(grip.triangle) + static_cast<std::size_t>(v)]);
  return sum;
}

Vec3 TouchStep::moved(const ContactConstraints& set, const ContactConstraint& constraint) const {
  return state->offset.held_by(set, constraint);
}

}  // namespace palpate
