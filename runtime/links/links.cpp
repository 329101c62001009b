#include "runtime/links/links.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"
#include "runtime/contact/touch_step.h"
#include "runtime/links/effect.h"

namespace palpate {
namespace {

// The factor covers that stored columns, rounded to half precision or packed, differ from the compliance that the energy is of; the
// length, m, that sums round.
constexpr Operations kOfLink = 20;
constexpr double kBoundFactor = 1.1, kLeastSlack = 1e-6;

Operations to_move(const LinkEnd& end, std::int32_t contact_nodes) {
  return 3 * Operations{end.count} * contact_nodes;
}

}  // namespace

LinkSurface link_surface_of(const palpate_scene_def& def, TouchState& state, std::int32_t triangles) {
  LinkSurface surface = {state.surface.discs(), state.surface.triangles, triangles};
  if (def.contact != PALPATE_CONTACT_PATCH) surface.disc.measure = nullptr, surface.disc.patch = nullptr;
  return surface;
}

template <class Each>
void Links::for_threads(const Each& each) const {
  palpate::for_threads(
      count_, [this](std::int32_t i) -> Link& { return links_[i]; }, each);
}

bool Links::create(SceneMemory& memory, const Source& source, std::int32_t capacity) {
  source_ = source, capacity_ = capacity;
  links_ = memory.array<Link>(static_cast<std::size_t>(capacity));
  coming_ = memory.array<Link>(static_cast<std::size_t>(capacity));
  memory.keep(count_);
  memory.keep(path_);
  memory.keep_array(links_, static_cast<std::size_t>(capacity), count_);
  return !memory.failed();
}

// ---- what the host gives ---------------------------------------------------------------------------------------------

// |u| <= reach norm of the weighted mean of the end's nodes: the largest eigenvalue of a node's compliance is at most its trace.
double Links::reach_of(const LinkEnd& end) const {
  double reach = 0;
  for (int v = 0; v < end.count; ++v) {
    Mat3 compliance;
    self_compliance(source_.stiffness + 9 * static_cast<std::size_t>(source_.surface.disc.column_of_node[end.node[v]]),
                    &compliance);
    reach += std::fabs(end.weight[v]) *
             std::sqrt(std::max(0.0, compliance.m[0][0] + compliance.m[1][1] + compliance.m[2][2]));
  }
  return reach;
}

palpate_status Links::set(const palpate_link* links, std::int32_t count, palpate_error* error) {
  if (count < 0 || count > capacity_)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_scene_set_links: expected 0 to max_links (%d) links, found %d; raise max_links",
                static_cast<int>(capacity_), static_cast<int>(count));
  if (count > 0 && !links) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "links must not be NULL");
  const LinkSurface* const surfaces[2] = {&source_.surface, &source_.surface};
  for (std::int32_t i = 0; i < count; ++i) {
    palpate_link given = palpate_default_link();
    const auto* const from = reinterpret_cast<const palpate_link*>(reinterpret_cast<const unsigned char*>(links) +
                                                                   static_cast<std::size_t>(i) * links->struct_bytes);
    if (const palpate_status status = read_host_struct("link", from, &given, error)) return status;
    const char* fault = fault_of(given, surfaces);
    if (!fault && from->struct_bytes != links->struct_bytes) fault = "the same struct_bytes in all links";
    if (!fault) fault = fault_in_list(given, i, count, [&](std::int32_t l) -> const Link& { return coming_[l]; });
    if (fault)
      return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                  "palpate_link: link %d: expected %s, found something else; the scene keeps its links",
                  static_cast<int>(i), fault);
    given.struct_bytes = sizeof(palpate_link);
    start_link(coming_[i], given, i);
  }
  for (std::int32_t i = 0; i < count; ++i) {
    Link& link = coming_[i];
    const Link* const end = links_ + count_;
    const Link* const known =
        std::find_if(static_cast<const Link*>(links_), end, [&](const Link& l) { return l.state.id == link.state.id; });
    if (known != end && is_same_link(known->given, link.given)) {
      continue_link(link, *known);
      continue;
    }
    link.reach = 0;
    for (int e = 0; e < 2; ++e) {
      find_link_end(source_.surface, link.given.ends[e], link.given.radius, &link.ends[e]);
      link.reach += reach_of(link.ends[e]);
    }
  }
  std::swap(links_, coming_);
  count_ = count;
  for_threads([](const auto& thread) { thread.keep_length(); });
  return succeed(error);
}

