// The touch half, in order: input, collision, contact constraints, solve, force corrections, limits, output.
#include "runtime/contact/touch.h"
#include "runtime/base/contact_nodes.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// s, the longest time over which one step may change a force at force_slew. A haptic loop slower than 50 Hz does not feel
// like contact, so a longer time is a loop that stood still.
constexpr double kLongestSlew = 0.02;

// Forgets the points of the tool in place t from number `first` on. Those that are known come first.
void forget_points(const palpate_scene_def& def, TouchState& state, std::int32_t t, std::int32_t first) {
  if (!state.points[t]) return;
  for (std::int32_t i = first; i < def.max_points && state.points[t][i].known; ++i) state.points[t][i] = PointState{};
}

// Forgets what the steps so far have left about the tool in place t: the state before its first step.
void forget_tool(const palpate_scene_def& def, TouchState& state, std::int32_t t) {
  forget_points(def, state, t, 0);
  state.last_force[t] = Vec3{};
  if (state.memory) state.memory[t] = PronySeries::Memory{};
}

// Sums over one tool's contacts in this step.
struct ToolSum {
  Vec3 imposed;               // m, of their imposed displacements
  double imposed_length = 0;  // m, of those displacements' lengths
  Vec3 resultant;             // N, of the linear nodal forces on the organ
  std::int32_t contacts = 0, slips = 0, releases = 0;
};

class Touch {
 public:
  Touch(const StepContext& context, TouchState& state, palpate_contacts& out)
      : context_(context), touch_state_(state), out_(out) {}

