#include "runtime/links/links.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact/touch_step.h"

namespace palpate {
namespace {

// The factor covers that stored columns, rounded to half precision or packed, differ from the compliance that the energy is of; the
// length, m, that sums round.
constexpr Operations kOfLink = 20;
constexpr double kBoundFactor = 1.1, kLeastSlack = 1e-6;

Operations to_move(const Link& link, std::int32_t contact_nodes) {
  return 3 * Operations{link.ends[0].count + link.ends[1].count} * contact_nodes;
}

}  // namespace

bool Links::create(SceneMemory& memory, const LinkedOrgan& organ, std::int32_t capacity, Pass pass) {
  organ_ = organ, pass_ = pass;
  return LinkList::create(memory, &organ_, 1, false, capacity);
}

palpate_status Links::set(const palpate_link* links, std::int32_t count, palpate_error* error) {
  return LinkList::set({"palpate_scene_set_links", "palpate_link", "scene"}, links, count, error,
                       [](const palpate_link* from, Link* link, palpate_error* found) {
                         link->given = palpate_default_link();
                         const palpate_status status = read_host_struct("link", from, &link->given, found);
                         link->given.struct_bytes = sizeof(palpate_link);
                         return status;
                       });
}

// ---- links that are slack --------------------------------------------------------------------------------------------

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
  if (organ_.surface.active) return false;  // the bound is that of the uncut organ
  return link.given.kind == PALPATE_LINK_THREAD && !has_rows(link) && !in_chain(i) && std::isfinite(link.path) &&
         longest(link) + kLeastSlack < link.rest_length;
}

// Adds the norm of this step's change of the field to the path. False where it is not known: then each link is measured.
bool Links::walk(const ContactConstraints& set, const ContactSolver& solver) {
  bool any = false;
  for (std::int32_t i = 0; i < count_ && !any; ++i) any = may_rest(i);
  if (!any) return false;
  const double change = solver.change_norm(set);
  if (!(change >= 0)) return false;
  path_ += change;
  return true;
}

// ---- a step ----------------------------------------------------------------------------------------------------------

std::int32_t Links::begin(TouchStep& step) {
  std::int32_t act = 0;
  place_ends();
  step.unasked += kOfLink * count_;
  for (std::int32_t i = 0; i < count_; ++i) {
    Link& link = links_[i];
    // A shorter rest length or an end that moved in the world may have used up what the bound left.
    if (link.fresh || longest(link) + kLeastSlack < link.rest_length) continue;
    for (int e = 0; e < 2; ++e) move_end(link, e);
    step.unasked += to_move(link, step.state->displacement.loads().count());
    link.fresh = 1, link.path = path_;
  }
  for_threads(links_, count_, [&](const auto& thread) {
    if (!thread.acts()) return;
    for (std::int32_t i = thread.first; i < thread.end; ++i) act += has_nodes(links_[i]);
  });
  return act;
}

void Links::request(TouchStep& step) {
  step.flags |= request_rows();
}

bool Links::add_rows(Link& link, const LinkWish& wish) {
  const LinkRow row(wish, kLinkSource, nullptr);
  link.ends[0].constraint = organ_.touch->rows.add(&row.wish, 1);
  return has_rows(link);
}

bool Links::admits(const Link& first, std::uint32_t* flags) {
  bool deferred = false;
  const bool admitted = organ_.touch->admission.admit(first.ends[0].constraint, false, &deferred);
  if (deferred) *flags |= PALPATE_STEP_WORK_DEFERRED;
  return admitted;
}

// What the links that act take, with so many contact nodes. What slack ones take, end() adds itself: the step before cannot tell.
Operations Links::operations_to_end(std::int32_t contact_nodes) const {
  Operations nodes = 0, act = 0, turning = 0;
  for_threads(links_, count_, [&](const auto& thread) {
    Operations of_thread = 0;
    for (std::int32_t i = thread.first; i < thread.end; ++i)
      if (has_rows(links_[i])) ++act, of_thread += links_[i].ends[0].count + links_[i].ends[1].count;
    nodes += of_thread;
    if (thread.parts() > 1) turning += 9 * of_thread * of_thread / kDense;
  });
  return kOfLink * act + 3 * nodes * contact_nodes + turning;
}

void Links::end(TouchStep& step) {
  TouchState& state = *step.state;
  const std::int32_t nodes = state.rows.set().node_count;
  state.work.add(operations_to_end(nodes));
  knows_path_ = step.is_solved && state.body->responds_linearly() && walk(state.rows.set(), state.solver);
  for (std::int32_t i = 0; i < count_; ++i)
    if (has_rows(links_[i])) links_[i].reaction = step.reaction(links_[i].ends[0].constraint);
  step.flags |= read_reactions(&step.is_solved, state.step + 1);
  for (std::int32_t i = 0; i < count_; ++i)
    if (links_[i].fresh && !has_rows(links_[i])) step.unasked += to_move(links_[i], nodes);
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

}  // namespace palpate
