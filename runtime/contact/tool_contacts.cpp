#include "runtime/contact/tool_contacts.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact/touch_step.h"

namespace palpate {
namespace {

ContactId point_of(std::int32_t tool, std::int32_t point) {
  return {ContactSource::tool, tool, point};
}

// Below this coefficient of friction the law of a disc is along the disc's own normal. Above it friction takes more than the normal at rest is
// off by.
constexpr double kAlmostFree = 0.1;

bool differ(const SurfacePoint& a, const SurfacePoint& b) {
  return a.triangle != b.triangle || a.barycentric[0] != b.barycentric[0] || a.barycentric[1] != b.barycentric[1] ||
         a.barycentric[2] != b.barycentric[2];
}

// The contacts of a step.
class Contacts {
 public:
  explicit Contacts(TouchStep& step) : step_(step), context_(*step.context), state_(*step.state) {}

  void collide() {
    state_.points.collision.begin();
    for (std::int32_t t = 0; t < state_.input.count(); ++t)
      if (!step_.far[t]) collide(t);
    // A point that was not sent this step starts afresh when it comes back.
    for (std::int32_t t = 0; t < context_.def.max_tools; ++t)
      forget_points(context_.def, state_, t, state_.input.tool(t).point_count);
    context_.watch.ended(Pass::collision);
  }
  void collide(std::int32_t t) {
    Tool& tool = state_.input.tool(t);
    const bool follows = anchors_follow_tools(context_.def);
    const std::int64_t deferred = state_.work.deferred();
    const TrackingLimits limits = {context_.def.max_tool_speed * state_.input.dt(), state_.points.release_distance};
    state_.admission.expect_disc(tool.disc_radius > 0);
    expect_change();
    for (std::int32_t i = 0; i < tool.point_count; ++i) {
      PointState& state = state_.points.of_tool[t][i];
      const Vec3 p = step_.point(tool, i);
      const bool was_in_contact = state.contact;
      state.paid = state.owed, state.owed = false;
      state.disc.radius = tool.disc_radius;
      if (!state_.points.collision.move(state, p, point_of(t, i), tool.hold, limits))
        step_.raise(t, PALPATE_STEP_TRACKING_LOST);
      if (state.contact != was_in_contact) change_contact(state, state.contact);
      if (!state.contact && (state.disc.in_surface || (was_in_contact && state.disc.over_held)))
        step_.raise(t, PALPATE_STEP_NOT_TOUCHABLE);
      // Where the last step left the disc, as the offset has moved it since then.
      if (state.contact && !meets_bound_surface(state_)) state.slide.at += moved(state.anchor, &Offset::step_of);
      if (!state.contact || !follows || !may_slide(t, i)) continue;
      const SurfacePoint anchor = state.anchor;
      // A node contact moves the nearest vertex, not the anchor. The anchor's displacement then does not measure how far the
      // tool has slid past it, so the tool's own position decides.
      if (state.rides)
        state_.points.collision.ride(state, p);
      else if (context_.def.contact == PALPATE_CONTACT_NODE)
        state_.points.collision.slide_pulled(state, p, point_of(t, i));
      else
        state_.points.collision.follow(state, p, point_of(t, i));
      if (differ(anchor, state.anchor)) change_contact(state, false);
    }
    if (state_.work.deferred() > deferred) step_.raise(t, PALPATE_STEP_WORK_DEFERRED);
  }

  // Whether an anchor may move in this step. One that may not stays where it is, and its contact keeps its rows.
  bool may_slide(std::int32_t t, std::int32_t i) {
    const bool slides = state_.points.slides.take(t, i, state_.points.collision.may_change());
    if (!slides) state_.work.defer();
    return slides;
  }
  // A contact that comes, goes or moves has new rows in the factor.
  void change_contact(PointState& state, bool begins) {
    state.paid = state_.admission.change(begins) && state.contact;
    expect_change();
  }
  void expect_change() { state_.points.collision.expect(state_.admission.next()); }

  void request_point_contacts(std::int32_t t) {
    Tool& tool = state_.input.tool(t);
    const ContactLaw law = static_cast<ContactLaw>(context_.def.law);
    for (std::int32_t i = 0; i < tool.point_count; ++i) {
      PointState& state = state_.points.of_tool[t][i];
      if (!state.contact) continue;
      ContactWish wish;
      wish.contact = point_of(t, i);
      wish.displacement = step_.point(tool, i) - state.anchor_at_rest;
      wish.disc_radius = tool.disc_radius, wish.law = law, wish.friction = tool.friction;
      wish.slack = state.slide.slack + state.slide.lift;
      DiscSlide slide = {state.anchor_at_rest,
                         state.slide.lean,
                         state.slide.push,
                         state.slide.axis,
                         state.rides && law != ContactLaw::coulomb ? &state.slide.turn : nullptr,
                         state.begins};
      if (slides_almost_freely(tool)) wish.slide = &slide;
      if (meets_bound_surface(state_)) {
        request_bound_contact(wish, state, state_.points.bound_of_tool[t][i]);
      } else {
        set_frame(wish, state.anchor, &state.tangent);
        if (wish.slide && state.begins) slide.lean = state.slide.lean = first_lean(wish, state.anchor);
        state.has_no_rows = !request_contact(wish, state.anchor, state.paid);
        if (state.begins && !state.has_no_rows) begin_slide(wish, state);
      }
    }
  }

