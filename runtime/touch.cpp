// The haptic half: tools -> collision -> contact rows -> solve -> forces -> palpate_contacts.
#include <algorithm>
#include <cmath>

#include "runtime/scene.h"

namespace palpate {
namespace {

constexpr double kLongestSlew = 0.02;  // s of slew in one step: the period of the slowest loop that still feels

// What the step gathers per tool on the way.
struct ToolSum {
  Vec3 imposed;               // sum of the imposed displacements of its contacts, m
  double imposed_length = 0;  // sum of their lengths
  Vec3 resultant;             // of its linear nodal forces on the organ, N
  std::int32_t contacts = 0;
};

class Touch {
 public:
  Touch(palpate_scene& scene, palpate_contacts& out) : scene_(scene), half_(scene.touch), out_(out) {}

  std::uint32_t step(const palpate_tool* tools, std::int32_t tool_count, double dt) {
    flags_ = half_.input.take(tools, tool_count, dt);
    half_.set.entry_count = half_.set.block_count = 0;
    for (std::int32_t t = 0; t < half_.input.count(); ++t) {
      if (scene_.def.collision != PALPATE_COLLISION_OFF) collide(t);
      add_grips(t);
    }
    forget_absent_points();
    solve();
    write_nodes();
    for (std::int32_t t = 0; t < PALPATE_MAX_TOOLS; ++t) write_tool(t);
    if (scene_.bundle->lost.load(std::memory_order_relaxed)) flags_ |= PALPATE_STEP_BUNDLE_LOST;
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
    for (std::int32_t i = 0; i < tool.point_count; ++i) {
      PointState& state = half_.points[t][i];
      half_.collision.move(state, tool.points[i], t, i, tool.hold);
      if (state.contact) add_place(t, i, state.place, tool.points[i] - state.place_at_rest, 7);
    }
  }

  void add_grips(std::int32_t t) {
    const Tool& tool = half_.input.tool(t);
    for (std::int32_t g = 0; g < tool.grip_count; ++g) {
      const palpate_grip& grip = tool.grips[g];
      Vec3 displacement;
      for (int i = 0; i < 3; ++i) displacement[i] = grip.axes >> i & 1u ? grip.displacement[i] : 0.0;
      const std::int32_t point = tool.point_count + g;
      if (grip.node >= 0) {
        const double whole[1] = {1};
        if (half_.column_of_node[grip.node] < 0)
          raise(t, PALPATE_STEP_NOT_TOUCHABLE);
        else
          add_contact(t, point, &grip.node, whole, 1, displacement, grip.axes);
      } else {
        SurfacePlace place;
        place.triangle = grip.triangle;
        std::copy(grip.barycentric, grip.barycentric + 3, place.barycentric);
        add_place(t, point, place, displacement, grip.axes);
      }
    }
  }

  // A place in a triangle, held by the scene's contact model. Vertices without a tensor column give their weight to the
  // others, so that the weights still sum to one and the force stays bounded near a fixed border.
  void add_place(std::int32_t t, std::int32_t point, const SurfacePlace& place, Vec3 displacement, std::uint32_t axes) {
    std::int32_t node[3];
    double weight[3];
    int count = 0;
    for (int v = 0; v < 3; ++v) {
      const std::int32_t n = half_.triangles[3 * place.triangle + v];
      if (half_.column_of_node[n] < 0) {
        if (place.barycentric[v] != 0) raise(t, PALPATE_STEP_NOT_TOUCHABLE);
        continue;
      }
      node[count] = n, weight[count++] = place.barycentric[v];
    }
    if (count == 0) return;
    double sum = 0;
    for (int v = 0; v < count; ++v) sum += weight[v] = std::max(0.0, weight[v]);
    for (int v = 0; v < count; ++v) weight[v] = sum > 0 ? weight[v] / sum : 1.0 / count;

    if (scene_.def.contact == PALPATE_CONTACT_NODE) {
      const int v = nearest_vertex(place, node, weight, count);
      const double whole[1] = {1};
      add_contact(t, point, &node[v], whole, 1, displacement, axes);
    } else if (scene_.def.contact == PALPATE_CONTACT_POINT) {
      int used = 0;
      for (int v = 0; v < count; ++v)
        if (weight[v] > 0) node[used] = node[v], weight[used++] = weight[v];
      add_contact(t, point, node, weight, used, displacement, axes);
    } else {
      add_triangle(t, point, node, weight, count, displacement, axes);
    }
  }

  // The vertex nearest to the place; without positions (grips alone), the one of largest weight.
  int nearest_vertex(const SurfacePlace& place, const std::int32_t* node, const double* weight, int count) const {
    int best = 0;
    double least = INFINITY;
    for (int v = 0; v < count; ++v) {
      double distance = -weight[v];
      if (half_.rest) distance = length(load3(half_.rest + 3 * node[v]) - half_.surface.at(place));
      if (distance < least) least = distance, best = v;
    }
    return best;
  }

  // The paper's three vertices, each imposed alpha_v d: then the place moves by sum_v k_v alpha_v d = d.
  void add_triangle(std::int32_t t, std::int32_t point, const std::int32_t* node, const double* k, int count,
                    Vec3 displacement, std::uint32_t axes) {
    if (!has_room(count, count)) return raise(t, PALPATE_STEP_CONTACTS_DROPPED);
    double squares = 0;
    for (int v = 0; v < count; ++v) squares += k[v] * k[v];
    for (int v = 0; v < count; ++v) {
      const double whole[1] = {1};
      add_block(t, point, v, node + v, whole, 1, (k[v] + 1 - squares) * displacement, axes);
    }
    count_contact(t, displacement);
  }