  std::uint32_t step(const palpate_tool* tools, std::int32_t tool_count, double dt) {
    flags_ = touch_state_.input.take(tools, tool_count, dt);
    for (std::int32_t t = 0; t < context_.def.max_tools; ++t)
      if (touch_state_.input.tool(t).is_new || touch_state_.input.tool(t).index < 0)
        forget_tool(context_.def, touch_state_, t);
    context_.watch.ended(Pass::input);
    if (context_.def.collision != PALPATE_COLLISION_OFF) {
      touch_state_.collision.begin();
      for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) collide(t);
      if (touch_state_.collision.has_deferred()) flags_ |= PALPATE_STEP_WORK_DEFERRED;
      forget_absent_points();
      context_.watch.ended(Pass::collision);
    }
    touch_state_.rows.begin();
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) {
      if (context_.def.collision != PALPATE_COLLISION_OFF) request_point_contacts(t);
      request_grip_contacts(t);
    }
    context_.watch.ended(Pass::rows);
    solve();
    context_.watch.ended(Pass::contact);
    if (context_.def.force != PALPATE_FORCE_OFF) {
      for (std::int32_t t = 0; t < PALPATE_MAX_TOOLS; ++t) factor_[t] = tools_[t].contacts > 0 ? force_factor(t) : 0;
      context_.watch.ended(Pass::force);
    }
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) raw_[t] = -factor_[t] * tools_[t].resultant;
    if (relaxes(context_.def)) {
      for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) raw_[t] = relaxed(t, raw_[t]);
      context_.watch.ended(Pass::relaxation);
    }
    write_nodes();
    for (std::int32_t t = 0; t < touch_state_.input.count(); ++t) write_tool(t);
    context_.watch.ended(Pass::output);
    if (context_.bundle.is_lost()) flags_ |= PALPATE_STEP_BUNDLE_LOST;
    out_.flags = flags_;
    out_.step = ++touch_state_.step;
    return flags_;
  }

 private:
  void raise(std::int32_t tool, std::uint32_t flag) {
    touch_state_.input.tool(tool).flags |= flag;
    flags_ |= flag;
  }

  void collide(std::int32_t t) {
    Tool& tool = touch_state_.input.tool(t);
    const bool follows = anchors_follow_tools(context_.def);
    const TrackingLimits limits = {context_.def.max_tool_speed * touch_state_.input.dt(),
                                   touch_state_.release_distance};
    for (std::int32_t i = 0; i < tool.point_count; ++i) {
      PointState& state = touch_state_.points[t][i];
      if (!touch_state_.collision.move(state, tool.points[i], t, i, tool.hold, limits))
        raise(t, PALPATE_STEP_TRACKING_LOST);
      if (!state.contact || !follows) continue;
      // A node contact moves the nearest vertex, not the anchor. The anchor's displacement then does not measure how far the
      // tool has slid past it, so the tool's own position decides.
      if (context_.def.contact == PALPATE_CONTACT_NODE)
        touch_state_.collision.slide(state, state.pulled);
      else
        touch_state_.collision.follow(state, tool.points[i], t, i);
    }
  }

  void request_point_contacts(std::int32_t t) {
    Tool& tool = touch_state_.input.tool(t);
    const ContactLaw law = static_cast<ContactLaw>(context_.def.law);
    for (std::int32_t i = 0; i < tool.point_count; ++i) {
      PointState& state = touch_state_.points[t][i];
      if (!state.contact) continue;
      ContactWish wish;
      wish.tool = t, wish.point = i;
      wish.displacement = tool.points[i] - state.anchor_at_rest;
      wish.disc_radius = tool.disc_radius, wish.law = law, wish.friction = tool.friction;
      set_frame(wish, state.anchor, &state.tangent);
      request_contact(wish, state.anchor);
    }
  }

  // The outward normal at a surface point, and a tangent that turns with the normal from step to step.
  void set_frame(ContactWish& wish, const SurfacePoint& surface_point, Vec3* tangent) {
    if (!needs_contact_frames(context_.def)) return;
    wish.outward = touch_state_.measure.outward(surface_point);
    if (length(wish.outward) == 0) wish.outward = touch_state_.surface.outward(surface_point.triangle);
    if (length(wish.outward) == 0) wish.outward = Vec3{0, 0, 1};
    wish.tangent = *tangent = across(wish.outward, *tangent);
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
        const std::uint32_t flags = touch_state_.rows.add_node(wish, grip.node, &made);
        record_contact(wish, flags, made);
      } else {
        SurfacePoint surface_point;
        surface_point.triangle = grip.triangle;
        std::copy(grip.barycentric, grip.barycentric + 3, surface_point.barycentric);
        Vec3 tangent;
        wish.disc_radius = tool.disc_radius;
        set_frame(wish, surface_point, &tangent);
        request_contact(wish, surface_point);
      }
    }
  }

  void request_contact(const ContactWish& wish, const SurfacePoint& surface_point) {
    bool made = false;
    const std::uint32_t flags = touch_state_.rows.add_contact(wish, surface_point, &made);
    record_contact(wish, flags, made);
  }
  void record_contact(const ContactWish& wish, std::uint32_t flags, bool made) {
    if (flags) raise(wish.tool, flags);
    if (made) count_contact(wish.tool, wish.displacement);
  }

  void count_contact(std::int32_t t, Vec3 displacement) {
    tools_[t].imposed += displacement;
    tools_[t].imposed_length += length(displacement);
    ++tools_[t].contacts;
  }

  // A point that was not sent this step starts afresh when it comes back.
  void forget_absent_points() {
    for (std::int32_t t = 0; t < context_.def.max_tools; ++t)
      forget_points(context_.def, touch_state_, t, touch_state_.input.tool(t).point_count);
  }

  void solve() {
    const ContactConstraints& set = touch_state_.rows.set();
    const ContactSolver::Outcome outcome =
        touch_state_.solver.solve(context_.tensors, set, touch_state_.force, touch_state_.modified);
    std::uint32_t flag = 0;
    if (outcome == ContactSolver::Outcome::regularised) flag = PALPATE_STEP_REGULARISED;
    if (outcome == ContactSolver::Outcome::unsolved) flag = PALPATE_STEP_UNSOLVED;
    for (std::int32_t e = 0; e < set.node_count; ++e) {
      const std::int32_t t = set.nodes[e].tool;
      if (flag) raise(t, flag);
      tools_[t].resultant += touch_state_.force[e];
    }
    if (follows_deformed_surface(context_.def)) {
      Operations work = 0;
      if (outcome == ContactSolver::Outcome::unsolved)
        touch_state_.field.set_rest();
      else
        touch_state_.field.set(context_.tensors, set, touch_state_.force, touch_state_.modified, &touch_state_.solver,
                               &work);
    }
    if (contacts_may_give_way(context_.def) && outcome != ContactSolver::Outcome::unsolved) move_slipped_anchors();
  }

  // COULOMB: where a contact slipped or released, moves its anchor to where the tool has gone relative to the surface. A
  // triangle contact has three constraints with friction of their own: its anchor sticks as long as one of them sticks.
  void move_slipped_anchors() {
    const ContactConstraints& set = touch_state_.rows.set();
    for (std::int32_t p = 0, end = 0; p < set.constraint_count; p = end) {
      const ContactConstraint& first = set.constraints[p];
      bool sticks = false;
      for (; end < set.constraint_count && set.constraints[end].tool == first.tool &&
             set.constraints[end].point == first.point;
           ++end)
        sticks = !gives_way(end) || sticks;
      if (first.law != ContactLaw::coulomb || sticks) continue;
      PointState& state = touch_state_.points[first.tool][first.point];
      Vec3 along;
      for (std::int32_t part = p; part < end; ++part) along += left_behind(part);
      touch_state_.collision.slide(state, state.anchor_at_rest + along);
    }
  }
  bool gives_way(std::int32_t p) {
    const ContactConstraint& constraint = touch_state_.rows.set().constraints[p];
    if (constraint.law != ContactLaw::unilateral && constraint.law != ContactLaw::coulomb) return false;
    const Vec3 r = touch_state_.solver.reaction(p);
    const bool released = !(r.x > 0), slipped = slips(constraint, r);
    tools_[constraint.tool].releases += released;
    tools_[constraint.tool].slips += slipped && !released;
    return released || slipped;
  }
  // m, across the normal: how far the tool has moved past the anchor, times the constraint's share in it.
  Vec3 left_behind(std::int32_t p) const {
    const ContactConstraint& constraint = touch_state_.rows.set().constraints[p];
    const Vec3 missed = touch_state_.solver.missed(touch_state_.rows.set(), p);
    Vec3 along;
    for (int i = 1; i < 3; ++i)
      along += -constraint.share * missed[i] *
               Vec3{constraint.frame.m[i][0], constraint.frame.m[i][1], constraint.frame.m[i][2]};
    return along;
  }
  static bool slips(const ContactConstraint& constraint, Vec3 r) {
    constexpr double rounding = 1e-9;
    return constraint.law == ContactLaw::coulomb && length({0, r.y, r.z}) >= constraint.friction * r.x * (1 - rounding);
  }

  // d_t of eqs 3-6: unit direction of the tool's imposed motion; zero where its displacements cancel up to rounding.
  Vec3 direction(std::int32_t t) const {
    const ToolSum& sum = tools_[t];
    return length(sum.imposed) > 1e-9 * sum.imposed_length ? unit_or_zero(sum.imposed) : Vec3{};
  }

  // The factor on all nodal forces of the tool. With RESPONSE the component F of their resultant along d_t becomes Q(F)
  // (eqs 3-6). Q acts on the resultant, not node by node: Q is not additive, so the nodal way would depend on the mesh.
  double force_factor(std::int32_t t) {
    if (!corrects_force(context_.def)) return 1;
    const double along = dot(tools_[t].resultant, direction(t));
    if (touch_state_.response.outside(along)) raise(t, PALPATE_STEP_RESPONSE_RANGE);
    return touch_state_.response.ratio(along);
  }

  void write_nodes() {
    const ContactConstraints& set = touch_state_.rows.set();
    lay_out_contacts(out_, touch_state_.input.sent(), set.node_count);
    palpate_contact_node* node = nodes_behind(out_);
    for (std::int32_t e = 0; e < set.node_count; ++e, ++node) {
      const ContactNode& held = set.nodes[e];
      node->node = held.node, node->column = held.column, node->point = held.point;
      node->tool = touch_state_.input.tool(held.tool).index;
      store3(touch_state_.modified[e], node->modified_displacement);
      // A steep response may turn a finite force into an infinite one.
      const Vec3 force = factor_[held.tool] * touch_state_.force[e];
      if (!is_finite(force)) raise(held.tool, PALPATE_STEP_UNSOLVED);
      store3(is_finite(force) ? force : Vec3{}, node->force);
    }
    out_.bundle = context_.bundle.index.header.index_checksum;
    out_.node_capacity = context_.def.max_contact_nodes;
    out_.sweeps = touch_state_.solver.residual().sweeps;
    out_.residual_displacement = touch_state_.solver.residual().displacement;
    out_.residual_force = touch_state_.solver.residual().force;
  }

  void write_tool(std::int32_t t) {
    const Tool& tool = touch_state_.input.tool(t);
    if (tool.index < 0) return;
    palpate_tool_state& state = tools_behind(out_)[tool.index];
    state = palpate_tool_state{};
    state.id = tool.id;
    store3(raw_[t], state.force_raw);
    store3(safe_force(t, raw_[t]), state.force);
    store3(direction(t), state.direction);
    state.contact_count = tools_[t].contacts;
    state.slip_count = tools_[t].slips;
    state.release_count = tools_[t].releases;
    state.flags = tool.flags;
  }

  // The relaxed force. After a fast retreat the relaxed part may exceed the elastic force and so pull the tool in: such a
  // force is zero, unless the tool holds the organ.
  Vec3 relaxed(std::int32_t t, Vec3 elastic) {
    if (!is_finite(elastic)) return elastic;
    const Vec3 force = touch_state_.relaxation.step(touch_state_.memory[t], elastic, touch_state_.input.dt());
    if (tools_[t].contacts == 0) return Vec3{};
    return !touch_state_.input.tool(t).hold && dot(force, elastic) < 0 ? Vec3{} : force;
  }

  // The force for a haptic device: at most force_limit long, changing by at most force_slew per second. A long dt (a wrong
  // clock, or a loop that stood still) allows no larger change than kLongestSlew.
  Vec3 safe_force(std::int32_t t, Vec3 raw) {
    const palpate_scene_def& def = context_.def;
    Vec3& last = touch_state_.last_force[t];
    if (!is_finite(raw)) {
      raise(t, PALPATE_STEP_UNSOLVED);
      raw = Vec3{};
    }
    Vec3 force = raw;
    if (const double size = length(force); size > def.force_limit) {
      force = (def.force_limit / size) * force;
      raise(t, PALPATE_STEP_FORCE_LIMITED);
    }
    const Vec3 change = force - last;
    const double most = def.force_slew * std::min(touch_state_.input.dt(), kLongestSlew);
    if (const double size = length(change); size > most) {
      force = last + (most / size) * change;
      raise(t, PALPATE_STEP_FORCE_LIMITED);
    }
    return last = force;
  }

  const StepContext& context_;
  TouchState& touch_state_;
  palpate_contacts& out_;
  std::uint32_t flags_ = 0;
  ToolSum tools_[PALPATE_MAX_TOOLS];
  double factor_[PALPATE_MAX_TOOLS] = {};  // on each tool's linear nodal forces
  Vec3 raw_[PALPATE_MAX_TOOLS];            // N, force on each tool before the limits
};

}  // namespace

std::uint32_t touch_step(const StepContext& context, TouchState& state, const palpate_tool* tools,
                         std::int32_t tool_count, double dt, palpate_contacts& out) {
  return Touch(context, state, out).step(tools, tool_count, dt);
}

void reset_touch(const palpate_scene_def& def, TouchState& state) {
  state.input.forget();
  if (follows_deformed_surface(def)) state.field.forget();
  state.tree.forget();
  state.collision.forget();
  state.solver.forget();
  state.rows.forget();
  state.step = 0;
  for (std::int32_t t = 0; t < def.max_tools; ++t) forget_tool(def, state, t);
}

void reset_tool(const palpate_scene_def& def, TouchState& state, std::int32_t id) {
  const std::int32_t t = state.input.place_of(id);
  if (t < 0) return;
  state.input.forget_input(t);
  forget_tool(def, state, t);
}

}  // namespace palpate