void Links::forget_rest() {
  for (std::int32_t i = 0; i < count_; ++i) start_link(links_[i], links_[i].given, i);
}

// ---- a step ----------------------------------------------------------------------------------------------------------

bool Links::in_chain(std::int32_t i) const {
  return links_[i].given.runs_on || (i > 0 && links_[i - 1].given.runs_on);
}

// m: no longer than this, since its ends were found.
double Links::longest(const Link& link) const {
  return length(link.apart()) + kBoundFactor * link.reach * (path_ - link.path);
}

// Whether a link may be slack without being measured, if the field has changed little. What runs on shares its length with neighbours.
bool Links::may_rest(std::int32_t i) const {
  const Link& link = links_[i];
  return link.given.kind == PALPATE_LINK_THREAD && link.row_of < 0 && !in_chain(i) && std::isfinite(link.path) &&
         longest(link) + kLeastSlack < link.rest_length;
}

// Adds the norm of this step's change of the field to the path. False where it is not known: then each link is measured.
bool Links::walk(const ContactConstraints& set, const ContactSolver& solver, bool solved) {
  if (!solved) return false;
  bool any = false;
  for (std::int32_t i = 0; i < count_ && !any; ++i) any = may_rest(i);
  if (!any) return false;
  const double change = solver.change_norm(set);
  if (!(change >= 0)) return false;
  path_ += change;
  return true;
}

// Where the offset has brought the ends.
void Links::drive(Link& link) const {
  for (int e = 0; source_.offset->exists() && e < 2; ++e)
    link.ends[e].driven = driven_by(*source_.field, source_.surface, link.given.ends[e], link.ends[e]);
}

std::int32_t Links::begin(TouchStep& step) {
  const OrganPose& organ = step.state->organ;
  std::int32_t act = 0;
  step.unasked += kOfLink * count_;
  for (std::int32_t i = 0; i < count_; ++i) {
    Link& link = links_[i];
    link.row_of = -1, link.before = link.state.condition;
    for (int e = 0; e < 2; ++e)
      if (link.given.ends[e].kind == PALPATE_END_WORLD)
        link.ends[e].rest = organ.point_to_organ(load3(link.given.ends[e].point));
    drive(link);
    // A shorter rest length or an end that moved in the world may have used up what the bound left.
    if (!link.fresh && !(longest(link) + kLeastSlack < link.rest_length)) {
      for (LinkEnd& end : link.ends) {
        end.moved = moved_by(*source_.field, end);
        step.unasked += to_move(end, source_.field->loads().count());
      }
      link.fresh = 1, link.path = path_;
    }
  }
  for_threads([&](const auto& thread) {
    if (!thread.acts()) return;
    for (std::int32_t i = thread.first; i < thread.end; ++i) act += has_nodes(links_[i]);
  });
  return act;
}

void Links::request(TouchStep& step) {
  step.flags |= add_rows(step.state->rows, step.state->admission);
}

std::uint32_t Links::add_rows(ContactRows& rows, ContactAdmission& admission) {
  std::uint32_t flags = 0;
  for_threads([&](const auto& thread) {
    if (!thread.acts()) return;
    const std::int32_t before = rows.set().constraint_count;
    std::int32_t first = -1;
    bool made = true, deferred = false;
    for (std::int32_t i = thread.first; i < thread.end; ++i)
      if (links_[i].given.kind != PALPATE_LINK_CLIP) turn_link(links_[i]);
    for (std::int32_t i = thread.first; i < thread.end; ++i) {
      Link& link = links_[i];
      if (!has_nodes(link)) continue;
      // Of an end on nodes, Offset::acting() takes what the offset does.
      const auto unmoved = [&](const LinkEnd& end) { return end.count > 0 ? end.rest : end.rest + end.driven; };
      LinkWish wish = link_wish(link, i, unmoved(link.ends[1]) - unmoved(link.ends[0]));
      wish.thread = thread.first, wish.joined = first >= 0;
      if (first < 0) thread.add_parts_without_nodes(&wish), first = i;
      const LinkRow row(wish, kLinkSource, nullptr);
      link.row_of = rows.add(&row.wish, 1);
      made = made && link.row_of >= 0;
    }
    if (!made) flags |= PALPATE_STEP_CONTACTS_DROPPED, rows.take_back(before);
    if (made && admission.admit(before, false, &deferred)) first = -1;
    if (deferred) flags |= PALPATE_STEP_WORK_DEFERRED;
    for (std::int32_t i = thread.first; i < thread.end && first >= 0; ++i) links_[i].row_of = -1;
  });
  return flags;
}