  // How the normal has turned where a disc begins: in the hollow below others its law is along the hollow's normal from its first step on.
  Vec3 first_lean(const ContactWish& wish, const SurfacePoint& anchor) {
    Vec3 sum;
    QueryWork work;
    work.limit(state_.work.left());
    if (!state_.deformed.may_sink(wish.contact) || !work.take(ContactPatch::kToPress)) return sum;
    Vec3 slope[ContactPatch::kMaxNodes];
    DiscPlace place;
    ContactPatch& patch = state_.surface.patch;
    patch.press(anchor, wish.outward, wish.tangent, wish.disc_radius);
    patch.measure_slopes(anchor, wish.outward, wish.tangent, wish.disc_radius, slope, &place);
    for (int e = 0; e < patch.count(); ++e)
      sum += dot(state_.field->at_node(patch.nodes()[e], &work), wish.outward) * slope[e];
    state_.work.add(work.done());
    return work.ended() ? Vec3{} : sum;
  }
  // A contact begins without force, where the disc's mean place lies off its anchor, too.
  void begin_slide(const ContactWish& wish, PointState& state) {
    state.begins = false;
    const ContactConstraints& set = state_.rows.set();
    const std::int32_t p = set.constraint_count - 1;
    if (!wish.slide || p < 0 || set.constraints[p].id.contact != wish.contact || !set.place[p].known) return;
    state.slide.lift = dot(load3(set.constraints[p].frame.m[0]), wish.slide->anchor - set.place[p].at);
  }
  bool discs_slide() const { return kHasEffects && state_.rows.discs_slide(); }
  bool slides_almost_freely(const Tool& tool) const {
    return discs_slide() && tool.disc_radius > 0 &&
           (context_.def.law != PALPATE_LAW_COULOMB || tool.friction < kAlmostFree);
  }

  // The anchor is on the bound surface. The contact acts on the mesh below it, along the bound surface's normal.
  void request_bound_contact(ContactWish& wish, PointState& state, BoundContact& bound) {
    if (differ(bound.anchor, state.anchor) || bound.radius != wish.disc_radius) {
      Operations work = 0;
      bound.anchor = state.anchor, bound.radius = wish.disc_radius;
      bound.beneath = state_.surface.bound->beneath(state.anchor);
      bound.outward = state_.surface.bound->outward(state.anchor, wish.disc_radius, state_.tree, &work);
      wish.moved = true;
      state_.work.add(work);
    }
    if (needs_contact_frames(context_.def)) set_frame(wish, bound.outward, &state.tangent);
    state.has_no_rows = !request_contact(wish, bound.beneath, state.paid);
  }

  // The outward normal at a surface point, and a tangent that turns with the normal from step to step.
  void set_frame(ContactWish& wish, const SurfacePoint& surface_point, Vec3* tangent) {
    if (needs_contact_frames(context_.def)) set_frame(wish, outward_at(state_, surface_point), tangent);
  }
  static void set_frame(ContactWish& wish, Vec3 outward, Vec3* tangent) {
    wish.outward = length(outward) == 0 ? Vec3{0, 0, 1} : outward;
    wish.tangent = *tangent = across(wish.outward, *tangent);
    if (wish.slack != 0) wish.displacement += wish.slack * wish.outward;
  }

  void request_grip_contacts(std::int32_t t) {
    const Tool& tool = state_.input.tool(t);
    for (std::int32_t g = 0; g < tool.grip_count; ++g) {
      const palpate_grip& grip = tool.grips[g];
      ContactWish wish;
      wish.contact = point_of(t, tool.point_count + g);
      wish.axes = grip.axes;
      const Vec3 drawn = step_.drawn(tool, grip);
      for (int i = 0; i < 3; ++i) wish.displacement[i] = grip.axes >> i & 1u ? drawn[i] : 0.0;
      if (grip.kind == PALPATE_GRIP_NODE) {
        bool made = false;
        const std::int32_t first = state_.rows.set().constraint_count;
        const std::uint32_t flags = state_.rows.add_node(wish, grip.node, &made);
        wish.displacement = wish.displacement - state_.displacement.moved_at_node(grip.node);
        record_contact(wish, flags, made && admit(t, first, false));
      } else {
        const SurfacePoint surface_point = surface_point_of(grip.triangle, grip.barycentric);
        Vec3 tangent;
        wish.disc_radius = tool.disc_radius;
        set_frame(wish, surface_point, &tangent);
        request_contact(wish, surface_point, false);
      }
    }
  }

