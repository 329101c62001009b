#include "runtime/report/contact_report.h"

#include <algorithm>
#include <cstring>

#include "runtime/scene/effect.h"

namespace palpate {
namespace {

// A contact may end and begin, a link become taut and break; a tool's place may see one grasp open and another one close and slip.
std::size_t most_events(const palpate_scene_def& def) {
  return 2 * static_cast<std::size_t>(def.max_points) + static_cast<std::size_t>(key_number(def, "max_links")) +
         (key_number(def, "grasps") != 0 ? 4 * static_cast<std::size_t>(def.max_tools) : 0);
}

bool is_closed(const HeldEvent& grasp) {
  return grasp.hold == Hold::holds || grasp.hold == Hold::slips;
}

}  // namespace

bool ContactReport::create(SceneMemory& memory, const palpate_scene_def& def, const double* position,
                           const std::int32_t* triangles, const BoundSurface* fine, const DisplacementField* field) {
  position_ = position, triangles_ = triangles, fine_ = fine, field_ = field;
  max_tools_ = def.max_tools, max_points_ = def.max_points;
  const std::size_t points = static_cast<std::size_t>(def.max_points);
  static_assert(sizeof(palpate_contact_report) % 8 == 0 && sizeof(palpate_contact) % 8 == 0);
  const std::size_t words = (sizeof(palpate_contact_report) + points * sizeof(palpate_contact) +
                             most_events(def) * sizeof(palpate_contact_event)) /
                                8 +
                            1;
  bytes_ = memory.array<std::uint64_t>(words);
  slots_ = memory.array<Slot>(static_cast<std::size_t>(def.max_tools) * points);
  memory.keep(ids_);
  memory.keep(used_);
  if (key_number(def, "grasps") != 0) memory.keep(grasps_);
  memory.keep(step_);
  memory.keep_array(slots_, static_cast<std::size_t>(def.max_tools) * points);
  memory.keep_array(bytes_, words);
  if (memory.failed()) return false;
  report_ = reinterpret_cast<palpate_contact_report*>(bytes_);
  contacts_ = reinterpret_cast<palpate_contact*>(report_ + 1);
  events_ = reinterpret_cast<palpate_contact_event*>(contacts_ + points);
  forget();
  return true;
}

void ContactReport::forget() {
  for (std::int32_t t = 0; t < max_tools_; ++t) {
    used_[t] = max_points_;
    forget_tool(t);
  }
  step_ = 0;
  *report_ = palpate_contact_report{};
  end();
}

void ContactReport::forget_tool(std::int32_t t) {
  for (std::int32_t i = 0; i < used_[t]; ++i) slot(t, i) = Slot{};
  ids_[t] = -1, used_[t] = 0;
  grasps_[t] = HeldEvent{};
}

void ContactReport::begin(std::uint64_t step, double dt) {
  step_ = step, dt_ = dt;
  report_->contact_count = report_->event_count = 0;
}

palpate_contact_event& ContactReport::tell(palpate_contact_event_kind kind, std::int32_t tool_id, std::int32_t point,
                                           const SurfacePoint& surface_point, std::int32_t node, Vec3 place) {
  palpate_contact_event& event = events_[report_->event_count++];
  event = palpate_contact_event{};
  event.kind = kind;
  event.tool_id = tool_id, event.point = point, event.contact = -1;
  event.triangle = surface_point.triangle, event.node = node;
  std::copy(surface_point.barycentric, surface_point.barycentric + 3, event.barycentric);
  store3(place, event.place);
  return event;
}

palpate_contact_event& ContactReport::tell(palpate_contact_event_kind kind, std::int32_t t, std::int32_t point) {
  const Slot& held = slot(t, point);
  return tell(kind, ids_[t], point, held.surface_point, held.node, held.place);
}

void ContactReport::tell_event(palpate_contact_event_kind kind, std::int32_t id, const SurfacePoint& place, Vec3 at) {
  tell(kind, -1, id, place, -1, at);
}

void ContactReport::tell_held(palpate_contact_event_kind kind, std::int32_t t) {
  tell(kind, ids_[t], -1, grasps_[t].surface_point, -1, grasps_[t].place);
}

void ContactReport::tell_held(std::int32_t t, const HeldEvent& now) {
  const HeldEvent before = grasps_[t];
  const bool same = before.hold != Hold::open && before.closing == now.closing;
  if (is_closed(before) && (now.hold == Hold::open || !same)) tell_held(PALPATE_EVENT_GRASP_OPENED, t);
  grasps_[t] = now;
  if (now.hold == Hold::open) return;
  if (!same) tell_held(PALPATE_EVENT_GRASP_CLOSED, t);
  const Hold last = same ? before.hold : Hold::holds;
  if (last == now.hold) return;
  tell_held(now.hold == Hold::let_go  ? PALPATE_EVENT_GRASP_LET_GO
            : now.hold == Hold::slips ? PALPATE_EVENT_GRASP_SLIPS
                                      : PALPATE_EVENT_GRASP_HOLDS,
            t);
}

// Another tool in the place ends the contacts of the one before.
void ContactReport::hold_tool(std::int32_t t, std::int32_t id) {
  if (ids_[t] == id) return;
  for (std::int32_t i = 0; i < used_[t]; ++i)
    if (slot(t, i).held_step + 1 == step_ && slot(t, i).held_step > 0) tell(PALPATE_EVENT_END, t, i);
  if (is_closed(grasps_[t])) tell_held(PALPATE_EVENT_GRASP_OPENED, t);
  forget_tool(t);
  ids_[t] = id;
}

void ContactReport::hold(std::int32_t t, std::int32_t point) {
  Slot& held = slot(t, point);
  used_[t] = std::max(used_[t], point + 1);
  if (held.held_step == 0 || held.held_step + 1 != step_) held.begun = step_;
  held.held_step = step_;
}

// Contacts of the step before that this step does not have.
void ContactReport::end_missing() {
  for (std::int32_t t = 0; t < max_tools_; ++t)
    for (std::int32_t i = 0; i < used_[t]; ++i)
      if (slot(t, i).held_step > 0 && slot(t, i).held_step + 1 == step_) tell(PALPATE_EVENT_END, t, i);
}

ContactReport::Corner ContactReport::corner_of(std::int32_t node) const {
  return {at_rest(node), field_->at_node(node), field_->before_at_node(node)};
}

// The nodes around the three vertices are mostly the same: each of them is evaluated once.
void ContactReport::find_fine_corners(std::int32_t triangle, Corner corner[3]) const {
  constexpr int kMost = 64;
  std::int32_t node[kMost];
  Corner known[kMost];
  int count = 0;
  const auto find = [&](std::int32_t wanted) {
    for (int i = 0; i < count; ++i)
      if (node[i] == wanted) return known[i];
    const Corner found = corner_of(wanted);
    if (count < kMost) node[count] = wanted, known[count++] = found;
    return found;
  };
  for (int v = 0; v < 3; ++v) {
    const std::int32_t vertex = fine_->triangles()[3 * static_cast<std::size_t>(triangle) + v];
    corner[v].rest = load3(fine_->rest() + 3 * static_cast<std::size_t>(vertex));
    corner[v].now = fine_->displacement(vertex, [&](std::int32_t n) { return find(n).now; });
    corner[v].before = fine_->displacement(vertex, [&](std::int32_t n) { return find(n).before; });
  }
}

void ContactReport::add(const ReportedContact& from, std::int32_t index) {
  Slot& held = slot(from.tool, from.point);
  const bool begins = held.begun == step_, slips = from.state == PALPATE_CONTACT_SLIPS,
             sticks = from.state == PALPATE_CONTACT_STICKS;
  // The place now, where this material point was before, and the triangle's normals at rest and now.
  Vec3 place, moved, corner[3], rest[3], rest_place;
  const int corners = from.node >= 0 ? 1 : 3;
  const SurfacePoint& held_point = from.fine.triangle >= 0 ? from.fine : from.surface_point;
  Corner held_corner[3];
  if (from.fine.triangle >= 0) find_fine_corners(from.fine.triangle, held_corner);
  for (int v = 0; v < corners; ++v) {
    if (from.fine.triangle < 0)
      held_corner[v] =
          corner_of(from.node >= 0 ? from.node : triangles_[3 * static_cast<std::size_t>(held_point.triangle) + v]);
    const double weight = from.node >= 0 ? 1 : held_point.barycentric[v];
    const Vec3 now = held_corner[v].now;
    rest[v] = held_corner[v].rest;
    corner[v] = rest[v] + now;
    place += weight * corner[v];
    rest_place += weight * rest[v];
    moved += weight * (now - held_corner[v].before);
  }
  const Vec3 outward = corners == 3 ? unit_or_zero(cross(corner[1] - corner[0], corner[2] - corner[0])) : Vec3{},
             at_rest = corners == 3 ? unit_or_zero(cross(rest[1] - rest[0], rest[2] - rest[0])) : Vec3{};

  palpate_contact& contact = contacts_[report_->contact_count];
  contact = palpate_contact{};
  contact.tool_id = ids_[from.tool], contact.tool = index, contact.point = from.point;
  contact.triangle = from.surface_point.triangle, contact.node = from.node;
  contact.state = from.state;
  contact.begun = held.begun;
  std::copy(from.surface_point.barycentric, from.surface_point.barycentric + 3, contact.barycentric);
  store3(place, contact.place);
  store3(outward, contact.normal);
  contact.depth = -dot(from.holder - rest_place, at_rest);
  contact.gap = dot(from.holder - place, outward);
  store3(from.force, contact.force);
  store3(from.holder, contact.tool_point);
  store3(from.disc_normal, contact.disc_normal);
  contact.disc_radius = from.disc_radius, contact.indentation = from.indentation;
  if (held.last_step > 0 && held.last_step + 1 == step_)
    store3((1 / dt_) * (from.holder - held.last - moved), contact.velocity);

  const palpate_contact_state before = held.state;
  held.surface_point = from.surface_point, held.node = from.node, held.place = place, held.state = from.state;
  if (begins)
    tell(PALPATE_EVENT_BEGIN, from.tool, from.point).contact = report_->contact_count;
  else if (slips && before != PALPATE_CONTACT_SLIPS)
    tell(PALPATE_EVENT_SLIP_START, from.tool, from.point).contact = report_->contact_count;
  else if (sticks && before != PALPATE_CONTACT_STICKS)
    tell(PALPATE_EVENT_STICK_START, from.tool, from.point).contact = report_->contact_count;
  ++report_->contact_count;
}

void ContactReport::note(std::int32_t t, std::int32_t point, Vec3 holder) {
  used_[t] = std::max(used_[t], point + 1);
  slot(t, point).last = holder, slot(t, point).last_step = step_;
}

void ContactReport::end() {
  const std::size_t contacts = static_cast<std::size_t>(report_->contact_count) * sizeof(palpate_contact),
                    events = static_cast<std::size_t>(report_->event_count) * sizeof(palpate_contact_event);
  std::memmove(reinterpret_cast<char*>(contacts_) + contacts, events_, events);
  report_->struct_bytes = sizeof(palpate_contact_report);
  report_->contact_bytes = sizeof(palpate_contact), report_->event_bytes = sizeof(palpate_contact_event);
  report_->events_offset = static_cast<std::uint32_t>(sizeof(palpate_contact_report) + contacts);
  report_->used_bytes = static_cast<std::uint32_t>(report_->events_offset + events);
  report_->step = step_;
}

}  // namespace palpate
