#include "runtime/needles/needle.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/base/exponential.h"
#include "runtime/contact/touch_step.h"
#include "runtime/include/palpate/palpate_needles.h"

namespace palpate {
namespace {

// How far a place may lie outside of the mesh, in edges: the surface is where needles enter.
constexpr double kOnSurface = 0.05;
// What the mesh resolves of the field around a thin shaft, in edges. Chosen, not fitted: no test compares two meshes.
constexpr double kResolved = 0.3;
// The least share of it that a thick shaft leaves.
constexpr double kLeastLog = 0.25;
// Of a reaction at its limit.
constexpr double kRounding = 1e-9;

// a x = b by Cramer's rule; zero where a is singular. a need not be symmetric.
Vec3 in_columns_of(const Mat3& a, Vec3 b) {
  const Vec3 c0 = {a.m[0][0], a.m[1][0], a.m[2][0]}, c1 = {a.m[0][1], a.m[1][1], a.m[2][1]},
             c2 = {a.m[0][2], a.m[1][2], a.m[2][2]};
  const double volume = dot(c0, cross(c1, c2));
  if (!(std::fabs(volume) > 0)) return {};
  return (1 / volume) * Vec3{dot(b, cross(c1, c2)), dot(c0, cross(b, c2)), dot(c0, cross(c1, b))};
}

}  // namespace

bool Needles::create(SceneMemory& memory, const Source& source) {
  source_ = source;
  needles_ = memory.array<NeedleInTissue>(static_cast<std::size_t>(source.max_tools));
  memory.keep_array(needles_, static_cast<std::size_t>(source.max_tools));
  if (memory.failed()) return false;
  for (std::int32_t t = 0; t < source_.max_tools; ++t) forget_tool(t);
  return tree_.create(memory, source.geometry);
}

void Needles::forget_tool(std::int32_t t) {
  needles_[t] = NeedleInTissue{};
}

// ---- places ----------------------------------------------------------------------------------------------------------

// False where the tissue there has no columns.
bool Needles::find_place(Vec3 x, NeedlePlace* place) const {
  const TetrahedronTree::Found found = tree_.nearest(x, INFINITY);
  if (found.tetrahedron < 0) return false;
  const std::int32_t* const corner = source_.geometry.tetrahedra + 4 * static_cast<std::size_t>(found.tetrahedron);
  const auto at = [&](int c) { return load3(source_.geometry.nodes + 3 * static_cast<std::size_t>(corner[c])); };
  double edge = 0;  // m, their mean
  for (int a = 0; a < 4; ++a)
    for (int b = a + 1; b < 4; ++b) edge += length(at(b) - at(a)) / 6;
  if (!(found.distance <= kOnSurface * edge)) return false;
  place->rest = x;
  for (int c = 0; c < 4; ++c) {
    const std::int32_t n = corner[c], surface = source_.tensors->surface_nodes;
    const std::int32_t inside = n < surface ? -1 : source_.tensors->corridor->index_of(n);
    place->node[c] = n, place->weight[c] = found.weight[c];
    place->column[c] = n < surface ? source_.column_of_node[n] : inside >= 0 ? source_.tensors->columns + inside : -1;
    if (place->column[c] < 0) return false;
  }
  const std::int32_t r = source_.region[found.tetrahedron];
  const double nu = source_.poisson[r], shear = source_.young[r] / (2 * (1 + nu)), resolved = kResolved * edge;
  // ln(R / r) without r: the needle's radius may change from step to step.
  place->along = 1 / (2 * std::numbers::pi * shear),
  place->across = (3 - 4 * nu) / (8 * std::numbers::pi * (1 - nu) * shear);
  place->resolved = resolved;
  return true;
}

// m, under the contacts of the last solve and the motions of this step.
Vec3 Needles::displacement(const NeedlePlace& place) const {
  Vec3 u;
  for (int c = 0; c < 4; ++c) u += place.weight[c] * source_.field->at_node(place.node[c]);
  return u;
}

// ---- a step ----------------------------------------------------------------------------------------------------------

void Needles::enter(NeedleInTissue& needle, const Tool& tool) const {
  needle = NeedleInTissue{};
  needle.is_known = 1, needle.id = needle_of(tool).id;
  Vec3 x;
  for (int v = 0; v < 3; ++v) {
    const std::int32_t n =
        source_.triangles[3 * static_cast<std::size_t>(needle_of(tool).triangle) + static_cast<std::size_t>(v)];
    x += needle_of(tool).barycentric[v] * load3(source_.geometry.nodes + 3 * static_cast<std::size_t>(n));
  }
  if (find_place(x, &needle.tip)) return;
  needle.tip.rest = x, needle.is_out = 1;
  needle.state.condition = PALPATE_NEEDLE_STUCK;
}

// The places that the tip has passed on its way back; the last ones in are the first ones out.
void Needles::let_go_passed(NeedleInTissue& needle) {
  while (needle.count > 0 && needle.place[needle.count - 1].held > 0) --needle.count;
}

std::int32_t Needles::begin_tool(std::int32_t t, const Tool& tool, const OrganPose& organ) {
  NeedleInTissue& needle = needles_[t];
  if (!has_needle(tool)) {
    if (needle.is_known) forget_tool(t);
    return 0;
  }
  const Vec3 axis = unit_or_zero(organ.vector_to_organ(load3(needle_of(tool).direction))), before = needle.tangent;
  if (!needle.is_known || needle.id != needle_of(tool).id) enter(needle, tool);
  needle.position = organ.point_to_organ(load3(needle_of(tool).tip)), needle.axis = axis;
  needle.tangent = across(axis, before);
  needle.touches = 0, needle.tip_row = needle.tip.row_of = -1;
  if (needle.is_out) return 0;
  if (!needle.pierced) {
    const Vec3 way = needle.position - needle.tip.rest - displacement(needle.tip);
    const double ahead = dot(way, axis);
    const bool beside = length(way - ahead * axis) > needle_of(tool).spacing;
    needle.touches = !beside && (ahead > 0 || needle.state.tip_force > 0);
    return needle.touches;
  }
  let_go_passed(needle);
  needle.touches = 1;
  return needle.count + 2;
}

RowWish Needles::wish_of(const NeedleInTissue& needle, const Tool& tool, const NeedlePlace& place, double length,
                         const ConstraintId& id) const {
  RowWish wish(id);
  wish.node = place.node, wish.column = place.column, wish.weight = place.weight, wish.count = 4;
  const Vec3 row[3] = {needle.axis, needle.tangent, cross(needle.axis, needle.tangent)};
  wish.set_frame(row);
  const Vec3 way = needle.position - place.rest - place.aside;
  wish.target = {dot(way, row[0]) + place.held, dot(way, row[1]), dot(way, row[2])};
  const double unresolved = std::max(kLeastLog, natural_log(place.resolved / needle_of(tool).radius)) / length;
  for (int i = 0; i < 3; ++i) wish.rows.local.m[i][i] = unresolved * (i == 0 ? place.along : place.across);
  return wish;
}

std::uint32_t Needles::add_rows(std::int32_t t, const Tool& tool, ContactRows& rows) {
  NeedleInTissue& needle = needles_[t];
  if (!needle.touches) return 0;
  const auto contact = [t](std::int32_t point) { return ContactId{kNeedleSource, t, point}; };
  RowWish tip = wish_of(needle, tool, needle.tip, 0.5 * needle_of(tool).spacing, {contact(0), 1});
  if (needle.pierced) {
    RowWish sides = tip;
    sides.rows.id.part = 0, sides.rows.axes = 6;
    needle.tip.row_of = rows.add(&sides, 1);
  }
  tip.rows.axes = 1, tip.rows.law = ContactLaw::unilateral;
  tip.rows.limit = needle.pierced ? needle_of(tool).cutting_force : needle_of(tool).puncture_force;
  if (tip.rows.limit > 0) needle.tip_row = rows.add(&tip, 1);
  std::uint32_t flags = 0;
  for (std::int32_t i = 0; i < needle.count; ++i) {
    NeedlePlace& place = needle.place[i];
    RowWish wish = wish_of(needle, tool, place, place.length, {contact(1 + i), 0});
    wish.rows.limit = needle_of(tool).friction * place.length;
    wish.rows.axes = wish.rows.limit > 0 ? 7 : 6;
    place.row_of = rows.add(&wish, 1);
    if (place.row_of < 0) flags = PALPATE_STEP_CONTACTS_DROPPED;
  }
  return flags;
}

// m: by how much node c of a place has moved, which the constraint p holds.
Vec3 Needles::moved(const TouchStep& step, const NeedlePlace& place, int c, std::int32_t p) const {
  return step.state->body->moved_node(*step.state, step.acting->constraints[p].first_node + c) +
         source_.field->moved_at_node(place.node[c]);
}

// Places along which the shaft slid stick where they are now.
void Needles::slide(const TouchStep& step, NeedleInTissue& needle) const {
  for (std::int32_t i = 0; i < needle.count; ++i) {
    NeedlePlace& place = needle.place[i];
    if (place.row_of < 0) continue;
    const ContactConstraint& along = step.acting->constraints[place.row_of];
    if (along.limit > 0 && !gives_way(along, step.reaction(place.row_of)).at_limit) continue;
    ++needle.state.slipping;
    if (along.limit > 0) {
      place.held += step.state->body->missed(step, place.row_of).x;
      continue;
    }
    // Without friction there is no row that tells where the place is.
    Vec3 now = place.rest - needle.position;
    for (int c = 0; c < 4; ++c) now += place.weight[c] * moved(step, place, c, place.row_of);
    place.held = dot(now, needle.axis);
  }
}

bool Needles::may_take_place(const NeedleInTissue& needle, const Tool& tool) const {
  const double last = needle.count > 0 ? needle.place[needle.count - 1].depth : 0;
  return needle.tip.depth - last >= needle_of(tool).spacing;
}

// now: m, where the tissue at the tip is.
void Needles::take_place(NeedleInTissue& needle, Vec3 now) const {
  NeedlePlace& place = needle.place[needle.count];
  place = needle.tip;
  place.length = needle.tip.depth - (needle.count > 0 ? needle.place[needle.count - 1].depth : 0);
  place.held = std::min(0.0, dot(now - needle.position, needle.axis));
  ++needle.count;
}

// Where the tip has cut, or goes back.
std::uint32_t Needles::move_tip(const TouchStep& step, NeedleInTissue& needle, const Tool& tool) const {
  const std::int32_t sides = needle.tip.row_of;
  if (sides < 0) return PALPATE_STEP_CONTACTS_DROPPED;
  Vec3 by_node[4], now;
  Mat3 edges, deformed;  // columns: from corner 0 to the others
  for (int c = 0; c < 4; ++c) {
    by_node[c] = moved(step, needle.tip, c, sides);
    now += needle.tip.weight[c] * by_node[c];
  }
  now += needle.tip.rest;
  const auto rest = [&](int c) {
    return load3(source_.geometry.nodes + 3 * static_cast<std::size_t>(needle.tip.node[c]));
  };
  for (int c = 1; c < 4; ++c)
    for (int i = 0; i < 3; ++i) {
      edges.m[i][c - 1] = rest(c)[i] - rest(0)[i];
      deformed.m[i][c - 1] = edges.m[i][c - 1] + by_node[c][i] - by_node[0][i];
    }
  const double ahead =
      needle.tip_row >= 0 ? -step.state->body->missed(step, needle.tip_row).x : dot(needle.position - now, needle.axis);
  const double r = needle.tip_row >= 0 ? step.reaction(needle.tip_row).x : 0;
  const bool cuts = ahead > 0 && r >= needle_of(tool).cutting_force * (1 - kRounding), goes_back = ahead < 0;
  if (!cuts && !goes_back) return 0;
  const Vec3 by = edges * in_columns_of(deformed, ahead * needle.axis);
  if (!is_finite(by) || length(by) == 0) return 0;
  if (cuts && may_take_place(needle, tool)) {
    if (needle.count == source_.most_places) {
      needle.state.condition = PALPATE_NEEDLE_STUCK;
      return PALPATE_STEP_CONTACTS_DROPPED;
    }
    take_place(needle, now);
  }
  NeedlePlace to = needle.tip;
  to.depth += cuts ? length(by) : -length(by);
  if (goes_back && to.depth <= 0) {
    needle.pierced = needle.count = 0, needle.is_out = 1;
    needle.state.condition = PALPATE_NEEDLE_OUTSIDE;
    return 0;
  }
  if (!find_place(needle.tip.rest + by, &to)) {
    needle.state.condition = PALPATE_NEEDLE_STUCK;
    return PALPATE_STEP_NOT_TOUCHABLE;
  }
  needle.tip = to;
  if (cuts) needle.state.condition = PALPATE_NEEDLE_CUTS;
  return 0;
}

std::uint32_t Needles::end_tool(const TouchStep& step, std::int32_t t, bool solved, Vec3* sum, Vec3* torque) {
  NeedleInTissue& needle = needles_[t];
  const Tool& tool = step.state->input.tool(t);
  const OrganPose& organ = step.state->organ;
  *sum = *torque = {};
  palpate_needle_state& state = needle.state;
  if (!has_needle(tool)) return 0;
  const Vec3 reference = organ.point_to_organ(tool.reference), side = cross(needle.axis, needle.tangent);
  const auto act = [&](std::int32_t row, double along) {
    if (row < 0 || !solved) return 0.0;
    const Vec3 r = step.reaction(row), f = r.x * needle.axis + r.y * needle.tangent + r.z * side;
    *sum += f, *torque += cross(needle.position + along * needle.axis - reference, f);
    return r.x;
  };
  const palpate_needle_condition refused = state.condition;
  state.tip_force = state.shaft_force = 0;
  act(needle.tip.row_of, 0);
  state.tip_force = std::max(0.0, act(needle.tip_row, 0));
  for (std::int32_t i = 0; i < needle.count; ++i)
    state.shaft_force += act(needle.place[i].row_of, needle.place[i].held);
  std::uint32_t flags = 0;
  state.slipping = 0;
  if (needle.is_out) {
    if (refused == PALPATE_NEEDLE_STUCK) flags = PALPATE_STEP_NOT_TOUCHABLE;
  } else if (!needle.touches) {
    state.condition = PALPATE_NEEDLE_OUTSIDE;
  } else if (!needle.pierced) {
    state.condition = PALPATE_NEEDLE_PRESSES;
    needle.pierced = solved && state.tip_force >= needle_of(tool).puncture_force * (1 - kRounding);
  } else {
    state.condition = PALPATE_NEEDLE_INSIDE;
    if (solved) {
      slide(step, needle);
      flags = move_tip(step, needle, tool);
    }
  }
  state.places = needle.count, state.depth = needle.tip.depth;
  store3(organ.vector_to_world(Vec3{} - *sum), state.force);
  store3(organ.vector_to_world(Vec3{} - *torque), state.torque);
  store3(needle.tip.rest, state.tip_at_rest);
  return flags;
}

// ---- as a source of rows ---------------------------------------------------------------------------------------------

std::int32_t Needles::begin(TouchStep& step) {
  std::int32_t count = 0;
  for (std::int32_t t = 0; t < step.state->input.count(); ++t)
    count += begin_tool(t, step.state->input.tool(t), step.state->organ);
  return count;
}

void Needles::request(TouchStep& step) {
  TouchState& state = *step.state;
  for (std::int32_t t = 0; t < state.input.count(); ++t) {
    const std::int32_t first = state.rows.set().constraint_count;
    if (const std::uint32_t flags = add_rows(t, state.input.tool(t), state.rows)) step.raise(t, flags);
    const ContactConstraints& set = state.rows.set();
    for (std::int32_t p = first; p < set.constraint_count; ++p)
      if (!state.solver.matrix().holds(set, p)) state.admission.pay();
  }
}

void Needles::take_reactions(TouchStep& step, bool solved) {
  TouchState& state = *step.state;
  for (std::int32_t t = 0; t < state.input.count(); ++t) {
    const Tool& tool = state.input.tool(t);
    if (tool.index < 0) continue;
    ToolResult& result = step.result[t];
    if (needles_[t].touches) step.unasked += operations(needles_[t].state.places, step.acting->node_count);
    if (const std::uint32_t flags = end_tool(step, t, solved, &result.inside_force, &result.inside_torque))
      step.raise(t, flags);
    result.is_inside = needles_[t].pierced, result.touches = needles_[t].touches;
  }
}

void Needles::correct_forces(TouchStep& step) {
  if (step.context->def.force == PALPATE_FORCE_OFF) return;
  for (std::int32_t t = 0; t < step.state->input.count(); ++t) {
    ToolResult& result = step.result[t];
    if (!is_finite(result.inside_force)) continue;
    result.raw += -1 * result.inside_force;
    if (step.state->input.tool(t).has_torque && is_finite(result.inside_torque))
      result.raw_torque += -1 * result.inside_torque;
  }
}

bool Needles::note_sliding(const TouchStep& step, const ContactConstraints&, const ContactConstraint& constraint,
                           SlideEnergy::Sliding* sliding) {
  const ContactId& contact = constraint.id.contact;
  if (contact.source != kNeedleSource) return false;
  const std::int32_t t = contact.index;
  const palpate_needle& given = needle_of(step.state->input.tool(t));
  // Of one that something brakes, friction and cutting take more than new places may give.
  if (!step.state->body->responds_linearly() || step.state->offset.exists() || given.friction != 0 ||
      given.cutting_force != 0)
    return false;
  NeedleInTissue& needle = needles_[t];
  const bool is_tip = contact.point == 0;
  NeedlePlace& place = is_tip ? needle.tip : needle.place[contact.point - 1];
  // The tip begins where it meets the surface, a place where the needle is.
  sliding->aside = &place.aside, sliding->at = needle.position;
  sliding->from = is_tip ? place.rest : needle.position;
  sliding->axis = needle.axis, sliding->reach = is_tip ? 0 : place.held;
  return true;
}

}  // namespace palpate
