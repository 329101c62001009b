#include "runtime/report/report_contacts.h"

#include <cmath>

#include "runtime/contact/tool_forces.h"
#include "runtime/contact/touch_step.h"

namespace palpate {
namespace {

class ContactsOfStep {
 public:
  explicit ContactsOfStep(const TouchStep& step) : step_(step), state_(*step.state) {}

  // Calls visit(first, end) for the constraints of each contact, which are neighbours in the list. Links, at its end, and grasps are no contacts.
  template <class Visit>
  void for_each_contact(Visit visit) const {
    const ContactConstraints& set = state_.rows.set();
    for (std::int32_t first = 0, end = 0; first < set.constraint_count; first = end) {
      if (!is_of_tool(set.constraints[first].id.contact)) return;
      const ContactId& contact = set.constraints[first].id.contact;
      while (end < set.constraint_count && set.constraints[end].id.contact == contact) ++end;
      if (!is_of_point(step_, contact)) continue;
      visit(first, end);
    }
  }

  // Of a TRIANGLE contact, whose parts may differ: released where all are, else sticking where one sticks.
  palpate_contact_state state_of(std::int32_t first, std::int32_t end) const {
    const ContactConstraint& contact = state_.rows.set().constraints[first];
    if (contact.law == ContactLaw::sticking) return PALPATE_CONTACT_STICKS;
    if (contact.law == ContactLaw::sliding) return PALPATE_CONTACT_FRICTIONLESS;
    bool released = true, sticks = false;
    for (std::int32_t p = first; p < end; ++p) {
      const Vec3 r = step_.reaction(p);
      if (!(r.x > 0)) continue;
      released = false;
      sticks = sticks || !gives_way(state_.rows.set().constraints[p], r).slips;
    }
    if (released) return PALPATE_CONTACT_RELEASED;
    if (contact.law == ContactLaw::unilateral) return PALPATE_CONTACT_FRICTIONLESS;
    return sticks ? PALPATE_CONTACT_STICKS : PALPATE_CONTACT_SLIPS;
  }

  ReportedContact reported(std::int32_t first, std::int32_t end) {
    const ContactConstraints& set = state_.rows.set();
    const ContactConstraint& constraint = set.constraints[first];
    const std::int32_t t = constraint.id.contact.index, point = constraint.id.contact.point;
    const Tool& tool = state_.input.tool(t);
    ReportedContact contact;
    contact.tool = t, contact.point = point;
    contact.state = state_of(first, end);
    if (point < tool.point_count) {
      contact.surface_point = state_.points.of_tool[t][point].anchor;
      if (meets_bound_surface(state_)) {
        const BoundContact& fine = state_.points.bound_of_tool[t][point];
        contact.fine = fine.anchor, contact.surface_point = fine.beneath;
      }
    } else if (const palpate_grip& grip = tool.grips[point - tool.point_count]; grip.kind == PALPATE_GRIP_NODE) {
      contact.node = grip.node;
    } else {
      contact.surface_point = surface_point_of(grip.triangle, grip.barycentric);
    }
    contact.holder = step_.holder(tool, point);
    Vec3 linear;
    for (std::int32_t p = first; p < end; ++p)
      for (std::int32_t e = 0; e < set.constraints[p].node_count; ++e) {
        const Vec3 force = state_.force[set.constraints[p].first_node + e];
        contact.force += -1 * corrected(step_, t, force), linear += force;
      }
    if (!is_finite(contact.force)) contact.force = Vec3{};
    if (constraint.disc_radius > 0) describe_disc(constraint, linear, &contact);
    return contact;
  }

  // The disc below a contact, and how deep its own force on the organ, N, would press it into a half-space.
  void describe_disc(const ContactConstraint& constraint, Vec3 force, ReportedContact* contact) const {
    const BoundContact* fine =
        contact->fine.triangle >= 0 ? &state_.points.bound_of_tool[contact->tool][contact->point] : nullptr;
    const Vec3 outward = fine ? fine->outward : outward_at(state_, constraint.surface_point);
    const double pressed =
        -dot(force, outward) * state_.surface.measure.tissue(constraint.surface_point).normal / constraint.disc_radius;
    if (!std::isfinite(pressed) || length(outward) == 0) return;
    contact->disc_radius = constraint.disc_radius, contact->disc_normal = outward, contact->indentation = pressed;
  }

  void tell(ContactReport& report) {
    const ContactConstraints& set = state_.rows.set();
    report.begin(state_.step + 1, state_.input.dt());
    for (std::int32_t t = 0; t < step_.context->def.max_tools; ++t) {
      const Tool& tool = state_.input.tool(t);
      report.hold_tool(t, tool.index < 0 ? -1 : tool.id);
    }
    for_each_contact([&](std::int32_t first, std::int32_t) {
      report.hold(set.constraints[first].id.contact.index, set.constraints[first].id.contact.point);
    });
    report.end_missing();
    for_each_contact([&](std::int32_t first, std::int32_t end) {
      report.add(reported(first, end), state_.input.tool(set.constraints[first].id.contact.index).index);
    });
    for (std::int32_t t = 0; t < state_.input.count(); ++t) {
      const Tool& tool = state_.input.tool(t);
      for (std::int32_t i = 0; tool.index >= 0 && !step_.far[t] && i < tool.point_count + tool.grip_count; ++i)
        report.note(t, i, step_.holder(tool, i));
    }
  }

 private:
  const TouchStep& step_;
  TouchState& state_;
};

}  // namespace

// The points of a tool that was far and comes near are where they were in the last step, in which they were not told.
void StepReport::begin_step(TouchStep& step) {
  const TouchState& state = *step.state;
  for (std::int32_t t = 0; step.finds_far && t < state.input.count(); ++t) {
    const Tool& tool = state.input.tool(t);
    for (std::int32_t i = 0; tool.index >= 0 && !step.far[t] && state.points.of_tool[t] && i < tool.point_count; ++i)
      if (state.points.of_tool[t][i].known) report_.note_last(t, i, state.points.of_tool[t][i].last);
  }
}

void StepReport::end_step(TouchStep& step) {
  ContactsOfStep(step).tell(report_);
  for (RowSource* source : step.state->parts.sources()) source->tell(step, report_);
  report_.end();
  step.context->watch.ended(pass_);
}

}  // namespace palpate