// What the links that act take, with so many contact nodes. What slack ones take, read_reactions() adds itself: the step before cannot tell.
Operations Links::operations_to_end(std::int32_t contact_nodes) const {
  Operations nodes = 0, act = 0, turning = 0;
  for_threads([&](const auto& thread) {
    Operations of_thread = 0;
    for (std::int32_t i = thread.first; i < thread.end; ++i)
      if (links_[i].row_of >= 0) ++act, of_thread += links_[i].ends[0].count + links_[i].ends[1].count;
    nodes += of_thread;
    if (thread.parts() > 1) turning += 9 * of_thread * of_thread / kDense;
  });
  return kOfLink * act + 3 * nodes * contact_nodes + turning;
}

void Links::end(TouchStep& step) {
  TouchState& state = *step.state;
  const ContactConstraints& set = state.rows.set();
  state.work.add(operations_to_end(set.node_count));
  step.flags |= read_reactions(set, state.force, state.solver, step.is_solved, state.step + 1, &step.unasked);
}

void Links::tell(TouchStep&, EventSink& to) {
  for (std::int32_t i = 0; i < count_; ++i) {
    const Link& link = links_[i];
    const palpate_link_condition now = link.state.condition;
    if (now == link.before) continue;
    const int e = link.given.ends[0].kind == PALPATE_END_SURFACE_POINT ? 0 : 1;
    const SurfacePoint place = surface_point_of(link.given.ends[e].triangle, link.given.ends[e].barycentric);
    to.tell_event(now == PALPATE_LINK_TAUT     ? PALPATE_EVENT_LINK_TAUT
                  : now == PALPATE_LINK_BROKEN ? PALPATE_EVENT_LINK_BROKE
                                               : PALPATE_EVENT_LINK_SLACK,
                  link.state.id, place, link.ends[e].at());
  }
}

std::uint32_t Links::read_reactions(const ContactConstraints& set, const Vec3* force, const ContactSolver& solver,
                                    bool solved, std::uint64_t step, Operations* work) {
  std::uint32_t flags = 0;
  const bool known = walk(set, solver, solved);
  for_threads([&](const auto& thread) {
    std::int32_t row = -1;
    for (std::int32_t i = thread.first; i < thread.end; ++i) {
      Link& link = links_[i];
      const bool rests = known && may_rest(i);
      slacken_link(link);
      if (!solved) link.row_of = -1;
      row = std::max(row, link.row_of);
      link.fresh = !rests;
      if (rests) continue;
      std::int32_t first = link.row_of < 0 ? -1 : set.constraints[link.row_of].first_node;
      for (LinkEnd& end : link.ends) {
        end.moved = moved_by({set, force, solver, *source_.field}, end, first);
        if (first >= 0) first += end.count;
        if (link.row_of < 0) *work += to_move(end, set.node_count);
      }
      if (link.row_of >= 0) link.own = compliance_between(set, solver, i, i);
      link.path = path_;
    }
    if (row >= 0) {
      flags |= thread.read(solver.reaction(row), step);
      thread.turn([&](std::int32_t j, std::int32_t k) { return compliance_between(set, solver, j, k); });
      if (thread.slides_short()) flags |= PALPATE_STEP_REGULARISED;
    } else if (thread.is_broken()) {
      thread.run_out();
    }
    for (std::int32_t i = thread.first; i < thread.end; ++i)
      links_[i].state.rest_length = std::max(0.0, links_[i].rest_length);
  });
  return flags;
}

// m/N, of the ends of link j against one another by a force on those of link k, without their shares.
Mat3 Links::compliance_between(const ContactConstraints& set, const ContactSolver& solver, std::int32_t j,
                               std::int32_t k) const {
  Mat3 sum;
  add_scaled(sum, 1 / (links_[j].share * links_[k].share),
             solver.matrix().compliance_between_nodes(set, links_[j].row_of, links_[k].row_of));
  return sum;
}

const palpate_link_state* Links::state(std::int32_t i) const {
  if (i < 0 || i >= count_) return nullptr;
  Link& link = links_[i];
  Vec3 now[2];
  for (int e = 0; e < 2; ++e) {
    const LinkEnd& end = link.ends[e];
    now[e] = end.rest + (link.fresh ? end.moved : moved_by(*source_.field, end)) + end.driven;
    store3(now[e], link.state.ends[e]);
  }
  link.state.length = length(now[1] - now[0]);
  return &link.state;
}

}  // namespace palpate