  // paid: its new rows, if it has some, are counted. False where all of its nodes are held.
  bool request_contact(const ContactWish& wish, const SurfacePoint& surface_point, bool paid) {
    bool made = false;
    const std::int32_t first = state_.rows.set().constraint_count;
    if (!may_press(wish, surface_point, paid)) {
      step_.raise(wish.contact.index, PALPATE_STEP_WORK_DEFERRED);
      if (state_.rows.add_contact_as_before(wish) && admit(wish.contact.index, first, false))
        step_.count_contact(wish.contact.index, wish.displacement - moved(surface_point));
      return true;
    }
    const std::uint32_t flags = state_.rows.add_contact(wish, surface_point, &made);
    if (flags) step_.raise(wish.contact.index, flags);
    if (made && admit(wish.contact.index, first, paid))
      step_.count_contact(wish.contact.index, wish.displacement - moved(surface_point));
    return made;
  }
  // Whether the step has room for a disc that is to be computed anew.
  bool may_press(const ContactWish& wish, const SurfacePoint& surface_point, bool paid) {
    return paid || !state_.rows.presses(wish, surface_point) || state_.admission.press();
  }
  // Whether the constraints from `first` on are solved in this step.
  bool admit(std::int32_t t, std::int32_t first, bool paid) {
    bool deferred = false;
    const bool admitted = state_.admission.admit(first, paid, &deferred);
    if (deferred) step_.raise(t, PALPATE_STEP_WORK_DEFERRED);
    return admitted;
  }
  void record_contact(const ContactWish& wish, std::uint32_t flags, bool made) {
    if (flags) step_.raise(wish.contact.index, flags);
    if (made) step_.count_contact(wish.contact.index, wish.displacement);
  }
  // m, by the offset, of a surface point.
  Vec3 moved(const SurfacePoint& surface_point, Vec3 (Offset::*by)(std::int32_t) const = &Offset::now) const {
    Vec3 sum;
    for (int v = 0; v < 3 && state_.offset.exists(); ++v)
      sum += surface_point.barycentric[v] *
             (state_.offset.*by)(state_.surface.triangles[3 * static_cast<std::size_t>(surface_point.triangle) +
                                                          static_cast<std::size_t>(v)]);
    return sum;
  }

  // Where the step leaves the discs that slide almost freely, and how their normals have turned. Without room for it they follow their tools
  // in the next step as other contacts do.
  void ride_discs(bool solved) {
    const ContactConstraints& set = state_.rows.set();
    for (std::int32_t p = 0; p < set.constraint_count; ++p) {
      const ContactConstraint& constraint = set.constraints[p];
      if (!state_.slide_energy.sliding()[p].slack) continue;
      PointState& state = state_.points.of_tool[constraint.id.contact.index][constraint.id.contact.point];
      const Operations cost = 9 * Operations{constraint.node_count} * set.node_count / kDense;
      state.rides = solved && set.place[p].known && cost <= state_.work.left();
      if (!state.rides) continue;
      state_.work.add(cost);
      const DiscPlace& place = set.place[p];
      state.slide.at = place.at, state.slide.lean = Vec3{}, state.slide.push = step_.reaction(p).x;
      state.slide.axis = load3(constraint.frame.m[0]);
      for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e) {
        const Vec3 u = state_.solver.matrix().displacement(set, state_.force, e) +
                       state_.displacement.moved_at_node(set.nodes[e].node);
        state.slide.at += set.nodes[e].weight * u, state.slide.lean += dot(u, place.outward) * set.slope[e];
      }
    }
  }

