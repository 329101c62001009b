// A touch step as it goes on: what its parts pass on to one another.
#pragma once

#include <cstdint>

#include "runtime/bundle/step_context.h"
#include "runtime/contact/touch.h"

namespace palpate {

// Sums over one tool's contacts in this step.
struct ToolSum {
  Vec3 imposed;               // m, of their imposed displacements
  double imposed_length = 0;  // m, of those displacements' lengths
  Vec3 resultant;             // N, of the linear nodal forces on the organ
  Vec3 moment;                // N m, of the same about the tool's reference, where the tool has a torque
  Vec3 moment_along;          // N m, of their parts along the tool's direction, where Q acts
  std::int32_t contacts = 0, slips = 0, releases = 0;
};

// d_t of eqs 3-6: that of the tool's imposed displacements.
struct ToolDirection {
  Vec3 unit;  // zero: none
  double share =
      0;  // of P and Q that acts: 1 where the imposed displacements agree, falling smoothly to 0 as they cancel
};

struct ToolResult {
  ToolSum sum;
  ToolDirection direction;
  double factor = 0;   // on the tool's linear nodal forces
  double stretch = 0;  // by Q: what is added to their part along the direction, over that part
  // N and N m, on the organ, of what the tool has in the tissue. Q, the response of tissue under a tool on the surface, does not
  // act on it.
  Vec3 inside_force, inside_torque;
  bool is_inside = false,
       touches = false;  // in the tissue, which may push and draw it; there, or it presses the surface
  Vec3 raw, raw_torque;  // N and N m, in the organ's frame, on the tool before the limits
};

struct TouchStep {
  const StepContext* context;
  TouchState* state;
  palpate_contacts* out;  // from finish_touch() on
  std::uint32_t flags;
  bool finds_far;               // whoever has taken in the tools has looked for tools that are far
  bool far[PALPATE_MAX_TOOLS];  // by place: no point of the tool can meet the surface, and none is looked at
  Deformed deformed;
  bool is_solved;  // the step has a solution
  // And the organ is where its contacts hold it. A body with a field of its own may lag behind its contacts: the distance that is left is then no slip of a tool.
  bool follows;
  const ContactConstraints* taken;   // as the body holds them
  const ContactConstraints* acting;  // with what the offset leaves of their targets
  // Of what nothing puts off: counted when all else is done.
  Operations unasked;
  // Of the places in use: a step with one tool does not write those of all others.
  union {
    ToolResult result[PALPATE_MAX_TOOLS];
  };

  // begin() writes all else.
  TouchStep() {}
  void begin(const StepContext& of_scene, TouchState& of_steps);
  void raise(std::int32_t tool, std::uint32_t flag) {
    if (tool >= 0) state->input.tool(tool).flags |= flag;
    flags |= flag;
  }
  void count_contact(std::int32_t t, Vec3 displacement) {
    ToolSum& sum = result[t].sum;
    sum.imposed += displacement, sum.imposed_length += length(displacement), ++sum.contacts;
  }

  // m, in the organ's frame: a tool point; that, or where a grip takes the place that it holds.
  Vec3 point(const Tool& tool, std::int32_t i) const {
    return state->organ.point_to_organ(tool.points[i] - tool.held_back);
  }
  Vec3 holder(const Tool& tool, std::int32_t point) const;
  // m, in the organ's frame: of the places that a grip of the tool holds; about which the tool has its torque.
  Vec3 drawn(const Tool& tool, const palpate_grip& grip) const;
  Vec3 reference(const Tool& tool) const { return state->organ.point_to_organ(tool.reference - tool.held_back); }
  // m, by the offset: of the weighted mean that a constraint of `set` holds.
  Vec3 moved(const ContactConstraints& set, const ContactConstraint& constraint) const;
  // N, of constraint p, in its frame.
  Vec3 reaction(std::int32_t p) const { return state->body->reaction(*state, p); }
};

inline bool meets_bound_surface(const TouchState& state) {
  return kHasEffects && state.points.bound_of_tool[0];
}
// Unit, of the surface at rest; zero where its triangle has no area.
inline Vec3 outward_at(const TouchState& state, const SurfacePoint& surface_point) {
  const Vec3 outward = state.surface.measure.outward(surface_point);
  return length(outward) == 0 ? state.surface.index.outward(surface_point.triangle) : outward;
}
// Whether a tool's contact is one of its points or grips: those of its parts come after them.
inline bool is_of_point(const TouchStep& step, const ContactId& contact) {
  const Tool& tool = step.state->input.tool(contact.index);
  return contact.point < tool.point_count + tool.grip_count;
}

}  // namespace palpate