  bool has_room(std::int32_t blocks, std::int32_t entries) const {
    const ContactSet& set = half_.set;
    return set.block_count + blocks <= set.block_capacity && set.entry_count + entries <= set.entry_capacity;
  }

  void add_contact(std::int32_t t, std::int32_t point, const std::int32_t* node, const double* weight, int count,
                   Vec3 displacement, std::uint32_t axes) {
    if (!has_room(1, count)) return raise(t, PALPATE_STEP_CONTACTS_DROPPED);
    add_block(t, point, 0, node, weight, count, displacement, axes);
    count_contact(t, displacement);
  }

  void add_block(std::int32_t t, std::int32_t point, std::int32_t part, const std::int32_t* node, const double* weight,
                 int count, Vec3 target, std::uint32_t axes) {
    ContactSet& set = half_.set;
    ContactBlock& block = set.blocks[set.block_count];
    block = ContactBlock{};
    block.first_entry = set.entry_count, block.entry_count = count, block.axes = axes;
    block.tool = t, block.point = point, block.part = part;
    set.target[set.block_count++] = target;
    for (int v = 0; v < count; ++v)
      set.entries[set.entry_count++] = ContactEntry{node[v], half_.column_of_node[node[v]], t, point, weight[v]};
  }

  void count_contact(std::int32_t t, Vec3 displacement) {
    tools_[t].imposed += displacement;
    tools_[t].imposed_length += length(displacement);
    ++tools_[t].contacts;
  }

  // A point that was not sent this step starts afresh when it comes back.
  void forget_absent_points() {
    if (scene_.def.collision == PALPATE_COLLISION_OFF) return;
    for (std::int32_t t = 0; t < scene_.def.max_tools; ++t) {
      const std::int32_t present = t < half_.input.count() ? half_.input.tool(t).point_count : 0;
      for (std::int32_t i = present; i < scene_.def.max_points && half_.points[t][i].known; ++i)
        half_.points[t][i] = PointState{};
    }
  }

  void solve() {
    const ContactSolver::Outcome outcome = half_.solver.solve(scene_.tensors, half_.set, half_.force, half_.modified);
    std::uint32_t flag = 0;
    if (outcome == ContactSolver::Outcome::regularised) flag = PALPATE_STEP_REGULARISED;
    if (outcome == ContactSolver::Outcome::unsolved) flag = PALPATE_STEP_UNSOLVED;
    for (std::int32_t e = 0; e < half_.set.entry_count; ++e) {
      const std::int32_t t = half_.set.entries[e].tool;
      if (flag) raise(t, flag);
      tools_[t].resultant += half_.force[e];
    }
    if (scene_.def.collision == PALPATE_COLLISION_DEFORMED) half_.field.set(scene_.tensors, half_.set, half_.modified);
  }

  // d_t; zero where the imposed displacements cancel.
  Vec3 direction(std::int32_t t) const {
    const ToolSum& sum = tools_[t];
    return length(sum.imposed) > 1e-9 * sum.imposed_length ? unit_or_zero(sum.imposed) : Vec3{};
  }

  // Factor on all nodal forces of the tool. Response: its resultant along d_t becomes Q of itself (eqs 3-6).
  double force_factor(std::int32_t t) {
    if (scene_.def.force == PALPATE_FORCE_OFF) return 0;
    if (scene_.def.force == PALPATE_FORCE_LINEAR) return 1;
    const double along = dot(tools_[t].resultant, direction(t));
    if (half_.response.outside(along)) raise(t, PALPATE_STEP_RESPONSE_RANGE);
    return half_.response.ratio(along);
  }

  void write_nodes() {
    for (std::int32_t t = 0; t < PALPATE_MAX_TOOLS; ++t) factor_[t] = tools_[t].contacts > 0 ? force_factor(t) : 0;
    palpate_contact_node* node = reinterpret_cast<palpate_contact_node*>(&out_ + 1);
    for (std::int32_t e = 0; e < half_.set.entry_count; ++e, ++node) {
      const ContactEntry& entry = half_.set.entries[e];
      node->node = entry.node, node->column = entry.column, node->tool = entry.tool, node->point = entry.point;
      store3(half_.modified[e], node->modified_displacement);
      store3(factor_[entry.tool] * half_.force[e], node->force);
    }
    out_.node_count = half_.set.entry_count;
    out_.node_capacity = scene_.def.max_contact_nodes;
    out_.tool_count = half_.input.count();
    out_.reserved = 0;
    out_.used_bytes = static_cast<std::uint32_t>(sizeof(palpate_contacts) + static_cast<std::size_t>(out_.node_count) *
                                                                                sizeof(palpate_contact_node));
  }

  void write_tool(std::int32_t t) {
    palpate_tool_state& state = out_.tools[t];
    state = palpate_tool_state{};
    if (t >= half_.input.count()) {
      half_.last_force[t] = Vec3{};
      return;
    }
    const Vec3 raw = -factor_[t] * tools_[t].resultant;
    store3(raw, state.force_raw);
    store3(safe_force(t, raw), state.force);
    store3(direction(t), state.direction);
    state.contact_count = tools_[t].contacts;
    state.flags = half_.input.tool(t).flags;
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
  double factor_[PALPATE_MAX_TOOLS] = {};
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
  half.step = 0;
  for (std::int32_t t = 0; t < PALPATE_MAX_TOOLS; ++t) {
    half.last_force[t] = palpate::Vec3{};
    if (!half.points[t]) continue;
    for (std::int32_t i = 0; i < scene->def.max_points; ++i) half.points[t][i] = palpate::PointState{};
  }
}
