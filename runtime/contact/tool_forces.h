// From the forces at contact nodes to what each tool feels: P and Q of the paper, torque, relaxation, limits.
#pragma once

#include <cstdint>

#include "runtime/base/vec3.h"

namespace palpate {

struct TouchStep;

// After all requests: the directions of the tools' imposed motions.
void find_directions(TouchStep& step);
// After the solve: the force of contact node e on the organ, to its tool's sums.
void add_force(TouchStep& step, std::int32_t e);
// After all nodes: what each tool feels before the limits.
void correct_forces(TouchStep& step);
// N: what the tool in place t feels and the contacts tell of a linear force on the organ.
Vec3 corrected(const TouchStep& step, std::int32_t t, Vec3 force);
// Its state in the step's output.
void write_tool(TouchStep& step, std::int32_t t);

}  // namespace palpate
