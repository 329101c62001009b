// The touch half, in order: input, collision, contact constraints, solve, force corrections, limits, output.
#include "runtime/contact/touch.h"
#include "runtime/base/contact_nodes.h"
#include "runtime/contact/force_limits.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <type_traits>

namespace palpate {
namespace {

bool has_fine_contacts(const TouchState& state) {
  return kHasEffects && state.fine_contacts[0];
}

// Forgets the points of the tool in place t from number `first` on. Those that are known come first.
void forget_points(const palpate_scene_def& def, TouchState& state, std::int32_t t, std::int32_t first) {
  if (!state.points[t]) return;
  for (std::int32_t i = first; i < def.max_points && state.points[t][i].known; ++i) {
    state.points[t][i] = PointState{};
    if (has_fine_contacts(state)) state.fine_contacts[t][i] = FineContact{};
  }
}

// Forgets what the steps so far have left about the tool in place t: the state before its first step.
void forget_tool(const palpate_scene_def& def, TouchState& state, std::int32_t t) {
  forget_points(def, state, t, 0);
  state.last_force[t] = state.last_torque[t] = Vec3{};
  if (has_grasps(def)) state.grasps.forget(t);
  if (has_needles(def)) state.needles.forget(t);
  state.far.forget(t);
  if (state.memory) state.memory[t] = state.torque_memory[t] = PronySeries::Memory{};
}

// P and Q act fully where the sum of a tool's imposed displacements is this share of the sum of their lengths, or more: two of
// equal length may differ by 120 degrees.
constexpr double kAgreed = 0.5;

// Below this coefficient of friction the law of a disc is along the disc's own normal. Above it friction takes more than the normal at rest is
// off by.
constexpr double kAlmostFree = 0.1;

// Sums over one tool's contacts in this step.
struct ToolSum {
  Vec3 imposed;               // m, of their imposed displacements
  double imposed_length = 0;  // m, of those displacements' lengths
  Vec3 resultant;             // N, of the linear nodal forces on the organ
  Vec3 moment;                // N m, of the same about the tool's reference, where the tool has a torque
  Vec3 moment_along;          // N m, of their parts along the tool's direction, where Q acts
  std::int32_t contacts = 0, slips = 0, releases = 0;
};

// d_t of eqs 3-6: that of the tool's imposed motion.
struct ToolDirection {
  Vec3 unit;  // zero: none
  double share =
      0;  // of P and Q that acts: 1 where the imposed displacements agree, falling smoothly to 0 as they cancel
};

Vec3 part_along(Vec3 force, Vec3 unit) {
  return dot(force, unit) * unit;
}

struct ToolResult {
  ToolSum sum;
  ToolDirection direction;
  double factor = 0;                 // on the tool's linear nodal forces
  double stretch = 0;                // by Q: what is added to their part along the direction, over that part
  Vec3 needle_force, needle_torque;  // N and N m, of its needle on the organ
  Vec3 raw, raw_torque;              // N and N m, in the organ's frame, on the tool before the limits
};

class Touch {
 public:
  Touch(const StepContext& context, TouchState& state, const ToolsInWorld* world, palpate_contacts& out)
      : context_(context), touch_state_(state), world_(world), out_(out) {}

  // Until the constraints are requested.
  void begin(const palpate_tool* tools, std::int32_t tool_count, double dt) {
    touch_state_.slides.begin();
    std::uint32_t had_tool = 0;  // bit t: in the last step
    for (std::int32_t t = 0; t < context_.def.max_tools; ++t)
      if (touch_state_.input.tool(t).id >= 0) had_tool |= 1u << t;
    take_input(tools, tool_count, dt);
    touch_state_.work.begin(points_to_look_at());
    for (std::int32_t t = 0; t < context_.def.max_tools; ++t) {
      const Tool& tool = touch_state_.input.tool(t);
      if (tool.is_new || (tool.index < 0 && had_tool >> t & 1u)) forget_tool(context_.def, touch_state_, t);
    }
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) result_[t] = ToolResult{};
    if (has_motions(context_.def)) {
      context_.watch.ended(Pass::input);
      flags_ |= touch_state_.motions.begin(context_.def.max_tool_speed * touch_state_.input.dt());
      if (follows_deformed_surface(context_.def)) touch_state_.field.begin_moved();
      context_.watch.ended(Pass::motions);
    }
    if (world_) pass_far_tools();
    context_.watch.ended(Pass::input);
    if (!deforms_largely(context_.def)) touch_state_.admission.begin();
    if (context_.def.collision != PALPATE_COLLISION_OFF) {
      touch_state_.collision.begin();
      for (std::int32_t t = 0; t < touch_state_.input.count(); ++t)
        if (!is_far(t)) collide(t);
      forget_absent_points();
      context_.watch.ended(Pass::collision);
    }
    const bool links = has_links(context_.def);
    touch_state_.rows.begin(contacts_to_request() +
                            (links ? touch_state_.links.begin(touch_state_.organ, &unasked_) : 0));
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) {
      if (context_.def.collision != PALPATE_COLLISION_OFF && !is_far(t)) request_point_contacts(t);
      request_grip_contacts(t);
      if (has_grasps(context_.def)) request_grasp(t);
    }
    if (has_needles(context_.def)) request_needles();
    if (links) flags_ |= touch_state_.links.request(touch_state_.rows, touch_state_.admission);
    context_.watch.ended(Pass::rows);
  }

  bool grasps_slip() {
    bool slips = false;
    for (std::int32_t t = 0; has_grasps(context_.def) && t < touch_state_.input.count(); ++t)
      slips = touch_state_.grasps.slips(t, touch_state_.input.tool(t), touch_state_.solver, touch_state_.rows) || slips;
    return slips;
  }

