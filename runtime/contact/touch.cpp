// The haptic half: tools -> collision -> contact rows -> solve -> forces -> palpate_contacts.
#include <algorithm>
#include <cmath>

#include "runtime/scene/scene.h"

namespace palpate {
namespace {

constexpr double kLongestSlew = 0.02;  // s of slew in one step: the period of the slowest loop that still feels

// What the step gathers per tool on the way.
struct ToolSum {
  Vec3 imposed;               // sum of the imposed displacements of its contacts, m
  double imposed_length = 0;  // sum of their lengths
  Vec3 resultant;             // of its linear nodal forces on the organ, N
  std::int32_t contacts = 0, slips = 0, releases = 0;
};

class Touch {
 public:
  Touch(palpate_scene& scene, palpate_contacts& out) : scene_(scene), half_(scene.touch), out_(out) {}

  std::uint32_t step(const palpate_tool* tools, std::int32_t tool_count, double dt) {
    flags_ = half_.input.take(tools, tool_count, dt);
    passed(scene_, Pass::input);
    if (scene_.def.collision != PALPATE_COLLISION_OFF) {
      for (std::int32_t t = 0; t < half_.input.count(); ++t) collide(t);
      forget_absent_points();
      passed(scene_, Pass::collision);
    }
    half_.rows.begin();
    for (std::int32_t t = 0; t < half_.input.count(); ++t) {
      if (scene_.def.collision != PALPATE_COLLISION_OFF) add_places(t);
      add_grips(t);
    }
    passed(scene_, Pass::rows);
    solve();
    passed(scene_, Pass::contact);
    if (scene_.def.force != PALPATE_FORCE_OFF) {
      for (std::int32_t t = 0; t < PALPATE_MAX_TOOLS; ++t) factor_[t] = tools_[t].contacts > 0 ? force_factor(t) : 0;
      passed(scene_, Pass::force);
    }
    for (std::int32_t t = 0; t < half_.input.count(); ++t) raw_[t] = -factor_[t] * tools_[t].resultant;
    if (kHasEffects && half_.memory) {
      for (std::int32_t t = 0; t < half_.input.count(); ++t) raw_[t] = relaxed(t, raw_[t]);
      passed(scene_, Pass::relaxation);
    }
    write_nodes();
    for (std::int32_t t = 0; t < PALPATE_MAX_TOOLS; ++t) write_tool(t);
    passed(scene_, Pass::output);
    if (scene_.bundle->is_lost()) flags_ |= PALPATE_STEP_BUNDLE_LOST;
    out_.flags = flags_;
    out_.step = ++half_.step;
    return flags_;
  }

 private:
  void raise(std::int32_t tool, std::uint32_t flag) {
    half_.input.tool(tool).flags |= flag;
    flags_ |= flag;
  }

  void collide(std::int32_t t) {
    Tool& tool = half_.input.tool(t);
    const bool follows =
        kHasEffects && (scene_.def.law == PALPATE_LAW_SLIDING || scene_.def.law == PALPATE_LAW_UNILATERAL);
    for (std::int32_t i = 0; i < tool.point_count; ++i) {
      PointState& state = half_.points[t][i];
      half_.collision.move(state, tool.points[i], t, i, tool.hold);
      if (!state.contact || !follows) continue;
      // A node contact moves a vertex, not the place: whose displacement would not say how far the tool has left it behind.
      if (scene_.def.contact == PALPATE_CONTACT_NODE)
        half_.collision.slide(state, state.pulled);
      else
        half_.collision.follow(state, tool.points[i], t, i);
    }
  }

  void add_places(std::int32_t t) {
    Tool& tool = half_.input.tool(t);
    const ContactLaw law = static_cast<ContactLaw>(scene_.def.law);
    for (std::int32_t i = 0; i < tool.point_count; ++i) {
      PointState& state = half_.points[t][i];
      if (!state.contact) continue;
      ContactWish wish;
      wish.tool = t, wish.point = i;
      wish.displacement = tool.points[i] - state.place_at_rest;
      wish.radius = tool.radius, wish.law = law, wish.friction = tool.friction;
      set_frame(wish, state.place, &state.tangent);
      hold_place(wish, state.place);
    }
  }

  // Which way is out at the place, and a direction across it that turns along with it.
  void set_frame(ContactWish& wish, const SurfacePlace& place, Vec3* tangent) {
    if (!needs_frame(scene_.def)) return;
    wish.outward = half_.measure.outward(place);
    if (length(wish.outward) == 0) wish.outward = half_.surface.outward(place.triangle);
    if (length(wish.outward) == 0) wish.outward = Vec3{0, 0, 1};
    wish.tangent = *tangent = across(wish.outward, *tangent);
  }

