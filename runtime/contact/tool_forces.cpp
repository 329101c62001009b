#include "runtime/contact/tool_forces.h"

#include <algorithm>
#include <cmath>

#include "runtime/base/contact_nodes.h"
#include "runtime/contact/force_limits.h"
#include "runtime/contact/touch_step.h"

namespace palpate {
namespace {

// P and Q act fully where the sum of a tool's imposed displacements is this share of the sum of their lengths, or more: two of
// equal length may differ by 120 degrees.
constexpr double kAgreed = 0.5;

// The direction of a sum that almost cancels is noise.
ToolDirection direction_of(const ToolSum& sum) {
  const double size = length(sum.imposed);
  if (!(size > 1e-9 * sum.imposed_length)) return {};
  const double agree = std::min(1.0, size / (kAgreed * sum.imposed_length));
  return {unit_or_zero(sum.imposed), agree * agree * (3 - 2 * agree)};
}

// Q acts on the part F of the tool's resultant along its direction (eqs 5 and 6), which becomes Q(F); its nodal forces get their
// shares of that, as their parts along the direction have. Q node by node would depend on the mesh, because Q is not additive.
double stretch_by_response(TouchStep& step, std::int32_t t) {
  const ToolDirection& direction = step.result[t].direction;
  if (direction.share == 0) return 0;
  const double along = dot(step.result[t].sum.resultant, direction.unit);
  if (step.state->response.outside(along)) step.raise(t, PALPATE_STEP_RESPONSE_RANGE);
  return direction.share * (step.state->response.ratio(along) - 1);
}

Vec3 corrected_moment(const TouchStep& step, const ToolResult& result) {
  if (!step.state->response.exists()) return result.factor * result.sum.moment;
  return result.factor * (result.sum.moment + result.stretch * result.sum.moment_along);
}

// last: what was sent in the last step.
Vec3 safe(TouchStep& step, std::int32_t t, Vec3 raw, double limit, double slew, Vec3& last) {
  std::uint32_t flags = 0;
  const Vec3 sent = within_limits(raw, limit, slew, step.state->input.dt(), &last, &flags);
  if (flags) step.raise(t, flags);
  return sent;
}

// Its state in the output.
void write_tool(TouchStep& step, std::int32_t t) {
  TouchState& state = *step.state;
  const Tool& tool = state.input.tool(t);
  const palpate_scene_def& def = step.context->def;
  const ToolResult& result = step.result[t];
  palpate_tool_state& out = tools_behind(*step.out)[tool.index];
  out = palpate_tool_state{};
  out.id = tool.id;
  const Vec3 raw = state.organ.vector_to_world(result.raw);
  store3(raw, out.force_raw);
  store3(safe(step, t, raw, def.force_limit, def.force_slew, state.sent[t].force), out.force);
  if (tool.has_torque) {
    const Vec3 torque = state.organ.vector_to_world(result.raw_torque);
    store3(torque, out.torque_raw);
    store3(safe(step, t, torque, def.torque_limit, def.torque_slew, state.sent[t].torque), out.torque);
  } else {
    state.sent[t].torque = Vec3{};
  }
  store3(result.direction.share * result.direction.unit, out.direction);
  out.contact_count = result.sum.contacts;
  out.slip_count = result.sum.slips;
  out.release_count = result.sum.releases;
  out.flags = tool.flags;
}

}  // namespace

void find_directions(TouchStep& step) {
  for (std::int32_t t = 0; t < step.state->input.count(); ++t)
    step.result[t].direction = direction_of(step.result[t].sum);
}

void add_forces(TouchStep& step) {
  const TouchState& state = *step.state;
  const ContactConstraints& set = state.rows.set();
  for (std::int32_t e = 0; e < set.node_count; ++e) {
    const ContactNode& held = set.nodes[e];
    if (!is_of_tool(held.contact)) continue;
    const Vec3 force = state.force[e];
    ToolResult& result = step.result[held.contact.index];
    result.sum.resultant += force;
    const Tool& tool = state.input.tool(held.contact.index);
    if (!tool.has_torque || !is_of_point(step, held.contact)) continue;
    const Vec3 arm = step.holder(tool, held.contact.point) - step.reference(tool);
    result.sum.moment += cross(arm, force);
    if (state.response.exists()) result.sum.moment_along += cross(arm, part_along(force, result.direction.unit));
  }
}

void correct_forces(TouchStep& step) {
  const palpate_scene_def& def = step.context->def;
  TouchState& state = *step.state;
  const std::int32_t count = state.input.count();
  if (def.force != PALPATE_FORCE_OFF) {
    for (std::int32_t t = 0; t < count; ++t) {
      step.result[t].factor = step.result[t].sum.contacts > 0 ? 1 : 0;
      if (state.response.exists()) step.result[t].stretch = stretch_by_response(step, t);
    }
    step.context->watch.ended(Pass::force);
  }
  for (std::int32_t t = 0; t < count; ++t) {
    ToolResult& result = step.result[t];
    result.raw = -1 * corrected(step, t, result.sum.resultant);
    result.raw_torque = -1 * corrected_moment(step, result);
  }
  for (StepPart* part : state.parts.all()) part->correct_forces(step);
}

void write_tools(TouchStep& step) {
  for (std::int32_t t = 0; t < step.state->input.count(); ++t)
    if (step.state->input.tool(t).index >= 0) write_tool(step, t);
}

}  // namespace palpate