  // joint: how the solution of several organs ended, which the solver has; nullptr: the organ is solved alone.
  std::uint32_t finish(const ContactSolver::Outcome* joint) {
    const bool links = has_links(context_.def);
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) result_[t].direction = direction(t);
    if (deforms_largely(context_.def))
      deform();
    else
      solve(joint);
    context_.watch.ended(Pass::contact);
    if (links) {
      touch_state_.work.add(touch_state_.links.operations_to_end(touch_state_.rows.set().node_count));
      flags_ |= touch_state_.links.end(touch_state_.rows.set(), touch_state_.force, touch_state_.solver,
                                       !(flags_ & PALPATE_STEP_UNSOLVED), touch_state_.step + 1, &unasked_);
      context_.watch.ended(Pass::links);
    }
    if (context_.def.force != PALPATE_FORCE_OFF) {
      for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) {
        result_[t].factor = result_[t].sum.contacts > 0 ? 1 : 0;
        if (corrects_force(context_.def)) result_[t].stretch = stretch_by_response(t);
      }
      context_.watch.ended(Pass::force);
    }
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) {
      result_[t].raw = -1 * corrected(t, result_[t].sum.resultant);
      result_[t].raw_torque = -1 * corrected_moment(t);
      if (has_needles(context_.def)) add_needle(t);
    }
    if (relaxes(context_.def)) {
      for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) relax(t);
      context_.watch.ended(Pass::relaxation);
    }
    touch_state_.work.add(unasked_);
    write_nodes();
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) write_tool(t);
    context_.watch.ended(Pass::output);
    if (reports_contacts(context_.def)) {
      report();
      context_.watch.ended(Pass::report);
    }
    if (context_.bundle.is_lost()) flags_ |= PALPATE_STEP_BUNDLE_LOST;
    out_.flags = flags_;
    out_.step = ++touch_state_.step;
    return flags_;
  }

 private:
  void raise(std::int32_t tool, std::uint32_t flag) {
    if (is_of_tool(tool)) touch_state_.input.tool(tool).flags |= flag;
    flags_ |= flag;
  }

  // In a world the pose of the step comes first, because it decides which tools are far.
  void take_input(const palpate_tool* tools, std::int32_t tool_count, double dt) {
    if (!world_) {
      flags_ = touch_state_.input.take(tools, tool_count, dt);
      touch_state_.organ.begin_step(touch_state_.input.dt());
      return;
    }
    touch_state_.organ.begin_step(dt);
    bool far[PALPATE_MAX_TOOLS] = {};
    const bool finds_far = world_->finds_far && context_.def.collision != PALPATE_COLLISION_OFF;
    for (std::int32_t i = 0; finds_far && i < tool_count; ++i) {
      const std::int32_t t = touch_state_.input.place_of(tools[i].id);
      const bool held =
          (t >= 0 && touch_state_.far.held[t] > 0) || tools[i].grip_count > 0 || tools[i].grasp || tools[i].needle;
      far[i] = !held && palpate::is_far(world_->tool[i], touch_state_.deformed, touch_state_.organ, touch_state_.far,
                                        context_.def.max_tool_speed * dt);
    }
    flags_ = touch_state_.input.take(tools, tool_count, dt, far) | world_->flags;
    touch_state_.far.near_count = 0;
    for (std::int32_t i = 0; i < tool_count; ++i) {
      far_[touch_state_.input.place_of_sent(i)] = far[i];
      touch_state_.far.near_count += !far[i];
      if (world_->tool[i].flags) raise(touch_state_.input.place_of_sent(i), world_->tool[i].flags);
    }
  }
  bool is_far(std::int32_t t) const { return far_[t]; }
  std::int32_t points_to_look_at() const {
    std::int32_t count = 0;
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t)
      if (const Tool& tool = touch_state_.input.tool(t); !is_far(t)) count += tool.point_count + tool.grip_count;
    return count;
  }

  // A tool that becomes far is outside with all of its points. One that comes near again was outside, where it was in the last step.
  void pass_far_tools() {
    FarTools& far = touch_state_.far;
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) {
      const Tool& tool = touch_state_.input.tool(t);
      if (tool.index < 0) continue;
      if (far_[t] && !far.far[t]) forget_points(context_.def, touch_state_, t, 0);
      if (!far_[t] && far.far[t]) come_near(t, world_->tool[tool.index]);
      far.far[t] = far_[t];
    }
    far.pose = touch_state_.organ.pose(), far.is_posed = touch_state_.organ.is_set();
  }
  void come_near(std::int32_t t, const ToolInWorld& tool) {
    const std::int32_t known = std::min(tool.before_count, touch_state_.input.tool(t).point_count);
    for (std::int32_t i = 0; i < known; ++i) {
      PointState& state = touch_state_.points[t][i];
      state = PointState{};
      state.known = true, state.last = touch_state_.far.before_in_organ(tool.before[i]);
      if (reports_contacts(context_.def)) touch_state_.report.note(t, i, state.last);
    }
  }

  // m, in the organ's frame.
  Vec3 point(const Tool& tool, std::int32_t i) const { return touch_state_.organ.point_to_organ(tool.points[i]); }

  void collide(std::int32_t t) {
    Tool& tool = touch_state_.input.tool(t);
    const bool follows = anchors_follow_tools(context_.def);
    const std::int64_t deferred = touch_state_.work.deferred();
    const TrackingLimits limits = {context_.def.max_tool_speed * touch_state_.input.dt(),
                                   touch_state_.release_distance};
    if (!deforms_largely(context_.def)) touch_state_.admission.expect_disc(tool.disc_radius > 0);
    expect_change();
    for (std::int32_t i = 0; i < tool.point_count; ++i) {
      PointState& state = touch_state_.points[t][i];
      const Vec3 p = point(tool, i);
      const bool was_in_contact = state.contact;
      state.paid = state.owed, state.owed = false;
      state.radius = tool.disc_radius;
      if (!touch_state_.collision.move(state, p, t, i, tool.hold, limits)) raise(t, PALPATE_STEP_TRACKING_LOST);
      if (state.contact != was_in_contact) change_contact(state, state.contact);
      // Where the last step left the disc, as the motions have moved it since then.
      if (state.contact && !has_fine_contacts(touch_state_)) state.ridden += moved(state.anchor, &Motions::step_of);
      if (!state.contact || !follows || !may_slide(t, i)) continue;
      const SurfacePoint anchor = state.anchor;
      // A node contact moves the nearest vertex, not the anchor. The anchor's displacement then does not measure how far the
      // tool has slid past it, so the tool's own position decides.
      if (state.rides)
        touch_state_.collision.ride(state, p);
      else if (context_.def.contact == PALPATE_CONTACT_NODE)
        touch_state_.collision.slide_pulled(state, p, t, i);
      else
        touch_state_.collision.follow(state, p, t, i);
      if (differ(anchor, state.anchor)) change_contact(state, false);
    }
    if (touch_state_.work.deferred() > deferred) raise(t, PALPATE_STEP_WORK_DEFERRED);
    if (world_) count_held(t);
  }
  void count_held(std::int32_t t) {
    std::int32_t held = 0;
    for (std::int32_t i = 0; i < touch_state_.input.tool(t).point_count; ++i) held += touch_state_.points[t][i].contact;
    touch_state_.far.held[t] = held;
  }

  // Whether an anchor may move in this step. One that may not stays where it is, and its contact keeps its rows.
  bool may_slide(std::int32_t t, std::int32_t i) {
    const bool slides = touch_state_.slides.take(t, i, touch_state_.collision.may_change());
    if (!slides) touch_state_.work.defer();
    return slides;
  }
  static bool differ(const SurfacePoint& a, const SurfacePoint& b) {
    return a.triangle != b.triangle || a.barycentric[0] != b.barycentric[0] || a.barycentric[1] != b.barycentric[1] ||
           a.barycentric[2] != b.barycentric[2];
  }
  // A contact that comes, goes or moves has new rows in the factor.
  void change_contact(PointState& state, bool begins) {
    if (deforms_largely(context_.def)) {
      touch_state_.work.add(touch_state_.body.operations_to_renew());
    } else {
      state.paid = touch_state_.admission.change(begins) && state.contact;
      expect_change();
    }
  }
  void expect_change() {
    if (!deforms_largely(context_.def)) touch_state_.collision.expect(touch_state_.admission.next());
  }

  std::int32_t contacts_to_request() {
    std::int32_t count = 0;
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) {
      const Tool& tool = touch_state_.input.tool(t);
      count += tool.grip_count;
      if (has_grasps(context_.def)) count += touch_state_.grasps.begin(t, tool, touch_state_.organ, &unasked_);
      if (has_needles(context_.def)) count += touch_state_.needles.begin(t, tool, touch_state_.organ);
      if (is_far(t)) continue;
      for (std::int32_t i = 0; context_.def.collision != PALPATE_COLLISION_OFF && i < tool.point_count; ++i)
        count += touch_state_.points[t][i].contact;
    }
    return count;
  }

  void request_point_contacts(std::int32_t t) {
    Tool& tool = touch_state_.input.tool(t);
    const ContactLaw law = static_cast<ContactLaw>(context_.def.law);
    for (std::int32_t i = 0; i < tool.point_count; ++i) {
      PointState& state = touch_state_.points[t][i];
      if (!state.contact) continue;
      ContactWish wish;
      wish.tool = t, wish.point = i;
      wish.displacement = point(tool, i) - state.anchor_at_rest;
      wish.disc_radius = tool.disc_radius, wish.law = law, wish.friction = tool.friction;
      wish.slack = state.slack + state.lift;
      DiscSlide slide = {state.anchor_at_rest,
                         state.lean,
                         state.push,
                         state.axis,
                         state.rides && law != ContactLaw::coulomb ? &state.turn : nullptr,
                         state.begins};
      if (slides_almost_freely(tool)) wish.slide = &slide;
      if (has_fine_contacts(touch_state_)) {
        request_fine_contact(wish, state, touch_state_.fine_contacts[t][i]);
      } else {
        set_frame(wish, state.anchor, &state.tangent);
        if (wish.slide && state.begins) slide.lean = state.lean = first_lean(wish, state.anchor);
        state.over_held = !request_contact(wish, state.anchor, state.paid);
        if (state.begins && !state.over_held) begin_slide(wish, state);
      }
    }
  }

  // How the normal has turned where a disc begins: in the dent of others its law is along the dent's normal from its first step on.
  Vec3 first_lean(const ContactWish& wish, const SurfacePoint& anchor) {
    Vec3 sum;
    QueryWork work;
    work.limit(touch_state_.work.left());
    if (!touch_state_.deformed.may_sink(wish.tool, wish.point) || !work.take(ContactPatch::kToPress)) return sum;
    Vec3 slope[ContactPatch::kMaxNodes];
    DiscPlace place;
    ContactPatch& patch = touch_state_.patch;
    patch.press(anchor, wish.outward, wish.tangent, wish.disc_radius);
    patch.measure_slopes(anchor, wish.outward, wish.tangent, wish.disc_radius, slope, &place);
    for (int e = 0; e < patch.count(); ++e)
      sum += dot(touch_state_.field.at_node(patch.nodes()[e], &work), wish.outward) * slope[e];
    touch_state_.work.add(work.done());
    return work.ended() ? Vec3{} : sum;
  }
  // A contact begins without force, where the disc's mean place lies off its anchor, too.
  void begin_slide(const ContactWish& wish, PointState& state) {
    state.begins = false;
    const ContactConstraints& set = touch_state_.rows.set();
    const std::int32_t p = set.constraint_count - 1;
    if (!wish.slide || p < 0 || set.constraints[p].tool != wish.tool || set.constraints[p].point != wish.point ||
        !set.place[p].known)
      return;
    state.lift = dot(load3(set.constraints[p].frame.m[0]), wish.slide->anchor - set.place[p].at);
  }
  bool discs_slide() const { return kHasEffects && touch_state_.rows.discs_slide(); }
  bool slides_almost_freely(const Tool& tool) const {
    return discs_slide() && tool.disc_radius > 0 &&
           (context_.def.law != PALPATE_LAW_COULOMB || tool.friction < kAlmostFree);
  }

  // The anchor is on the fine surface. The contact acts on the mesh below it, along the fine surface's normal.
  void request_fine_contact(ContactWish& wish, PointState& state, FineContact& fine) {
    if (differ(fine.anchor, state.anchor) || fine.radius != wish.disc_radius) {
      Operations work = 0;
      fine.anchor = state.anchor, fine.radius = wish.disc_radius;
      fine.beneath = touch_state_.fine.beneath(state.anchor);
      fine.outward = touch_state_.fine.outward(state.anchor, wish.disc_radius, touch_state_.tree, &work);
      wish.moved = true;
      touch_state_.work.add(work);
    }
    if (needs_contact_frames(context_.def)) set_frame(wish, fine.outward, &state.tangent);
    state.over_held = !request_contact(wish, fine.beneath, state.paid);
  }

  // The outward normal at a surface point, and a tangent that turns with the normal from step to step.
  void set_frame(ContactWish& wish, const SurfacePoint& surface_point, Vec3* tangent) {
    if (needs_contact_frames(context_.def)) set_frame(wish, outward_at(surface_point), tangent);
  }
  Vec3 outward_at(const SurfacePoint& surface_point) const {
    const Vec3 outward = touch_state_.measure.outward(surface_point);
    return length(outward) == 0 ? touch_state_.surface.outward(surface_point.triangle) : outward;
  }
  static void set_frame(ContactWish& wish, Vec3 outward, Vec3* tangent) {
    wish.outward = length(outward) == 0 ? Vec3{0, 0, 1} : outward;
    wish.tangent = *tangent = across(wish.outward, *tangent);
    if (wish.slack != 0) wish.displacement += wish.slack * wish.outward;
  }

  void request_grip_contacts(std::int32_t t) {
    const Tool& tool = touch_state_.input.tool(t);
    for (std::int32_t g = 0; g < tool.grip_count; ++g) {
      const palpate_grip& grip = tool.grips[g];
      ContactWish wish;
      wish.tool = t, wish.point = tool.point_count + g;
      wish.axes = grip.axes;
      for (int i = 0; i < 3; ++i) wish.displacement[i] = grip.axes >> i & 1u ? grip.displacement[i] : 0.0;
      if (grip.kind == PALPATE_GRIP_NODE) {
        bool made = false;
        const std::int32_t first = touch_state_.rows.set().constraint_count;
        const std::uint32_t flags = touch_state_.rows.add_node(wish, grip.node, &made);
        wish.displacement = wish.displacement - touch_state_.displacement.moved_at_node(grip.node);
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

  void request_grasp(std::int32_t t) {
    const Tool& tool = touch_state_.input.tool(t);
    std::int32_t made = 0;
    const std::uint32_t flags =
        touch_state_.grasps.request(t, tool, tool.point_count + tool.grip_count, touch_state_.rows, &made);
    if (flags) raise(t, flags);
    const ContactConstraints& set = touch_state_.rows.set();
    for (std::int32_t p = 0; made > 0 && p < set.constraint_count; ++p) {
      if (set.constraints[p].tool != t || set.constraints[p].part != 0 || !is_of_grasp(t, set.constraints[p].point))
        continue;
      if (!touch_state_.solver.holds(set, p)) touch_state_.admission.pay();
      count_contact(t, set.target[p] - moved(set, set.constraints[p]));
    }
  }
  void request_needles() {
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) {
      std::int32_t made = 0;
      const std::int32_t first = touch_state_.rows.set().constraint_count;
      if (const std::uint32_t flags =
              touch_state_.needles.request(t, touch_state_.input.tool(t), touch_state_.rows, &made))
        raise(t, flags);
      const ContactConstraints& set = touch_state_.rows.set();
      for (std::int32_t p = first; p < set.constraint_count; ++p)
        if (!touch_state_.solver.holds(set, p)) touch_state_.admission.pay();
    }
  }
  void finish_needles(bool solved) {
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) {
      const Tool& tool = touch_state_.input.tool(t);
      if (tool.index < 0) continue;
      if (touch_state_.needles.touches(t))
        unasked_ += Needles::operations(touch_state_.needles.state(t).places, acting_->node_count);
      if (const std::uint32_t flags = touch_state_.needles.finish(t, tool, *acting_, touch_state_.force,
                                                                  touch_state_.solver, touch_state_.organ, solved,
                                                                  &result_[t].needle_force, &result_[t].needle_torque))
        raise(t, flags);
    }
  }
  bool is_of_grasp(std::int32_t t, std::int32_t point) const {
    if (!has_grasps(context_.def)) return false;
    const Tool& tool = touch_state_.input.tool(t);
    return point >= tool.point_count + tool.grip_count;
  }
  // The constraints once more where a grasp pulls beyond its friction, until it does not, and where a held volume is missed.
  ContactSolver::Outcome solve_again(const ContactConstraints& set) {
    ContactSolver::Outcome outcome = ContactSolver::Outcome::solved;
    const bool moves = has_motions(context_.def);
    for (int solve = 0; solve < kMostSlipSolves; ++solve) {
      acting_ = moves ? &touch_state_.motions.acting(set) : &set;
      outcome = touch_state_.solver.solve(context_.tensors, *acting_, touch_state_.force, touch_state_.modified,
                                          &touch_state_.work, solve > 0);
      if (outcome == ContactSolver::Outcome::unsolved || solve + 1 == kMostSlipSolves) break;
      // Without room, the excess of a grasp over its friction and what a volume is missed by are those of this solve.
      const bool has_room = touch_state_.work.left() >= touch_state_.solver.operations_to_solve({});
      const bool missed =
          moves && (has_room ? touch_state_.motions.follow_volumes(set, touch_state_.force, solve, &flags_)
                             : touch_state_.motions.holds_volumes());
      const bool gives_way = watches_slide_energy(context_.def) && has_room && is_trusted(outcome) &&
                             note_sliding(*acting_, touch_state_.slide_energy.sliding()) &&
                             touch_state_.slide_energy.give_way(touch_state_.solver, *acting_,
                                                                touch_state_.slide_energy.sliding(), touch_state_.rows);
      if (!grasps_slip() && !missed && !gives_way) break;
      if (has_room) continue;
      flags_ |= PALPATE_STEP_SOLVE_INEXACT;
      break;
    }
    return outcome;
  }
  // A needle that nothing brakes. Of others friction and cutting take more than new places may give.
  bool is_free(std::int32_t t) const {
    const palpate_needle& needle = touch_state_.input.tool(t).needle;
    return !has_motions(context_.def) && needle.friction == 0 && needle.cutting_force == 0;
  }
  // What the accounts of energy are to know about the constraints. False where none slides.
  bool note_sliding(const ContactConstraints& set, SlideEnergy::Sliding* of) {
    bool any = false;
    for (std::int32_t p = 0; p < set.constraint_count; ++p) {
      const ContactConstraint& constraint = set.constraints[p];
      SlideEnergy::Sliding& sliding = of[p];
      sliding = {};
      if (constraint.tool == kToolOfNeedles && is_free(Needles::tool_of(constraint.point))) {
        NeedlePlace& place = touch_state_.needles.place_of(constraint.point);
        const NeedleInTissue& needle = touch_state_.needles.needle_of(constraint.point);
        // The tip begins where it meets the surface, a place where the needle is.
        sliding.aside = &place.aside, sliding.at = needle.position;
        sliding.from = &place == &needle.tip ? place.rest : needle.position;
        sliding.axis = needle.axis, sliding.reach = &place == &needle.tip ? 0 : place.held;
        any = true;
      }
      if (!is_of_tool(constraint.tool) || !contacts_may_slide(context_.def)) continue;
      const Tool& tool = touch_state_.input.tool(constraint.tool);
      if (constraint.point >= tool.point_count) continue;
      PointState& state = touch_state_.points[constraint.tool][constraint.point];
      const Vec3 by_motions = moved(set, constraint);
      sliding.slack = &state.slack, sliding.at = point(tool, constraint.point) - by_motions;
      sliding.from = state.ridden - by_motions;
      any = true;
    }
    return any;
  }
  // Whether all constraints meet their targets and laws.
  bool is_trusted(ContactSolver::Outcome outcome) const {
    bool trusted = outcome == ContactSolver::Outcome::solved;
    for (std::int32_t p = 0; p < acting_->constraint_count; ++p) {
      const ContactSolver::Doubt doubt = touch_state_.solver.doubt_of(p);
      trusted = trusted && !doubt.inexact && !doubt.conflict;
    }
    return trusted;
  }
  void end_slide_energy(ContactSolver::Outcome outcome) {
    SlideEnergy& energy = touch_state_.slide_energy;
    note_sliding(*acting_, energy.sliding());
    const Operations rows = touch_state_.solver.rows_end(), cost = is_trusted(outcome) ? 0 : rows * rows / kDense;
    const bool met = cost == 0 || cost > touch_state_.work.left();
    if (!met) touch_state_.work.add(cost);
    if (energy.end(touch_state_.solver, *acting_, energy.sliding(), met)) return;
    for (std::int32_t p = 0; p < acting_->constraint_count; ++p)
      if (energy.sliding()[p].slides()) raise(owner_of(acting_->constraints[p]), PALPATE_STEP_SOLVE_INEXACT);
  }
  static_assert(Motions::kMostSolves <= kMostSlipSolves, "the last solve has the pressures that follow_volumes() left");
  void finish_grasps() {
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) {
      Vec3 torque, torque_along;
      const Tool& tool = touch_state_.input.tool(t);
      touch_state_.grasps.finish(t, tool, touch_state_.solver, touch_state_.organ, result_[t].direction.unit, &torque,
                                 &torque_along);
      if (!tool.has_torque || !is_finite(torque)) continue;
      result_[t].sum.moment += torque;
      result_[t].sum.moment_along += torque_along;
    }
  }

  // paid: its new rows, if it has some, are counted. False where all of its nodes are held.
  bool request_contact(const ContactWish& wish, const SurfacePoint& surface_point, bool paid) {
    bool made = false;
    const std::int32_t first = touch_state_.rows.set().constraint_count;
    if (!may_press(wish, surface_point, paid)) {
      raise(wish.tool, PALPATE_STEP_WORK_DEFERRED);
      if (touch_state_.rows.add_contact_as_before(wish) && admit(wish.tool, first, false))
        count_contact(wish.tool, wish.displacement - moved(surface_point));
      return true;
    }
    const std::uint32_t flags = touch_state_.rows.add_contact(wish, surface_point, &made);
    if (flags) raise(wish.tool, flags);
    if (made && admit(wish.tool, first, paid)) count_contact(wish.tool, wish.displacement - moved(surface_point));
    return made;
  }
  // Whether the step has room for a disc that is to be computed anew. Under large deformation body.operations_to_renew() counts it.
  bool may_press(const ContactWish& wish, const SurfacePoint& surface_point, bool paid) {
    return paid || deforms_largely(context_.def) || !touch_state_.rows.presses(wish, surface_point) ||
           touch_state_.admission.press();
  }
  // Whether the constraints from `first` on are solved in this step.
  bool admit(std::int32_t t, std::int32_t first, bool paid) {
    if (deforms_largely(context_.def)) return true;
    bool deferred = false;
    const bool admitted = touch_state_.admission.admit(first, paid, &deferred);
    if (deferred) raise(t, PALPATE_STEP_WORK_DEFERRED);
    return admitted;
  }
  void record_contact(const ContactWish& wish, std::uint32_t flags, bool made) {
    if (flags) raise(wish.tool, flags);
    if (made) count_contact(wish.tool, wish.displacement);
  }
  // m, by the motions: of the weighted mean that a constraint holds; of a surface point.
  Vec3 moved(const ContactConstraints& set, const ContactConstraint& constraint) const {
    Vec3 sum;
    for (std::int32_t e = 0; e < constraint.node_count && has_motions(context_.def); ++e) {
      const ContactNode& held = set.nodes[constraint.first_node + e];
      sum += held.weight * touch_state_.displacement.moved_at_node(held.node);
    }
    return sum;
  }
  Vec3 moved(const SurfacePoint& surface_point, Vec3 (Motions::*by)(std::int32_t) const = &Motions::now) const {
    Vec3 sum;
    for (int v = 0; v < 3 && has_motions(context_.def); ++v)
      sum += surface_point.barycentric[v] *
             (touch_state_.motions.*by)(touch_state_.triangles[3 * static_cast<std::size_t>(surface_point.triangle) +
                                                               static_cast<std::size_t>(v)]);
    return sum;
  }

  void count_contact(std::int32_t t, Vec3 displacement) {
    result_[t].sum.imposed += displacement;
    result_[t].sum.imposed_length += length(displacement);
    ++result_[t].sum.contacts;
  }

  // A point that was not sent this step starts afresh when it comes back.
  void forget_absent_points() {
    for (std::int32_t t = 0; t < context_.def.max_tools; ++t)
      forget_points(context_.def, touch_state_, t, touch_state_.input.tool(t).point_count);
  }

  void add_force(std::int32_t e, const ContactNode& held) {
    if (!is_of_tool(held.tool)) return;
    const Vec3 force = touch_state_.force[e];
    ToolResult& result = result_[held.tool];
    result.sum.resultant += force;
    if (!touch_state_.input.tool(held.tool).has_torque || is_of_grasp(held.tool, held.point)) return;
    const Vec3 arm = lever(held.tool, held.point);
    result.sum.moment += cross(arm, force);
    if (corrects_force(context_.def)) result.sum.moment_along += cross(arm, part_along(force, result.direction.unit));
  }

  // The same as solve(), of the hyperelastic body.
  void deform() {
    const ContactConstraints& set = touch_state_.rows.set();
    DeformingBody& body = touch_state_.body;
    for (int solve = 0;; ++solve) {
      const DeformingBody::Outcome last = deformed_;
      deformed_ = body.solve(set, &touch_state_.work, touch_state_.force);
      deformed_.steps += last.steps, deformed_.evaluations += last.evaluations;
      if (!watches_body_energy(context_.def)) break;
      note_body_energy(set, [&](std::int32_t p) { return transposed_times(body.frame(p), body.reaction(p)); });
      const double energy = body.energy(), noise = body.solver().energy_noise(energy);
      const bool has_room = touch_state_.work.left() >= body.fewest_operations();
      if (lags() || !has_room || solve + 1 == kMostSlipSolves ||
          !touch_state_.body_energy.give_way(energy, noise, touch_state_.rows))
        break;
    }
    if (watches_body_energy(context_.def)) {
      if (!lags()) touch_state_.body_energy.judge(body.energy(), body.solver().energy_noise(body.energy()), set);
      end_body_energy(set, !lags());
    }
    std::uint32_t flags = 0;
    if (deformed_.failed) flags |= PALPATE_STEP_UNSOLVED;
    if (deformed_.cut || deformed_.given_up || deformed_.unfinished) flags |= PALPATE_STEP_DEFORMATION_BEHIND;
    if (deformed_.inexact) flags |= PALPATE_STEP_SOLVE_INEXACT;
    flags_ |= flags;
    for (std::int32_t e = 0; e < set.node_count; ++e) {
      touch_state_.modified[e] = Vec3{};
      add_force(e, set.nodes[e]);
    }
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t)
      if (result_[t].sum.contacts > 0) touch_state_.input.tool(t).flags |= flags;
    if (uses_body_field(context_.def)) {
      Operations work = 0;
      touch_state_.body_field.set(set, touch_state_.force, !deformed_.failed, &work);
      touch_state_.work.owe(work);
    }
    // What a body that lags misses is not what a tool has slipped by.
    const bool lags = deformed_.failed || deformed_.cut || deformed_.given_up;
    if (contacts_may_give_way(context_.def) && !lags) move_slipped_anchors();
  }
  // The body is not where its contacts hold it.
  bool lags() const { return deformed_.failed || deformed_.cut || deformed_.given_up || deformed_.unfinished; }

  // force_on(p): N, of constraint p on the body, in the organ's frame.
  template <class Force>
  void note_body_energy(const ContactConstraints& set, Force force_on) {
    BodyEnergy& energy = touch_state_.body_energy;
    note_sliding(set, energy.sliding());
    for (std::int32_t p = 0; p < set.constraint_count; ++p) energy.force()[p] = force_on(p);
  }
  void end_body_energy(const ContactConstraints& set, bool followed) {
    BodyEnergy& energy = touch_state_.body_energy;
    for (std::int32_t p = 0; energy.gives_much() && p < set.constraint_count; ++p)
      if (energy.sliding()[p].slides()) raise(set.constraints[p].tool, PALPATE_STEP_SOLVE_INEXACT);
    energy.end(set, followed);
  }

  // Large deformation beside the touch: the constraints as the linear organ is to hold them.
  const ContactConstraints& take_solution() {
    bool fresh = false;
    const ContactConstraints& rows = touch_state_.rows.set();
    BodyEnergy& energy = touch_state_.body_energy;
    const ContactConstraints& set = touch_state_.beside.take(rows, energy.step(), &fresh);
    const BodyBeside::Told& told = touch_state_.beside.told();
    if (watches_body_energy(context_.def) && fresh && !told.cut && !told.unfinished && !told.failed) {
      note_sliding(rows, energy.sliding());
      energy.recall_forces(rows);
      energy.judge_earlier(told.energy, touch_state_.body.solver().energy_noise(told.energy), told.step, rows);
    }
    std::uint32_t flags = 0;
    if (told.failed) flags |= PALPATE_STEP_UNSOLVED;
    if (told.cut || told.unfinished || touch_state_.beside.behind()) flags |= PALPATE_STEP_DEFORMATION_BEHIND;
    flags_ |= flags;
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t)
      if (result_[t].sum.contacts > 0) touch_state_.input.tool(t).flags |= flags;
    deformed_.steps = told.steps, deformed_.residual = told.residual, deformed_.least_volume = told.least_volume;
    return set;
  }

  void solve(const ContactSolver::Outcome* joint) {
    const ContactConstraints& set = deforms_beside(context_.def) ? take_solution() : touch_state_.rows.set();
    acting_ = joint && has_motions(context_.def) ? &touch_state_.motions.acting(set) : &set;
    const ContactSolver::Outcome outcome = joint ? *joint : solve_again(set);
    if (watches_slide_energy(context_.def)) end_slide_energy(outcome);
    if (deforms_beside(context_.def) && watches_body_energy(context_.def)) {
      note_body_energy(touch_state_.rows.set(), [&](std::int32_t p) {
        const ContactConstraint& constraint = acting_->constraints[p];
        const Vec3 reaction = touch_state_.solver.reaction(p);
        return constraint.framed ? transposed_times(constraint.frame, reaction) : reaction;
      });
      end_body_energy(touch_state_.rows.set(), is_trusted(outcome) && !(flags_ & PALPATE_STEP_DEFORMATION_BEHIND));
    }
    if (has_motions(context_.def)) touch_state_.motions.end(set, touch_state_.force);
    if (has_grasps(context_.def)) {
      context_.watch.ended(Pass::contact);
      finish_grasps();
      context_.watch.ended(Pass::grasps);
    }
    if (has_needles(context_.def)) {
      context_.watch.ended(Pass::contact);
      finish_needles(outcome != ContactSolver::Outcome::unsolved);
      context_.watch.ended(Pass::needles);
    }
    std::uint32_t flag = 0;
    if (outcome == ContactSolver::Outcome::regularised) flag = PALPATE_STEP_REGULARISED;
    if (outcome == ContactSolver::Outcome::unsolved) flag = PALPATE_STEP_UNSOLVED;
    for (std::int32_t e = 0; e < set.node_count; ++e) {
      const std::int32_t t = set.nodes[e].tool;
      if (flag) raise(t, flag);
      add_force(e, set.nodes[e]);
    }
    for (std::int32_t p = 0; p < set.constraint_count; ++p) {
      const ContactSolver::Doubt doubt = touch_state_.solver.doubt_of(p);
      if (doubt.inexact) raise(owner_of(set.constraints[p]), PALPATE_STEP_SOLVE_INEXACT);
      if (doubt.conflict) raise(owner_of(set.constraints[p]), PALPATE_STEP_REGULARISED);
    }
    const bool solved = outcome != ContactSolver::Outcome::unsolved;
    touch_state_.displacement.set(context_.tensors, solved ? set : ContactConstraints{}, touch_state_.modified);
    if (follows_deformed_surface(context_.def)) {
      Operations work = 0;
      if (outcome == ContactSolver::Outcome::unsolved)
        touch_state_.field.set_rest();
      else
        touch_state_.field.set(context_.tensors, set, touch_state_.force, &touch_state_.solver,
                               touch_state_.work.debts_left(), &work);
      touch_state_.work.owe(work);
    }
    if (discs_slide()) ride_discs(outcome != ContactSolver::Outcome::unsolved);
    if (contacts_may_give_way(context_.def) && outcome != ContactSolver::Outcome::unsolved) move_slipped_anchors();
  }

  // Where the step leaves the discs that slide almost freely, and how their normals have turned. Without room for it they follow their tools
  // in the next step as other contacts do.
  void ride_discs(bool solved) {
    const ContactConstraints& set = touch_state_.rows.set();
    for (std::int32_t p = 0; p < set.constraint_count; ++p) {
      const ContactConstraint& constraint = set.constraints[p];
      if (!touch_state_.slide_energy.sliding()[p].slack) continue;
      PointState& state = touch_state_.points[constraint.tool][constraint.point];
      const Operations cost = 9 * Operations{constraint.node_count} * set.node_count / kDense;
      state.rides = solved && set.place[p].known && cost <= touch_state_.work.left();
      if (!state.rides) continue;
      touch_state_.work.add(cost);
      const DiscPlace& place = set.place[p];
      state.ridden = place.at, state.lean = Vec3{}, state.push = reaction(p).x;
      state.axis = load3(constraint.frame.m[0]);
      for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e) {
        const Vec3 u = touch_state_.solver.displacement(set, touch_state_.force, e) +
                       touch_state_.displacement.moved_at_node(set.nodes[e].node);
        state.ridden += set.nodes[e].weight * u, state.lean += dot(u, place.outward) * set.slope[e];
      }
    }
  }

  // COULOMB: where a contact slipped or released, moves its anchor to where the tool has gone relative to the surface. A
  // triangle contact has three constraints with friction of their own: its anchor sticks as long as one of them sticks.
  void move_slipped_anchors() {
    const ContactConstraints& set = touch_state_.rows.set();
    touch_state_.admission.begin_debts();
    for (std::int32_t p = 0, end = 0; p < set.constraint_count; p = end) {
      const ContactConstraint& first = set.constraints[p];
      if (!is_of_tool(first.tool)) return;
      bool sticks = false;
      for (; end < set.constraint_count && set.constraints[end].tool == first.tool &&
             set.constraints[end].point == first.point;
           ++end)
        sticks = !gives_way(end) || sticks;
      if (first.law != ContactLaw::coulomb || sticks) continue;
      if (!touch_state_.slides.take(first.tool, first.point, may_owe(first))) {
        raise(first.tool, PALPATE_STEP_WORK_DEFERRED);
        continue;
      }
      PointState& state = touch_state_.points[first.tool][first.point];
      Vec3 along;
      for (std::int32_t part = p; part < end; ++part) along += left_behind(part);
      touch_state_.collision.slide(state, state.anchor_at_rest + along);
      owe_change(first, state);
    }
  }
  bool may_owe(const ContactConstraint& slipped) const {
    return deforms_largely(context_.def) || touch_state_.admission.may_owe(slipped.disc_radius > 0);
  }
  void owe_change(const ContactConstraint& slipped, PointState& state) {
    state.owed = true;
    if (deforms_largely(context_.def))
      touch_state_.work.owe(touch_state_.body.operations_to_renew());
    else
      touch_state_.admission.owe(slipped.disc_radius > 0);
  }
  bool gives_way(std::int32_t p) {
    const ContactConstraint& constraint = touch_state_.rows.set().constraints[p];
    if (constraint.law != ContactLaw::unilateral && constraint.law != ContactLaw::coulomb) return false;
    const Vec3 r = reaction(p);
    const bool released = !(r.x > 0), slipped = slips(constraint, r);
    result_[constraint.tool].sum.releases += released;
    result_[constraint.tool].sum.slips += slipped && !released;
    return released || slipped;
  }
  // N, of constraint p, in its frame.
  Vec3 reaction(std::int32_t p) const {
    return deforms_largely(context_.def) ? touch_state_.body.reaction(p) : touch_state_.solver.reaction(p);
  }
  // m, across the normal: how far the tool has moved past the anchor, times the constraint's share in it. Under large deformation
  // the frame has turned with the surface: the way on the surface at rest has the same parts along the frame at rest.
  Vec3 left_behind(std::int32_t p) const {
    const ContactConstraint& constraint = touch_state_.rows.set().constraints[p];
    const ContactConstraints& set = touch_state_.rows.set();
    const Vec3 missed = deforms_largely(context_.def) ? touch_state_.body.missed(p)
                                                      : touch_state_.solver.missed(*acting_, p),
               target = has_motions(context_.def) ? acting_->target[p] : set.target[p];
    double share = constraint.share;
    // As Collision::follow: the contact's own part of the field moves with its anchor, by about own / asked of the way.
    const double asked = length(target), own = length(target + missed);
    if (context_.def.deformation != PALPATE_DEFORMATION_LINEAR && own > 0) share *= asked / (asked + own);
    // Where contacts conflict or the law is missed, the surface may be anywhere: the anchor moves no farther than the tool is from
    // it at rest.
    const double off = length({0, missed.y, missed.z}), most = length({0, target.y, target.z});
    if (off > most) share *= most / off;
    Vec3 along;
    for (int i = 1; i < 3; ++i)
      along += -share * missed[i] * Vec3{constraint.frame.m[i][0], constraint.frame.m[i][1], constraint.frame.m[i][2]};
    return along;
  }
  static bool slips(const ContactConstraint& constraint, Vec3 r) {
    constexpr double rounding = 1e-9;
    return constraint.law == ContactLaw::coulomb && length({0, r.y, r.z}) >= constraint.friction * r.x * (1 - rounding);
  }

  // The direction of a sum that almost cancels is noise.
  ToolDirection direction(std::int32_t t) const {
    const ToolSum& sum = result_[t].sum;
    const double size = length(sum.imposed);
    if (!(size > 1e-9 * sum.imposed_length)) return {};
    const double agree = std::min(1.0, size / (kAgreed * sum.imposed_length));
    return {unit_or_zero(sum.imposed), agree * agree * (3 - 2 * agree)};
  }

  // Q acts on the part F of the tool's resultant along its direction (eqs 5 and 6), which becomes Q(F); its nodal forces get their
  // shares of that, as their parts along the direction have. Q node by node would depend on the mesh, because Q is not additive.
  double stretch_by_response(std::int32_t t) {
    const ToolDirection& direction = result_[t].direction;
    if (direction.share == 0) return 0;
    const double along = dot(result_[t].sum.resultant, direction.unit);
    if (touch_state_.response.outside(along)) raise(t, PALPATE_STEP_RESPONSE_RANGE);
    return direction.share * (touch_state_.response.ratio(along) - 1);
  }
  // N: what the tool feels and the contacts tell of a linear force on the organ.
  Vec3 corrected(std::int32_t t, Vec3 force) const {
    const ToolResult& result = result_[t];
    if (!corrects_force(context_.def)) return result.factor * force;
    return result.factor * (force + result.stretch * part_along(force, result.direction.unit));
  }
  Vec3 corrected_moment(std::int32_t t) const {
    const ToolResult& result = result_[t];
    if (!corrects_force(context_.def)) return result.factor * result.sum.moment;
    return result.factor * (result.sum.moment + result.stretch * result.sum.moment_along);
  }

  void write_nodes() {
    const ContactConstraints& set = touch_state_.rows.set();
    const std::int32_t motions = has_motions(context_.def) ? touch_state_.motions.count() : 0;
    lay_out_contacts(out_, touch_state_.input.sent(), set.node_count,
                     {touch_state_.field_nodes, deforms_beside(context_.def)}, motions);
    clear_behind_field(out_);
    if (motions > 0) std::copy_n(touch_state_.motions.amounts(), motions, motions_behind(out_));
    if (deforms_largely(context_.def)) touch_state_.body.write_field(touch_state_.field_nodes, field_behind(out_));
    if (deforms_beside(context_.def))
      std::copy_n(touch_state_.beside.added().all(), 3 * static_cast<std::size_t>(touch_state_.field_nodes),
                  field_behind(out_));
    out_.deformation_steps = deformed_.steps;
    out_.deformation_residual = deformed_.residual, out_.least_volume = deformed_.least_volume;
    palpate_contact_node* node = nodes_behind(out_);
    for (std::int32_t e = 0; e < set.node_count; ++e, ++node) {
      const ContactNode& held = set.nodes[e];
      node->node = held.node, node->column = held.column, node->point = held.point;
      const bool of_tool = is_of_tool(held.tool);
      // Of links -1, of pairs -2, of links of the world -3, of needles -4.
      node->tool = of_tool                       ? touch_state_.input.tool(held.tool).index
                   : held.tool == kToolOfNeedles ? kToolOfNeedleNodes
                                                 : kToolOfLinks - 1 - held.tool;
      store3(touch_state_.modified[e], node->modified_displacement);
      // A steep response may turn a finite force into an infinite one.
      const Vec3 force = of_tool ? corrected(held.tool, touch_state_.force[e]) : touch_state_.force[e];
      if (!is_finite(force)) raise(held.tool, PALPATE_STEP_UNSOLVED);
      store3(is_finite(force) ? force : Vec3{}, node->force);
    }
    out_.bundle = context_.bundle.index.header.index_checksum;
    out_.node_capacity = context_.def.max_contact_nodes;
    const LawEffort& effort = deforms_largely(context_.def) ? touch_state_.body.effort() : touch_state_.solver.effort();
    out_.sweeps = effort.sweeps, out_.newton_steps = effort.newton_steps;
    out_.operations = static_cast<std::int32_t>(std::min<Operations>(touch_state_.work.done(), 0x7fffffff));
    out_.residual_displacement =
        deforms_largely(context_.def) ? deformed_.missed : touch_state_.solver.residual().displacement;
    out_.residual_force = touch_state_.solver.residual().force;
    const Pose& pose = touch_state_.organ.pose();
    store3(pose.position, out_.organ_position);
    const Quaternion& q = pose.orientation;
    out_.organ_orientation[0] = q.w, out_.organ_orientation[1] = q.x;
    out_.organ_orientation[2] = q.y, out_.organ_orientation[3] = q.z;
  }

  void write_tool(std::int32_t t) {
    const Tool& tool = touch_state_.input.tool(t);
    if (tool.index < 0) return;
    palpate_tool_state& state = tools_behind(out_)[tool.index];
    state = palpate_tool_state{};
    state.id = tool.id;
    const Vec3 raw = touch_state_.organ.vector_to_world(result_[t].raw);
    store3(raw, state.force_raw);
    const palpate_scene_def& def = context_.def;
    store3(safe(t, raw, def.force_limit, def.force_slew, touch_state_.last_force[t]), state.force);
    if (tool.has_torque)
      write_torque(t, state);
    else
      touch_state_.last_torque[t] = Vec3{};
    store3(result_[t].direction.share * result_[t].direction.unit, state.direction);
    state.contact_count = result_[t].sum.contacts;
    state.slip_count = result_[t].sum.slips;
    state.release_count = result_[t].sum.releases;
    state.flags = tool.flags;
  }

  // Calls visit(first, end) for the constraints of each contact, which are neighbours in the list. Links, at its end, and grasps are no contacts.
  template <class Visit>
  void for_each_contact(Visit visit) const {
    const ContactConstraints& set = touch_state_.rows.set();
    for (std::int32_t first = 0, end = 0; first < set.constraint_count; first = end) {
      if (!is_of_tool(set.constraints[first].tool)) return;
      while (end < set.constraint_count && set.constraints[end].tool == set.constraints[first].tool &&
             set.constraints[end].point == set.constraints[first].point)
        ++end;
      if (is_of_grasp(set.constraints[first].tool, set.constraints[first].point)) continue;
      visit(first, end);
    }
  }

  // Of a TRIANGLE contact, whose parts may differ: released where all are, else sticking where one sticks.
  palpate_contact_state state_of(std::int32_t first, std::int32_t end) const {
    const ContactConstraint& contact = touch_state_.rows.set().constraints[first];
    if (contact.law == ContactLaw::sticking) return PALPATE_CONTACT_STICKS;
    if (contact.law == ContactLaw::sliding) return PALPATE_CONTACT_FRICTIONLESS;
    bool released = true, sticks = false;
    for (std::int32_t p = first; p < end; ++p) {
      const Vec3 r = reaction(p);
      if (!(r.x > 0)) continue;
      released = false;
      sticks = sticks || !slips(touch_state_.rows.set().constraints[p], r);
    }
    if (released) return PALPATE_CONTACT_RELEASED;
    if (contact.law == ContactLaw::unilateral) return PALPATE_CONTACT_FRICTIONLESS;
    return sticks ? PALPATE_CONTACT_STICKS : PALPATE_CONTACT_SLIPS;
  }

  ReportedContact reported(std::int32_t first, std::int32_t end) {
    const ContactConstraints& set = touch_state_.rows.set();
    const ContactConstraint& constraint = set.constraints[first];
    const Tool& tool = touch_state_.input.tool(constraint.tool);
    ReportedContact contact;
    contact.tool = constraint.tool, contact.point = constraint.point;
    contact.state = state_of(first, end);
    if (constraint.point < tool.point_count) {
      contact.surface_point = touch_state_.points[constraint.tool][constraint.point].anchor;
      if (has_fine_contacts(touch_state_)) {
        const FineContact& fine = touch_state_.fine_contacts[constraint.tool][constraint.point];
        contact.fine = fine.anchor, contact.surface_point = fine.beneath;
      }
    } else if (const palpate_grip& grip = tool.grips[constraint.point - tool.point_count];
               grip.kind == PALPATE_GRIP_NODE) {
      contact.node = grip.node;
    } else {
      contact.surface_point = surface_point_of(grip.triangle, grip.barycentric);
    }
    contact.holder = holder(tool, constraint.point);
    Vec3 linear;
    for (std::int32_t p = first; p < end; ++p)
      for (std::int32_t e = 0; e < set.constraints[p].node_count; ++e) {
        const Vec3 force = touch_state_.force[set.constraints[p].first_node + e];
        contact.force += -1 * corrected(constraint.tool, force), linear += force;
      }
    if (!is_finite(contact.force)) contact.force = Vec3{};
    if (constraint.disc_radius > 0) describe_disc(constraint, linear, &contact);
    return contact;
  }

  // The disc below a contact, and how deep its own force on the organ, N, would press it into a half-space.
  void describe_disc(const ContactConstraint& constraint, Vec3 force, ReportedContact* contact) const {
    const FineContact* fine =
        contact->fine.triangle >= 0 ? &touch_state_.fine_contacts[constraint.tool][constraint.point] : nullptr;
    const Vec3 outward = fine ? fine->outward : outward_at(constraint.surface_point);
    const double pressed =
        -dot(force, outward) * touch_state_.measure.tissue(constraint.surface_point).normal / constraint.disc_radius;
    if (!std::isfinite(pressed) || length(outward) == 0) return;
    contact->disc_radius = constraint.disc_radius, contact->disc_normal = outward, contact->indentation = pressed;
  }

  // m, in the organ's frame: a tool point, or where a grip takes the place that it holds.
  Vec3 holder(const Tool& tool, std::int32_t point) const {
    if (point < tool.point_count) return this->point(tool, point);
    const palpate_grip& grip = tool.grips[point - tool.point_count];
    const auto at_rest = [&](std::int32_t node) {
      return load3(touch_state_.rest + 3 * static_cast<std::size_t>(node));
    };
    if (grip.kind == PALPATE_GRIP_NODE) return at_rest(grip.node) + load3(grip.displacement);
    Vec3 sum = load3(grip.displacement);
    for (int v = 0; v < 3; ++v)
      sum += grip.barycentric[v] *
             at_rest(touch_state_.triangles[3 * static_cast<std::size_t>(grip.triangle) + static_cast<std::size_t>(v)]);
    return sum;
  }

  void report() {
    const ContactConstraints& set = touch_state_.rows.set();
    ContactReport& report = touch_state_.report;
    report.begin(touch_state_.step + 1, touch_state_.input.dt());
    for (std::int32_t t = 0; t < context_.def.max_tools; ++t) {
      const Tool& tool = touch_state_.input.tool(t);
      report.hold_tool(t, tool.index < 0 ? -1 : tool.id);
    }
    for_each_contact([&](std::int32_t first, std::int32_t) {
      report.hold(set.constraints[first].tool, set.constraints[first].point);
    });
    report.end_missing();
    for_each_contact([&](std::int32_t first, std::int32_t end) {
      report.add(reported(first, end), touch_state_.input.tool(set.constraints[first].tool).index);
    });
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) {
      const Tool& tool = touch_state_.input.tool(t);
      for (std::int32_t i = 0; tool.index >= 0 && !is_far(t) && i < tool.point_count + tool.grip_count; ++i)
        report.note(t, i, holder(tool, i));
    }
    if (has_grasps(context_.def)) report_grasps();
    if (has_links(context_.def)) report_links();
    report.end();
  }

  void report_grasps() {
    for (std::int32_t t = 0; t < context_.def.max_tools; ++t) {
      const Tool& tool = touch_state_.input.tool(t);
      if (tool.index < 0) continue;  // hold_tool() has told its end
      const palpate_grasp_state& state = touch_state_.grasps.state(t);
      HeldEvent held;
      held.condition = state.condition, held.closing = tool.has_grasp ? tool.grasp.id : 0;
      if (tool.has_grasp) {
        held.surface_point = surface_point_of(tool.grasp.triangle, tool.grasp.barycentric);
        held.place = touch_state_.organ.point_to_organ(load3(state.place));
      }
      touch_state_.report.tell_grasp(t, held);
    }
  }
  void report_links() {
    for (std::int32_t i = 0; i < touch_state_.links.count(); ++i) {
      const Link& link = touch_state_.links.link(i);
      const palpate_link_condition now = link.state.condition;
      if (now == link.before) continue;
      const int e = link.given.ends[0].kind == PALPATE_END_SURFACE_POINT ? 0 : 1;
      const SurfacePoint place = surface_point_of(link.given.ends[e].triangle, link.given.ends[e].barycentric);
      touch_state_.report.tell_link(now == PALPATE_LINK_TAUT     ? PALPATE_EVENT_LINK_TAUT
                                    : now == PALPATE_LINK_BROKEN ? PALPATE_EVENT_LINK_BROKE
                                                                 : PALPATE_EVENT_LINK_SLACK,
                                    link.state.id, place, link.ends[e].at());
    }
  }

  // Q is the response of tissue under a tool on the surface, so it does not act on what a needle does.
  void add_needle(std::int32_t t) {
    const Tool& tool = touch_state_.input.tool(t);
    if (context_.def.force == PALPATE_FORCE_OFF || !is_finite(result_[t].needle_force)) return;
    result_[t].raw += -1 * result_[t].needle_force;
    if (tool.has_torque && is_finite(result_[t].needle_torque)) result_[t].raw_torque += -1 * result_[t].needle_torque;
  }
  static std::int32_t owner_of(const ContactConstraint& constraint) {
    return constraint.tool == kToolOfNeedles ? Needles::tool_of(constraint.point) : constraint.tool;
  }
  bool is_in_tissue(std::int32_t t) const { return has_needles(context_.def) && touch_state_.needles.is_in_tissue(t); }
  bool touches_organ(std::int32_t t) const {
    return result_[t].sum.contacts > 0 || (has_needles(context_.def) && touch_state_.needles.touches(t));
  }

  void write_torque(std::int32_t t, palpate_tool_state& state) {
    const Vec3 raw = touch_state_.organ.vector_to_world(result_[t].raw_torque);
    const palpate_scene_def& def = context_.def;
    store3(raw, state.torque_raw);
    store3(safe(t, raw, def.torque_limit, def.torque_slew, touch_state_.last_torque[t]), state.torque);
  }

  // m, in the organ's frame: from the tool's reference to where contact `number` of the tool acts.
  Vec3 lever(std::int32_t t, std::int32_t number) const {
    const Tool& tool = touch_state_.input.tool(t);
    return holder(tool, number) - touch_state_.organ.point_to_organ(tool.reference);
  }

  // After a fast retreat the relaxed part may exceed the elastic force and so pull the tool in: such a force is zero, unless the
  // tool holds the organ. Relaxation is linear in the force, so the torque, a sum of forces times levers, relaxes alike.
  void relax(std::int32_t t) {
    const Tool& tool = touch_state_.input.tool(t);
    const Vec3 elastic = result_[t].raw, elastic_torque = result_[t].raw_torque;
    if (!is_finite(elastic) || !is_finite(elastic_torque)) return;
    result_[t].raw = touch_state_.relaxation.step(touch_state_.memory[t], elastic, touch_state_.input.dt());
    if (tool.has_torque)
      result_[t].raw_torque =
          touch_state_.relaxation.step(touch_state_.torque_memory[t], elastic_torque, touch_state_.input.dt());
    if (is_in_tissue(t)) return;
    if (touches_organ(t) && (tool.hold || tool.has_grasp || !(dot(result_[t].raw, elastic) < 0))) return;
    result_[t].raw = result_[t].raw_torque = Vec3{};
  }

  // last: what was sent in the last step.
  Vec3 safe(std::int32_t t, Vec3 raw, double limit, double slew, Vec3& last) {
    std::uint32_t flags = 0;
    const Vec3 sent = within_limits(raw, limit, slew, touch_state_.input.dt(), &last, &flags);
    if (flags) raise(t, flags);
    return sent;
  }

  const StepContext& context_;
  TouchState& touch_state_;
  const ToolsInWorld* world_;
  palpate_contacts& out_;
  bool far_[PALPATE_MAX_TOOLS] = {};  // by place
  std::uint32_t flags_ = 0;
  // Of the places in use, which begin() resets: a step with one tool does not write those of all others.
  union {
    ToolResult result_[PALPATE_MAX_TOOLS];
  };
  DeformingBody::Outcome deformed_;
  const ContactConstraints* acting_ = nullptr;  // as the solver held them
  Operations unasked_ =
      0;  // of needles, links and grasps that close, which nothing puts off: counted when all else is done
};

}  // namespace

