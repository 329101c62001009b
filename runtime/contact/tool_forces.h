// From the forces at contact nodes to what each tool feels: P and Q of the paper, torque, limits.
#pragma once

#include <cstdint>

#include "runtime/contact/touch_step.h"

namespace palpate {

inline Vec3 part_along(Vec3 force, Vec3 unit) {
  return dot(force, unit) * unit;
}

// After all requests: the directions of the tools' imposed displacements.
void find_directions(TouchStep& step);
// After the solve: the forces of the contact nodes on the organ, to their tools' sums.
void add_forces(TouchStep& step);
// After all nodes: what each tool feels before the limits.
void correct_forces(TouchStep& step);
// N: what the tool in place t feels and the contacts tell of a linear force on the organ.
inline Vec3 corrected(const TouchStep& step, std::int32_t t, Vec3 force) {
  const ToolResult& result = step.result[t];
  if (!step.state->response.exists()) return result.factor * force;
  return result.factor * (force + result.stretch * part_along(force, result.direction.unit));
}
// The tools' states in the step's output.
void write_tools(TouchStep& step);

}  // namespace palpate
