#include "runtime/contact/contact_rows.h"

#include <algorithm>
#include <utility>

#include "runtime/contact/thinned_disc.h"

namespace palpate {
namespace {

// A thinned disc is as good as the whole one where the nodes that it keeps carried this share of its weight.
constexpr double kFaithful = 0.95;

// Of the weights, for a disc whose law is along its own normal. Over a rim it keeps this law as its parts leave the surface: with another one
// there, it would go to and fro between the two.
constexpr double kMostly = 0.5;

// rad, and the tangent of an angle: how far the normal of a disc's law turns at least in a step, and at most from that at rest.
constexpr double kSteady = 1e-4, kMostLean = 1;

}  // namespace

bool ContactRows::create_set(SceneMemory& memory, std::int32_t nodes, std::int32_t constraints,
                             ContactConstraints* set) {
  set->nodes = memory.array<ContactNode>(static_cast<std::size_t>(nodes));
  set->constraints = memory.array<ContactConstraint>(static_cast<std::size_t>(constraints));
  set->target = memory.array<Vec3>(static_cast<std::size_t>(constraints));
  if (source_.slides) {
    set->place = memory.array<DiscPlace>(static_cast<std::size_t>(constraints));
    set->slope = memory.array<Vec3>(static_cast<std::size_t>(nodes));
  }
  set->node_capacity = nodes, set->constraint_capacity = constraints;
  return !memory.failed();
}

bool ContactRows::create(SceneMemory& memory, const Source& source, std::int32_t node_capacity,
                         std::int32_t constraint_capacity) {
  source_ = source;
  if (source.patch) {  // a patch that does not change is taken over by the next step
    memory.keep(set_.node_count);
    memory.keep(set_.constraint_count);
    memory.keep_array(set_.nodes, static_cast<std::size_t>(node_capacity), set_.node_count);
    memory.keep_array(set_.constraints, static_cast<std::size_t>(constraint_capacity), set_.constraint_count);
    memory.keep_array(set_.target, static_cast<std::size_t>(constraint_capacity), set_.constraint_count);
  }
  if (source.slides) {
    memory.keep_array(set_.place, static_cast<std::size_t>(constraint_capacity), set_.constraint_count);
    memory.keep_array(set_.slope, static_cast<std::size_t>(node_capacity), set_.node_count);
  }
  return create_set(memory, node_capacity, constraint_capacity, &set_) &&
         (!source.patch || create_set(memory, node_capacity, constraint_capacity, &last_));
}

void ContactRows::begin(std::int32_t contacts) {
  if (source_.patch) std::swap(set_, last_);
  to_come_ = contacts;
  set_.node_count = set_.constraint_count = next_in_last_ = 0;
}

bool ContactRows::has_room(std::int32_t constraints, std::int32_t nodes) const {
  return set_.constraint_count + constraints <= set_.constraint_capacity - reserved_constraints_ &&
         set_.node_count + nodes <= set_.node_capacity - reserved_nodes_;
}

// An equal share of the room that is left, for the present contact and those to come.
std::int32_t ContactRows::nodes_for_one() const {
  return std::max(1, (set_.node_capacity - reserved_nodes_ - set_.node_count) / std::max(1, to_come_));
}

ContactConstraint& ContactRows::add_constraint(const ContactWish& wish, std::int32_t part) {
  ContactConstraint& constraint = set_.constraints[set_.constraint_count];
  constraint = ContactConstraint{};
  constraint.first_node = set_.node_count;
  constraint.axes = wish.axes;
  constraint.id = {wish.contact, part};
  constraint.law = wish.law, constraint.friction = wish.friction, constraint.share = 1;
  if (set_.place) set_.place[set_.constraint_count].known = 0;
  set_.target[set_.constraint_count++] = wish.displacement;
  return constraint;
}

void ContactRows::add_held_node(const ContactWish& wish, ContactConstraint& constraint, std::int32_t node,
                                double weight) {
  ++constraint.node_count;
  set_.nodes[set_.node_count++] = ContactNode{node, source_.column_of_node[node], wish.contact, 0, weight};
}

// The frame of a constraint that is not sticking: inward normal and two tangents, of which the law keeps some as rows.
void ContactRows::set_frame(const ContactWish& wish, ContactConstraint& constraint) {
  if (wish.law == ContactLaw::sticking) return;
  const Vec3 row[3] = {-1 * wish.outward, wish.tangent, cross(wish.outward, wish.tangent)};
  Vec3& target = set_.target[set_.constraint_count - 1];
  const Vec3 displacement = target;
  constraint.framed = constraint.turns = true;
  for (int i = 0; i < 3; ++i) {
    target[i] = dot(row[i], displacement);
    for (int j = 0; j < 3; ++j) constraint.frame.m[i][j] = row[i][j];
  }
  constraint.axes = wish.law == ContactLaw::coulomb ? 7 : 1;
}

std::uint32_t ContactRows::add_node(const ContactWish& wish, std::int32_t node, bool* made) {
  *made = false;
  const std::uint32_t flags = hold_node(wish, node, made);
  --to_come_;
  return flags;
}

std::uint32_t ContactRows::hold_node(const ContactWish& wish, std::int32_t node, bool* made) {
  if (source_.column_of_node[node] < 0) return PALPATE_STEP_NOT_TOUCHABLE;
  if (!has_room(1, 1)) return PALPATE_STEP_CONTACTS_DROPPED;
  ContactConstraint& constraint = add_constraint(wish, 0);
  add_held_node(wish, constraint, node, 1);
  set_frame(wish, constraint);
  *made = true;
  return 0;
}

// The vertex nearest to the surface point; in a scene without rest positions (grips alone), the one of largest weight.
int ContactRows::nearest_vertex(const SurfacePoint& surface_point, const std::int32_t* node, const double* weight,
                                int count) const {
  const auto at = [&](std::int32_t n) { return load3(source_.rest + 3 * static_cast<std::size_t>(n)); };
  Vec3 centre;
  for (int v = 0; source_.rest && v < 3; ++v)
    centre += surface_point.barycentric[v] * at(source_.triangles[3 * surface_point.triangle + v]);
  int best = 0;
  double least = INFINITY;
  for (int v = 0; v < count; ++v) {
    const double distance = source_.rest ? length(at(node[v]) - centre) : -weight[v];
    if (distance < least) least = distance, best = v;
  }
  return best;
}

std::uint32_t ContactRows::add_contact(const ContactWish& wish, const SurfacePoint& surface_point, bool* made) {
  *made = false;
  const std::uint32_t flags =
      is_disc(wish) ? add_patch(wish, surface_point, made) : hold_surface_point(wish, surface_point, made);
  --to_come_;
  return flags;
}

std::uint32_t ContactRows::hold_surface_point(const ContactWish& wish, const SurfacePoint& surface_point, bool* made) {
  std::int32_t node[3];
  double weight[3];
  int count = 0;
  std::uint32_t flags = 0;
  for (int v = 0; v < 3; ++v) {
    const std::int32_t n = source_.triangles[3 * surface_point.triangle + v];
    if (source_.column_of_node[n] < 0) {
      if (surface_point.barycentric[v] != 0) flags = PALPATE_STEP_NOT_TOUCHABLE;
      continue;
    }
    node[count] = n, weight[count++] = surface_point.barycentric[v];
  }
  if (count == 0) return flags;
  double sum = 0;
  for (int v = 0; v < count; ++v) sum += weight[v] = std::max(0.0, weight[v]);
  for (int v = 0; v < count; ++v) weight[v] = sum > 0 ? weight[v] / sum : 1.0 / count;

  if (source_.model == PALPATE_CONTACT_NODE)
    return flags | hold_node(wish, node[nearest_vertex(surface_point, node, weight, count)], made);
  if (source_.model == PALPATE_CONTACT_TRIANGLE) {
    // Section 5 of the paper: vertex v gets the displacement alpha_v d, alpha_v = k_v + 1 - sum_w k_w^2. The interpolated
    // displacement sum_v k_v alpha_v d then equals d.
    if (!has_room(count, count)) return flags | PALPATE_STEP_CONTACTS_DROPPED;
    double squares = 0;
    for (int v = 0; v < count; ++v) squares += weight[v] * weight[v];
    for (int v = 0; v < count; ++v) {
      ContactWish part = wish;
      part.displacement = (weight[v] + 1 - squares) * wish.displacement;
      ContactConstraint& constraint = add_constraint(part, v);
      add_held_node(part, constraint, node[v], 1);
      constraint.share = weight[v];
      set_frame(part, constraint);
    }
  } else {
    WeightedNodes nodes = {node, weight, 0};
    for (int v = 0; v < count; ++v)
      if (weight[v] > 0) node[nodes.count] = node[v], weight[nodes.count++] = weight[v];
    if (nodes.count > nodes_for_one()) {
      thin_nodes(source_.rest, {}, {}, nodes_for_one(), &nodes);
      flags |= PALPATE_STEP_DISCS_THINNED;
    }
    if (!has_room(1, nodes.count)) return flags | PALPATE_STEP_CONTACTS_DROPPED;
    ContactConstraint& constraint = add_constraint(wish, 0);
    for (int e = 0; e < nodes.count; ++e) add_held_node(wish, constraint, nodes.node[e], nodes.weight[e]);
    set_frame(wish, constraint);
  }
  *made = true;
  return flags;
}

void ContactRows::take_back(std::int32_t first) {
  if (first >= set_.constraint_count) return;
  set_.node_count = set_.constraints[first].first_node, set_.constraint_count = first;
}

bool ContactRows::hold_as_before(std::int32_t first, const ContactConstraint* before, std::int32_t count,
                                 const ContactNode* nodes) {
  if (set_.constraint_count - first != count) return false;
  std::int32_t used = set_.constraints[first].first_node;
  for (std::int32_t part = 0; part < count; ++part) {
    used += before[part].node_count;
    const ContactConstraint &was = before[part], &now = set_.constraints[first + part];
    if (was.law != now.law || was.id != now.id || was.joined != now.joined) return false;
  }
  if (used > set_.node_capacity) return false;
  set_.node_count = set_.constraints[first].first_node;
  for (std::int32_t part = 0; part < count; ++part) {
    ContactConstraint &now = set_.constraints[first + part], held = before[part];
    Vec3& target = set_.target[first + part];
    if (now.framed) target = transposed_times(now.frame, target);
    if (held.framed) target = held.frame * target;
    if (set_.place) set_.place[first + part].known = 0;
    held.friction = now.friction, held.share = now.share, held.first_node = set_.node_count;
    std::copy(nodes + before[part].first_node, nodes + before[part].first_node + held.node_count,
              set_.nodes + set_.node_count);
    set_.node_count += held.node_count;
    now = held;
  }
  return true;
}

std::int32_t ContactRows::add(const RowWish* wishes, std::int32_t count) {
  std::int32_t nodes = 0;
  for (std::int32_t i = 0; i < count; ++i) nodes += wishes[i].count;
  const bool made = has_room(count, nodes);
  --to_come_;
  return made ? take(wishes, count) : -1;
}

std::int32_t ContactRows::add_reserved(const RowWish& wish) {
  const bool made =
      set_.constraint_count < set_.constraint_capacity && set_.node_count + wish.count <= set_.node_capacity;
  return made ? take(&wish, 1) : -1;
}

std::int32_t ContactRows::take(const RowWish* wishes, std::int32_t count) {
  const std::int32_t first = set_.constraint_count;
  for (const RowWish* wish = wishes; wish != wishes + count; ++wish) {
    ContactConstraint& constraint = set_.constraints[set_.constraint_count];
    constraint = wish->rows;
    constraint.first_node = set_.node_count, constraint.node_count = wish->count;
    for (std::int32_t e = 0; e < wish->count; ++e) {
      const std::int32_t node = wish->node[e], column = wish->column ? wish->column[e] : source_.column_of_node[node];
      set_.nodes[set_.node_count++] = ContactNode{node, column, wish->contact, 0, wish->weight[e]};
    }
    if (set_.place) set_.place[set_.constraint_count].known = 0;
    set_.target[set_.constraint_count++] = wish->target;
  }
  return first;
}

// The wish with the disc's mean place in the place of its anchor and the disc's own normal in that of the surface. A frame that would turn by
// less than kSteady stays, so that a tool at rest keeps its rows; so does that of a contact with friction, until it slips.
ContactWish ContactRows::along_own_normal(const ContactWish& wish, const DiscPlace& place,
                                          const ContactConstraint* before) const {
  ContactWish own = wish;
  Vec3 lean = 0.5 * wish.slide->push * place.softer - place.rise - wish.slide->lean;
  if (const double size = length(lean); size > kMostLean) lean = kMostLean / size * lean;
  own.outward = unit_or_zero(place.outward + lean);
  if (wish.slide->turn) {
    const Vec3 was = -1 * wish.slide->inward;
    own.outward = unit_or_zero(was + wish.slide->turn->take(own.outward - was));
  }
  own.displacement += wish.slide->anchor - place.at;
  if (before) {
    const Vec3 was = -1 * load3(before->frame.m[0]);
    if (wish.law == ContactLaw::coulomb || length(own.outward - was) < kSteady) own.outward = was;
    if (own.outward.x != was.x || own.outward.y != was.y || own.outward.z != was.z)
      own.tangent = across(own.outward, own.tangent);
  } else {
    own.tangent = across(own.outward, own.tangent);
  }
  own.slack = wish.slide->begins ? dot(own.outward, place.at - wish.slide->anchor) : wish.slack;
  own.displacement += own.slack * own.outward - wish.slack * wish.outward;
  return own;
}

// The patch of the contact in the last step, or nullptr.
const ContactConstraint* ContactRows::patch_of_last_step(const ContactWish& wish) {
  const auto before = [&](const ContactConstraint& constraint) { return constraint.id.contact < wish.contact; };
  while (next_in_last_ < last_.constraint_count && before(last_.constraints[next_in_last_])) ++next_in_last_;
  if (next_in_last_ == last_.constraint_count) return nullptr;
  const ContactConstraint& old = last_.constraints[next_in_last_];
  const bool same = old.id.contact == wish.contact && old.disc_radius > 0 && old.law == wish.law;
  return same ? &old : nullptr;
}

// Whether the patch of the last step is that of this one: its surface point and radius are the same, and so is the number of its nodes,
// unless both are all of them.
bool ContactRows::stays(const ContactConstraint& old, const ContactWish& wish,
                        const SurfacePoint& surface_point) const {
  if (wish.moved || old.disc_radius != wish.disc_radius || old.surface_point.triangle != surface_point.triangle ||
      !std::equal(surface_point.barycentric, surface_point.barycentric + 3, old.surface_point.barycentric))
    return false;
  const std::int32_t most = nodes_for_one();
  return old.thinned_to > 0 ? old.thinned_to == most : old.node_count <= most;
}

bool ContactRows::presses(const ContactWish& wish, const SurfacePoint& surface_point) {
  if (!is_disc(wish)) return false;
  const ContactConstraint* const old = patch_of_last_step(wish);
  return !old || !stays(*old, wish, surface_point) || !has_room(1, old->node_count);
}

bool ContactRows::add_contact_as_before(const ContactWish& wish) {
  const ContactConstraint* const old = patch_of_last_step(wish);
  const bool made = old && has_room(1, old->node_count);
  if (made) add_patch_of_last_step(wish);
  --to_come_;
  return made;
}

void ContactRows::add_patch_of_last_step(const ContactWish& wish) {
  const ContactConstraint& old = last_.constraints[next_in_last_];
  ContactWish same = wish;
  if (old.framed) same.tangent = Vec3{old.frame.m[1][0], old.frame.m[1][1], old.frame.m[1][2]};
  const DiscPlace* const place = wish.slide && last_.place[next_in_last_].known ? &last_.place[next_in_last_] : nullptr;
  if (place) same = along_own_normal(same, *place, &old);
  ContactConstraint& constraint = add_constraint(same, 0);
  set_frame(same, constraint);
  constraint.local = old.local, constraint.discs[0] = old.discs[0];
  if (place) {
    set_.place[set_.constraint_count - 1] = *place;
    std::copy_n(last_.slope + old.first_node, old.node_count, set_.slope + set_.node_count);
    if (!std::equal(constraint.frame.m[0], constraint.frame.m[0] + 3, old.frame.m[0])) {
      const Mat3 turn = times_transposed(constraint.frame, old.frame);
      constraint.local = times_transposed(turn * old.local, turn), constraint.discs[0] = in_frame(old.discs[0], turn);
    }
  }
  constraint.disc_radius = old.disc_radius, constraint.surface_point = old.surface_point, constraint.flags = old.flags,
  constraint.thinned_to = old.thinned_to;
  for (std::int32_t v = 0; v < old.node_count; ++v) {
    const ContactNode& held = last_.nodes[old.first_node + v];
    add_held_node(same, constraint, held.node, held.weight);
  }
}

std::uint32_t ContactRows::add_patch(const ContactWish& wish, const SurfacePoint& surface_point, bool* made) {
  if (!presses(wish, surface_point)) {
    add_patch_of_last_step(wish);
    *made = true;
    return set_.constraints[set_.constraint_count - 1].flags;
  }
  ContactPatch& patch = *source_.patch;
  patch.press(surface_point, wish.outward, wish.tangent, wish.disc_radius);
  std::int32_t node[ContactPatch::kMaxNodes];
  double weight[ContactPatch::kMaxNodes], sum = 0, whole = 0;
  WeightedNodes nodes = {node, weight, 0};
  for (int e = 0; e < patch.count(); ++e) {
    whole += patch.weights()[e];
    if (source_.column_of_node[patch.nodes()[e]] < 0) continue;
    sum += patch.weights()[e];
    node[nodes.count] = patch.nodes()[e], weight[nodes.count++] = patch.weights()[e];
  }
  std::uint32_t flags = nodes.count < patch.count() ? std::uint32_t{PALPATE_STEP_NOT_TOUCHABLE} : 0;
  if (!(sum > 1e-3 * whole)) return flags;
  for (int e = 0; e < nodes.count; ++e) weight[e] /= sum;
  const std::int32_t most = nodes_for_one();
  const bool thins = nodes.count > most;
  if (thins && thin_nodes(source_.rest, wish.tangent, cross(wish.outward, wish.tangent), most, &nodes) < kFaithful)
    flags |= PALPATE_STEP_DISCS_THINNED;
  if (!has_room(1, nodes.count)) return flags | PALPATE_STEP_CONTACTS_DROPPED;
  // Of a disc without some of its nodes the slopes are not known.
  DiscPlace place{};
  place.known = wish.slide && !thins && nodes.count == patch.count() && sum > kMostly;
  ContactWish own = wish;
  if (place.known) {
    place.outward = wish.outward;
    patch.measure_slopes(surface_point, wish.outward, wish.tangent, wish.disc_radius, set_.slope + set_.node_count,
                         &place);
    own = along_own_normal(wish, place, nullptr);
  }
  ContactConstraint& constraint = add_constraint(own, 0);
  if (place.known) set_.place[set_.constraint_count - 1] = place;
  set_frame(own, constraint);
  constraint.local = patch.local(), constraint.discs[0] = patch.disc();
  if (constraint.framed) {
    constraint.local = times_transposed(constraint.frame * patch.local(), constraint.frame);
    constraint.discs[0] = in_frame(patch.disc(), constraint.frame);
  }
  constraint.disc_radius = wish.disc_radius, constraint.surface_point = surface_point, constraint.flags = flags;
  constraint.thinned_to = thins ? most : 0;
  for (int e = 0; e < nodes.count; ++e) add_held_node(wish, constraint, node[e], weight[e]);
  *made = true;
  return flags;
}

}  // namespace palpate
