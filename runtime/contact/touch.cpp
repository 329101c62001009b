// The step of a touch, in order: input, offset, collision, constraints, solution, forces, output.
#include "runtime/contact/touch.h"

#include <algorithm>

#include "runtime/base/contact_nodes.h"
#include "runtime/contact/tool_forces.h"
#include "runtime/contact/touch_solve.h"
#include "runtime/contact/touch_step.h"

namespace palpate {
namespace {

// Forgets what the steps so far have left about the tool in place t: the state before its first step.
void forget_tool(const palpate_scene_def& def, TouchState& state, std::int32_t t) {
  forget_points(def, state, t, 0);
  state.sent[t] = {};
  for (StepPart* part : state.parts.all()) part->forget_tool(t);
}

// ---- input -----------------------------------------------------------------------------------------------------------

void take_input(TouchStep& step, const palpate_tool* tools, std::int32_t tool_count, double dt) {
  TouchState& state = *step.state;
  for (StepPart* part : state.parts.all())
    if (part->take_input(step, tools, tool_count, dt)) return;
  step.flags = state.input.take(tools, tool_count, dt);
  state.organ.begin_step(state.input.dt());
}

// Far tools count: someone has taken their points in.
std::int32_t points_to_take_in(const ToolInput& input) {
  std::int32_t count = 0;
  for (std::int32_t t = 0; t < input.count(); ++t) count += input.tool(t).point_count + input.tool(t).grip_count;
  return count;
}

void begin_tools(TouchStep& step, const palpate_tool* tools, std::int32_t tool_count, double dt) {
  TouchState& state = *step.state;
  const palpate_scene_def& def = step.context->def;
  std::uint32_t had_tool = 0;  // bit t: in the last step
  for (std::int32_t t = 0; t < def.max_tools; ++t)
    if (state.input.tool(t).id >= 0) had_tool |= 1u << t;
  take_input(step, tools, tool_count, dt);
  state.work.begin(points_to_take_in(state.input));
  for (std::int32_t t = 0; t < def.max_tools; ++t) {
    const Tool& tool = state.input.tool(t);
    if (tool.is_new || (tool.index < 0 && had_tool >> t & 1u)) forget_tool(def, state, t);
  }
  for (std::int32_t t = 0; t < state.input.count(); ++t) step.result[t] = ToolResult{};
}

// Effects move the organ from outside.
void begin_parts(TouchStep& step) {
  TouchState& state = *step.state;
  state.offset.end_last_step();
  for (StepPart* part : state.parts.all()) part->begin_step(step);
  if (!state.offset.exists()) return;
  state.offset.begin_step();
  if (state.field && state.field->has_offset()) state.field->begin_moved();
  step.context->watch.ended(Pass::input);
}

void request_rows(TouchStep& step) {
  TouchState& state = *step.state;
  const auto for_sources = [&](const auto& each) {
    for (RowSource* source : state.parts.sources()) each(*source);
  };
  std::int32_t contacts = 0;
  for_sources([&](RowSource& source) { contacts += source.begin(step); });
  state.rows.begin(contacts);
  for (std::int32_t t = 0; t < state.input.count(); ++t)
    for_sources([&](RowSource& source) { source.request_of_tool(step, t); });
  for_sources([&](RowSource& source) { source.request(step); });
  step.context->watch.ended(Pass::rows);
}

// ---- output ----------------------------------------------------------------------------------------------------------

void write_nodes(TouchStep& step) {
  const TouchState& state = *step.state;
  const ContactConstraints& set = state.rows.set();
  palpate_contact_node* node = nodes_behind(*step.out);
  for (std::int32_t e = 0; e < set.node_count; ++e, ++node) {
    const ContactNode& held = set.nodes[e];
    const ContactId& contact = held.contact;
    const std::int32_t t = tool_of(contact);
    node->node = held.node, node->column = held.column;
    node->source = static_cast<palpate_contact_source>(contact.source), node->point = contact.point, node->reserved = 0;
    node->index = t < 0 ? contact.index : state.input.tool(t).index;
    store3(state.modified[e], node->modified_displacement);
    // A steep response may turn a finite force into an infinite one.
    const Vec3 force = is_of_tool(contact) ? corrected(step, t, state.force[e]) : state.force[e];
    if (!is_finite(force)) step.raise(t, PALPATE_STEP_UNSOLVED);
    store3(is_finite(force) ? force : Vec3{}, node->force);
  }
}

void write_contacts(TouchStep& step) {
  TouchState& state = *step.state;
  const palpate_scene_def& def = step.context->def;
  palpate_contacts& out = *step.out;
  lay_out_contacts(out, state.input.sent(), state.rows.set().node_count, state.held, state.offset.count());
  clear_behind_field(out);
  for (std::int32_t m = 0; m < state.offset.count(); ++m) amounts_behind(out)[m] = state.offset.whole_amount(m);
  out.body_steps = step.deformed.steps;
  out.body_residual = step.deformed.residual, out.least_volume = step.deformed.least_volume;
  state.body->write(step);
  write_nodes(step);
  out.bundle = step.context->bundle.index.header.index_checksum;
  out.node_capacity = def.max_contact_nodes;
  out.operations = static_cast<std::int32_t>(std::min<Operations>(state.work.done(), 0x7fffffff));
  out.residual_force = state.solver.residual().force;
  const Pose& pose = state.organ.pose();
  store3(pose.position, out.organ_position);
  const Quaternion& q = pose.orientation;
  out.organ_orientation[0] = q.w, out.organ_orientation[1] = q.x;
  out.organ_orientation[2] = q.y, out.organ_orientation[3] = q.z;
}

}  // namespace

// ---- the step --------------------------------------------------------------------------------------------------------

void begin_touch(TouchStep& step, const StepContext& context, TouchState& state, const palpate_tool* tools,
                 std::int32_t tool_count, double dt) {
  step.begin(context, state);
  state.points.slides.begin();
  begin_tools(step, tools, tool_count, dt);
  context.watch.ended(Pass::input);
  begin_parts(step);
  state.admission.begin();
  request_rows(step);
}

std::uint32_t finish_touch(TouchStep& step, const ContactSolver::Outcome* joint, palpate_contacts& out) {
  TouchState& state = *step.state;
  step.out = &out;
  const StepContext& context = *step.context;
  find_directions(step);
  solve_contacts(step, joint);
  correct_forces(step);
  state.work.add(step.unasked);
  write_contacts(step);
  write_tools(step);
  context.watch.ended(Pass::output);
  for (StepPart* part : state.parts.all()) part->end_step(step);
  if (context.bundle.is_lost()) step.flags |= PALPATE_STEP_BUNDLE_LOST;
  step.out->flags = step.flags;
  step.out->step = ++state.step;
  return step.flags;
}

std::uint32_t touch_step(const StepContext& context, TouchState& state, const palpate_tool* tools,
                         std::int32_t tool_count, double dt, palpate_contacts& out) {
  TouchStep step;
  begin_touch(step, context, state, tools, tool_count, dt);
  return finish_touch(step, nullptr, out);
}

// ---- what steps leave ------------------------------------------------------------------------------------------------

void reset_touch(const palpate_scene_def& def, TouchState& state) {
  state.input.forget();
  state.displacement.forget();
  if (state.linear_field.exists()) state.linear_field.forget();
  state.tree.forget();
  state.points.collision.forget();
  state.points.slides.forget();
  if (state.slide_energy.exists()) state.slide_energy.forget();
  state.work.forget();
  state.solver.forget();
  state.body->forget();
  state.rows.forget();
  state.offset.forget();
  for (StepPart* part : state.parts.all()) part->forget_rest();
  state.step = 0;
  for (std::int32_t t = 0; t < def.max_tools; ++t) forget_tool(def, state, t);
}

void touch_restored(const StepContext& context, TouchState& state) {
  for (StepPart* part : state.parts.all()) part->restored();
  state.solver.restored(context.tensors);
  state.body->restored();
  state.displacement.restored(context.tensors);
  if (state.linear_field.exists()) state.linear_field.restored(context.tensors, &state.solver);
}

void reset_tool(const palpate_scene_def& def, TouchState& state, std::int32_t id) {
  const std::int32_t t = state.input.place_of(id);
  if (t < 0) return;
  state.input.forget_input(t);
  forget_tool(def, state, t);
  for (StepPart* part : state.parts.all()) part->reset_tool(t);
}

}  // namespace palpate