  // COULOMB: where a contact slipped or released, moves its anchor to where the tool has gone relative to the surface. A
  // triangle contact has three constraints with friction of their own: its anchor sticks as long as one of them sticks.
  void move_slipped_anchors() {
    const ContactConstraints& set = state_.rows.set();
    state_.admission.begin_debts();
    for (std::int32_t p = 0, end = 0; p < set.constraint_count; p = end) {
      const ContactConstraint& first = set.constraints[p];
      const ContactId& contact = first.id.contact;
      if (!is_of_tool(contact)) return;
      bool sticks = false;
      for (; end < set.constraint_count && set.constraints[end].id.contact == contact; ++end)
        sticks = !gives_way(end) || sticks;
      if (first.law != ContactLaw::coulomb || sticks) continue;
      if (!state_.points.slides.take(contact.index, contact.point, may_owe(first))) {
        step_.raise(contact.index, PALPATE_STEP_WORK_DEFERRED);
        continue;
      }
      PointState& state = state_.points.of_tool[contact.index][contact.point];
      Vec3 along;
      for (std::int32_t part = p; part < end; ++part) along += left_behind(part);
      state_.points.collision.slide(state, state.anchor_at_rest + along);
      owe_change(first, state);
    }
  }
  bool may_owe(const ContactConstraint& slipped) const { return state_.admission.may_owe(slipped.disc_radius > 0); }
  void owe_change(const ContactConstraint& slipped, PointState& state) {
    state.owed = true;
    state_.admission.owe(slipped.disc_radius > 0);
  }
  bool gives_way(std::int32_t p) {
    const ContactConstraint& constraint = state_.rows.set().constraints[p];
    const GivesWay gone = palpate::gives_way(constraint, step_.reaction(p));
    step_.result[constraint.id.contact.index].sum.releases += gone.released;
    step_.result[constraint.id.contact.index].sum.slips += gone.slips && !gone.released;
    return gone.released || gone.slips;
  }
  // m, across the normal: how far the tool has moved past the anchor, times the constraint's share in it. Where the body
  // turns frames, the frame has turned with the surface: the way on the surface at rest has the same parts along the frame at rest.
  Vec3 left_behind(std::int32_t p) const {
    const ContactConstraint& constraint = state_.rows.set().constraints[p];
    const ContactConstraints& set = state_.rows.set();
    const Vec3 missed = state_.body->missed(step_, p), target = state_.offset.left_of_target(set, p);
    double share = constraint.share;
    // As Collision::follow: the contact's own part of the field moves with its anchor, by about own / asked of the way.
    const double asked = length(target), own = length(target + missed);
    if (!state_.body->responds_linearly() && own > 0) share *= asked / (asked + own);
    // Where contacts conflict or the law is missed, the surface may be anywhere: the anchor moves no farther than the tool is from
    // it at rest.
    const double off = length({0, missed.y, missed.z}), most = length({0, target.y, target.z});
    if (off > most) share *= most / off;
    Vec3 along;
    for (int i = 1; i < 3; ++i)
      along += -share * missed[i] * Vec3{constraint.frame.m[i][0], constraint.frame.m[i][1], constraint.frame.m[i][2]};
    return along;
  }

 private:
  TouchStep& step_;
  const StepContext& context_;
  TouchState& state_;
};

}  // namespace

void forget_points(const palpate_scene_def& def, TouchState& state, std::int32_t t, std::int32_t first) {
  if (!state.points.of_tool[t]) return;
  for (std::int32_t i = first; i < def.max_points && state.points.of_tool[t][i].known; ++i) {
    state.points.of_tool[t][i] = PointState{};
    if (meets_bound_surface(state)) state.points.bound_of_tool[t][i] = BoundContact{};
  }
}

std::int32_t ToolContacts::begin(TouchStep& step) {
  const TouchState& state = *step.state;
  const bool collides = step.context->def.collision != PALPATE_COLLISION_OFF;
  if (collides) Contacts(step).collide();
  std::int32_t count = 0;
  for (std::int32_t t = 0; t < state.input.count(); ++t) {
    const Tool& tool = state.input.tool(t);
    count += tool.grip_count;
    for (std::int32_t i = 0; collides && !step.far[t] && i < tool.point_count; ++i)
      count += state.points.of_tool[t][i].contact;
  }
  return count;
}

void ToolContacts::request_of_tool(TouchStep& step, std::int32_t t) {
  Contacts contacts(step);
  if (step.context->def.collision != PALPATE_COLLISION_OFF && !step.far[t]) contacts.request_point_contacts(t);
  contacts.request_grip_contacts(t);
}

void ToolContacts::end(TouchStep& step) {
  Contacts contacts(step);
  if (contacts.discs_slide()) contacts.ride_discs(step.is_solved);
  if (contacts_may_give_way(step.context->def) && step.follows) contacts.move_slipped_anchors();
}

bool ToolContacts::note_sliding(const TouchStep& step, const ContactConstraints& set,
                                const ContactConstraint& constraint, SlideEnergy::Sliding* sliding) {
  const auto [source, t, point] = constraint.id.contact;
  if (source != ContactSource::tool || !contacts_may_slide(step.context->def)) return false;
  const Tool& tool = step.state->input.tool(t);
  if (point >= tool.point_count) return false;
  PointState& state = step.state->points.of_tool[t][point];
  const Vec3 by_offset = step.moved(set, constraint);
  sliding->slack = &state.slide.slack, sliding->at = step.point(tool, point) - by_offset;
  sliding->from = state.slide.at - by_offset;
  return true;
}

}  // namespace palpate