  void add_grips(std::int32_t t) {
    const Tool& tool = half_.input.tool(t);
    for (std::int32_t g = 0; g < tool.grip_count; ++g) {
      const palpate_grip& grip = tool.grips[g];
      ContactWish wish;
      wish.tool = t, wish.point = tool.point_count + g;
      wish.axes = grip.axes;
      for (int i = 0; i < 3; ++i) wish.displacement[i] = grip.axes >> i & 1u ? grip.displacement[i] : 0.0;
      if (grip.node >= 0) {
        bool made = false;
        const std::uint32_t flags = half_.rows.hold_node(wish, grip.node, &made);
        after_holding(wish, flags, made);
      } else {
        SurfacePlace place;
        place.triangle = grip.triangle;
        std::copy(grip.barycentric, grip.barycentric + 3, place.barycentric);
        Vec3 tangent;
        wish.radius = tool.radius;
        set_frame(wish, place, &tangent);
        hold_place(wish, place);
      }
    }
  }

  void hold_place(const ContactWish& wish, const SurfacePlace& place) {
    bool made = false;
    const std::uint32_t flags = half_.rows.hold_place(wish, place, &made);
    after_holding(wish, flags, made);
  }
  void after_holding(const ContactWish& wish, std::uint32_t flags, bool made) {
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
    for (std::int32_t t = 0; t < scene_.def.max_tools; ++t) {
      const std::int32_t present = t < half_.input.count() ? half_.input.tool(t).point_count : 0;
      for (std::int32_t i = present; i < scene_.def.max_points && half_.points[t][i].known; ++i)
        half_.points[t][i] = PointState{};
    }
  }

  void solve() {
    const ContactSet& set = half_.rows.set();
    const ContactSolver::Outcome outcome = half_.solver.solve(scene_.tensors, set, half_.force, half_.modified);
    std::uint32_t flag = 0;
    if (outcome == ContactSolver::Outcome::regularised) flag = PALPATE_STEP_REGULARISED;
    if (outcome == ContactSolver::Outcome::unsolved) flag = PALPATE_STEP_UNSOLVED;
    for (std::int32_t e = 0; e < set.entry_count; ++e) {
      const std::int32_t t = set.entries[e].tool;
      if (flag) raise(t, flag);
      tools_[t].resultant += half_.force[e];
    }
    if (kHasEffects && scene_.def.collision == PALPATE_COLLISION_DEFORMED)
      half_.field.set(scene_.tensors, set, half_.modified, &half_.solver);
    if (kHasEffects && scene_.def.law >= PALPATE_LAW_UNILATERAL && outcome != ContactSolver::Outcome::unsolved) slip();
  }

  // Places that slipped, or that nothing holds, come along by as much as the tool has left them behind. A triangle's three
  // vertices rub each for itself: its place sticks as long as one of them does.
  void slip() {
    const ContactSet& set = half_.rows.set();
    for (std::int32_t p = 0, end = 0; p < set.block_count; p = end) {
      const ContactBlock& first = set.blocks[p];
      bool sticks = false;
      for (; end < set.block_count && set.blocks[end].tool == first.tool && set.blocks[end].point == first.point; ++end)
        sticks = !gives_way(end) || sticks;
      if (first.law != ContactLaw::coulomb || sticks) continue;
      PointState& state = half_.points[first.tool][first.point];
      Vec3 along;
      for (std::int32_t part = p; part < end; ++part) along += left_behind(part);
      half_.collision.slide(state, state.place_at_rest + along);
    }
  }
  bool gives_way(std::int32_t p) {
    const ContactBlock& block = half_.rows.set().blocks[p];
    if (block.law != ContactLaw::unilateral && block.law != ContactLaw::coulomb) return false;
    const Vec3 r = half_.solver.reaction(p);
    const bool released = !(r.x > 0), slipped = slips(block, r);
    tools_[block.tool].releases += released;
    tools_[block.tool].slips += slipped && !released;
    return released || slipped;
  }
  // Across the normal, the block's share of its place.
  Vec3 left_behind(std::int32_t p) const {
    const ContactBlock& block = half_.rows.set().blocks[p];
    const Vec3 missed = half_.solver.missed(half_.rows.set(), p);
    Vec3 along;
    for (int i = 1; i < 3; ++i)
      along += -block.share * missed[i] * Vec3{block.frame.m[i][0], block.frame.m[i][1], block.frame.m[i][2]};
    return along;
  }
  static bool slips(const ContactBlock& block, Vec3 r) {
    constexpr double rounding = 1e-9;
    return block.law == ContactLaw::coulomb && length({0, r.y, r.z}) >= block.friction * r.x * (1 - rounding);
  }

  // d_t; zero where the imposed displacements cancel.
  Vec3 direction(std::int32_t t) const {
    const ToolSum& sum = tools_[t];
    return length(sum.imposed) > 1e-9 * sum.imposed_length ? unit_or_zero(sum.imposed) : Vec3{};
  }

  // Factor on all nodal forces of the tool. Response: its resultant along d_t becomes Q of itself (eqs 3-6).
  double force_factor(std::int32_t t) {
    if (!kHasEffects || scene_.def.force == PALPATE_FORCE_LINEAR) return 1;
    const double along = dot(tools_[t].resultant, direction(t));
    if (half_.response.outside(along)) raise(t, PALPATE_STEP_RESPONSE_RANGE);
    return half_.response.ratio(along);
  }