std::uint32_t touch_step(const StepContext& context, TouchState& state, const palpate_tool* tools,
                         std::int32_t tool_count, double dt, const ToolsInWorld* world, palpate_contacts& out) {
  Touch touch(context, state, world, out);
  touch.begin(tools, tool_count, dt);
  return touch.finish(nullptr);
}

void TouchStep::begin(const StepContext& context, TouchState& state, const palpate_tool* tools, std::int32_t tool_count,
                      double dt, const ToolsInWorld* world, palpate_contacts& out) {
  static_assert(sizeof(Touch) <= kBytes && alignof(Touch) <= 16 && std::is_trivially_destructible_v<Touch>);
  (new (touch_) Touch(context, state, world, out))->begin(tools, tool_count, dt);
}

bool TouchStep::slips() {
  return std::launder(reinterpret_cast<Touch*>(touch_))->grasps_slip();
}

std::uint32_t TouchStep::finish(const ContactSolver::Outcome* joint) {
  return std::launder(reinterpret_cast<Touch*>(touch_))->finish(joint);
}

LinkSurface link_surface_of(const palpate_scene_def& def, TouchState& state, std::int32_t triangles) {
  LinkSurface surface = {
      {state.rest, state.column_of_node, &state.surface, &state.measure, &state.patch}, state.triangles, triangles};
  if (def.contact != PALPATE_CONTACT_PATCH) surface.disc.measure = nullptr, surface.disc.patch = nullptr;
  return surface;
}