  void write_nodes() {
    palpate_contact_node* node = reinterpret_cast<palpate_contact_node*>(&out_ + 1);
    const ContactSet& set = half_.rows.set();
    for (std::int32_t e = 0; e < set.entry_count; ++e, ++node) {
      const ContactEntry& entry = set.entries[e];
      node->node = entry.node, node->column = entry.column, node->tool = entry.tool, node->point = entry.point;
      store3(half_.modified[e], node->modified_displacement);
      // A response may be so steep that it takes a force beyond all numbers.
      const Vec3 force = factor_[entry.tool] * half_.force[e];
      if (!is_finite(force)) raise(entry.tool, PALPATE_STEP_UNSOLVED);
      store3(is_finite(force) ? force : Vec3{}, node->force);
    }
    out_.node_count = set.entry_count;
    out_.node_capacity = scene_.def.max_contact_nodes;
    out_.tool_count = half_.input.count();
    out_.sweeps = half_.solver.residual().sweeps;
    out_.residual_displacement = half_.solver.residual().displacement;
    out_.residual_force = half_.solver.residual().force;
    out_.used_bytes = static_cast<std::uint32_t>(sizeof(palpate_contacts) + static_cast<std::size_t>(out_.node_count) *
                                                                                sizeof(palpate_contact_node));
  }

  void write_tool(std::int32_t t) {
    palpate_tool_state& state = out_.tools[t];
    state = palpate_tool_state{};
    if (t >= half_.input.count()) {
      half_.last_force[t] = Vec3{};
      if (half_.memory && t < scene_.def.max_tools) half_.memory[t] = PronySeries::Memory{};
      return;
    }
    store3(raw_[t], state.force_raw);
    store3(safe_force(t, raw_[t]), state.force);
    store3(direction(t), state.direction);
    state.contact_count = tools_[t].contacts;
    state.slip_count = tools_[t].slips;
    state.release_count = tools_[t].releases;
    state.flags = half_.input.tool(t).flags;
  }

  // The force after its relaxation. What is left of a push may not pull, unless the tool holds.
  Vec3 relaxed(std::int32_t t, Vec3 elastic) {
    if (!is_finite(elastic)) return elastic;
    const Vec3 force = half_.relaxation.step(half_.memory[t], elastic, half_.input.dt());
    if (tools_[t].contacts == 0) return Vec3{};
    return !half_.input.tool(t).hold && dot(force, elastic) < 0 ? Vec3{} : force;
  }

  // What a device may be sent: no longer than force_limit, no faster than force_slew. A clock that claims a long time, or a
  // loop that stood still, does not buy a jump.
  Vec3 safe_force(std::int32_t t, Vec3 raw) {
    const palpate_scene_def& def = scene_.def;
    Vec3& last = half_.last_force[t];
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
    const double most = def.force_slew * std::min(half_.input.dt(), kLongestSlew);
    if (const double size = length(change); size > most) {
      force = last + (most / size) * change;
      raise(t, PALPATE_STEP_FORCE_LIMITED);
    }
    return last = force;
  }

  palpate_scene& scene_;
  TouchHalf& half_;
  palpate_contacts& out_;
  std::uint32_t flags_ = 0;
  ToolSum tools_[PALPATE_MAX_TOOLS];
  double factor_[PALPATE_MAX_TOOLS] = {};  // on each tool's nodal forces
  Vec3 raw_[PALPATE_MAX_TOOLS];            // force on each tool, N, before the limits
};

}  // namespace
}  // namespace palpate

size_t palpate_contacts_bytes(const palpate_scene* scene) {
  if (!scene) return sizeof(palpate_contacts);
  return sizeof(palpate_contacts) + static_cast<size_t>(scene->def.max_contact_nodes) * sizeof(palpate_contact_node);
}

const palpate_contact_node* palpate_contacts_nodes(const palpate_contacts* contacts) {
  return reinterpret_cast<const palpate_contact_node*>(contacts + 1);
}

palpate_step_flags palpate_touch(palpate_scene* scene, const palpate_tool* tools, int32_t tool_count, double dt,
                                 palpate_contacts* contacts) {
  if (!scene || !contacts || !palpate::is_aligned(contacts)) return PALPATE_STEP_BAD_INPUT;
  return palpate::Touch(*scene, *contacts).step(tools, tool_count, dt);
}

void palpate_reset(palpate_scene* scene) {
  if (!scene) return;
  palpate::TouchHalf& half = scene->touch;
  half.input.forget();
  half.field.clear();
  half.solver.forget();
  half.rows.forget();
  if (half.memory)
    for (std::int32_t t = 0; t < scene->def.max_tools; ++t) half.memory[t] = palpate::PronySeries::Memory{};
  half.step = 0;
  for (std::int32_t t = 0; t < PALPATE_MAX_TOOLS; ++t) {
    half.last_force[t] = palpate::Vec3{};
    if (!half.points[t]) continue;
    for (std::int32_t i = 0; i < scene->def.max_points; ++i) half.points[t][i] = palpate::PointState{};
  }
}