void reset_touch(const palpate_scene_def& def, TouchState& state) {
  state.input.forget();
  state.displacement.forget();
  if (follows_deformed_surface(def)) state.field.forget();
  state.tree.forget();
  state.collision.forget();
  state.slides.forget();
  if (watches_slide_energy(def)) state.slide_energy.forget();
  if (watches_body_energy(def)) state.body_energy.forget();
  state.work.forget();
  state.solver.forget();
  if (deforms_largely(def)) state.body.forget();
  if (deforms_beside(def)) state.beside.forget();
  if (uses_body_field(def)) state.body_field.forget();
  state.rows.forget();
  if (has_links(def)) state.links.forget();
  if (has_motions(def)) state.motions.forget();
  if (reports_contacts(def)) state.report.forget();
  state.step = 0;
  for (std::int32_t t = 0; t < def.max_tools; ++t) forget_tool(def, state, t);
}

void touch_restored(const StepContext& context, TouchState& state) {
  state.solver.restored(context.tensors);
  if (deforms_largely(context.def)) state.body.restored();
  if (deforms_beside(context.def)) state.beside.restored();
  state.displacement.restored(context.tensors);
  if (follows_deformed_surface(context.def)) state.field.restored(context.tensors, &state.solver);
}

void reset_tool(const palpate_scene_def& def, TouchState& state, std::int32_t id) {
  const std::int32_t t = state.input.place_of(id);
  if (t < 0) return;
  state.input.forget_input(t);
  forget_tool(def, state, t);
  if (reports_contacts(def)) state.report.forget_tool(t);
}

}  // namespace palpate
