#include "runtime/contact/links.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"

namespace palpate {
namespace {

constexpr double kFarthest = 1e6;  // m, as palpate.h states
// A line that turned by less (0.1 milliradian) keeps its row: the force is then off by a ten-thousandth across the line.
constexpr double kTurned = 1 - 0.5e-8;
// The factor covers that stored columns, rounded to half precision or packed, differ from the compliance that the energy is of; the
// length, m, that sums round.
constexpr double kBoundFactor = 1.1, kLeastSlack = 1e-6;
// Of the length that would make the tensions of two neighbours on one thread equal, if each link were alone, a step moves this share.
constexpr double kRunsOn = 0.5;

bool is_known(int kind, int last) {
  return kind >= 1 && kind <= last;
}

// What is wrong with the numbers of an end; nullptr: nothing.
const char* fault_of(const palpate_link_end& end, std::int32_t triangles) {
  if (!is_known(enum_number(end.kind), PALPATE_END_WORLD)) return "an end of kind SURFACE_POINT or WORLD";
  if (end.kind == PALPATE_END_WORLD) return is_position(end.point) ? nullptr : "an end's point within 1e6 m";
  if (end.triangle < 0 || end.triangle >= triangles) return "an end's triangle from 0 to F-1";
  double sum = 0;
  for (const double k : end.barycentric) {
    if (!(k >= -1e-6 && k <= 1 + 1e-6)) return "barycentric weights from 0 to 1";
    sum += k;
  }
  return std::fabs(sum - 1) <= 1e-6 ? nullptr : "barycentric weights that sum to 1";
}

const char* fault_of(const palpate_link& link, std::int32_t triangles, bool has_discs) {
  if (!is_known(enum_number(link.kind), PALPATE_LINK_CLIP)) return "a kind THREAD, SPRING or CLIP";
  for (const palpate_link_end& end : link.ends)
    if (const char* fault = fault_of(end, triangles)) return fault;
  if (link.ends[0].kind == PALPATE_END_WORLD && link.ends[1].kind == PALPATE_END_WORLD)
    return "at least one end on the organ's surface";
  if (!(link.rest_length >= 0 && link.rest_length <= kFarthest)) return "a rest_length from 0 to 1e6 m";
  if (link.kind == PALPATE_LINK_CLIP && link.rest_length != 0) return "a CLIP of rest_length 0";
  if (!(link.stiffness > 0)) return "a stiffness above 0 N/m";
  if (!(link.breaking_force > 0)) return "a breaking_force above 0 N";
  if (!(link.radius >= 0 && link.radius <= 1)) return "a radius from 0 to 1 m";
  if (link.radius > 0 && !has_discs) return "a radius of 0 in a scene whose contact is not PATCH";
  if (link.runs_on && link.kind != PALPATE_LINK_THREAD) return "runs_on on a THREAD alone";
  return nullptr;
}

bool same_place(const palpate_link_end& a, const palpate_link_end& b) {
  if (a.kind != b.kind) return false;
  if (a.kind == PALPATE_END_WORLD) return true;  // it may be moved
  return a.triangle == b.triangle && std::equal(a.barycentric, a.barycentric + 3, b.barycentric);
}

// m/N, beside the tissue's.
double own_softness(const palpate_link& link) {
  return 1 / link.stiffness;
}

}  // namespace

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

void Links::find_disc(const SurfacePoint& place, double radius, LinkEnd* to) {
  TouchableDisc disc;
  press_disc(source_.disc, place, radius, LinkEnd::kMostNodes, &disc);
  if (disc.count == 0) return;
  to->count = disc.count, to->local = disc.local;
  std::copy(disc.node, disc.node + disc.count, to->node);
  std::copy(disc.weight, disc.weight + disc.count, to->weight);
}

void Links::find_end(const palpate_link& link, const palpate_link_end& from, LinkEnd* to) {
  *to = LinkEnd{};
  if (from.kind == PALPATE_END_WORLD) return;
  const SurfacePoint place = surface_point_of(from.triangle, from.barycentric);
  const std::int32_t* const corner = source_.triangles + 3 * static_cast<std::size_t>(from.triangle);
  double sum = 0;
  for (int v = 0; v < 3; ++v) {
    to->rest += from.barycentric[v] * load3(source_.disc.rest + 3 * static_cast<std::size_t>(corner[v]));
    if (source_.disc.column_of_node[corner[v]] < 0 || !(from.barycentric[v] > 0)) continue;
    to->node[to->count] = corner[v], to->weight[to->count++] = from.barycentric[v];
    sum += from.barycentric[v];
  }
  for (int e = 0; e < to->count; ++e) to->weight[e] /= sum;
  if (link.radius > 0 && to->count > 0) find_disc(place, link.radius, to);
}

// |u| <= reach norm of the weighted mean of the end's nodes: the largest eigenvalue of a node's compliance is at most its trace.
double Links::reach_of(const LinkEnd& end) const {
  double reach = 0;
  for (int v = 0; v < end.count; ++v) {
    Mat3 compliance;
    self_compliance(source_.stiffness + 9 * static_cast<std::size_t>(source_.disc.column_of_node[end.node[v]]),
                    &compliance);
    reach += std::fabs(end.weight[v]) *
             std::sqrt(std::max(0.0, compliance.m[0][0] + compliance.m[1][1] + compliance.m[2][2]));
  }
  return reach;
}

void Links::start(Link& link, const palpate_link& given, std::int32_t index) {
  link.given = given;
  link.along = {}, link.rest_length = given.rest_length, link.own = Mat3{}, link.taut = 0, link.row_of = -1;
  link.ends[0].moved = link.ends[1].moved = {};
  link.fresh = 1, link.before = PALPATE_LINK_SLACK, link.path = -INFINITY;
  link.state = {};
  link.state.id = given.id == -1 ? index : given.id;
  link.state.rest_length = given.rest_length;
}

palpate_status Links::set(const palpate_link* links, std::int32_t count, palpate_error* error) {
  if (count < 0 || count > capacity_)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_scene_set_links: expected 0 to max_links (%d) links, found %d; raise max_links",
                static_cast<int>(capacity_), static_cast<int>(count));
  if (count > 0 && !links) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "links must not be NULL");
  for (std::int32_t i = 0; i < count; ++i) {
    palpate_link given = palpate_default_link();
    const auto* const from = reinterpret_cast<const palpate_link*>(reinterpret_cast<const unsigned char*>(links) +
                                                                   static_cast<std::size_t>(i) * links->struct_bytes);
    if (const palpate_status status = read_host_struct("link", from, &given, error)) return status;
    const char* fault = fault_of(given, source_.triangle_count, source_.disc.patch != nullptr);
    if (!fault && from->struct_bytes != links->struct_bytes) fault = "the same struct_bytes in all links";
    if (!fault && given.id < -1) fault = "an id of 0 or more, or -1";
    const std::int32_t id = given.id == -1 ? i : given.id;
    for (std::int32_t other = 0; other < i && !fault; ++other)
      if (coming_[other].state.id == id) fault = "another id for each link";
    if (!fault && given.runs_on && i + 1 == count) fault = "a link behind one that runs on";
    if (!fault && i > 0 && coming_[i - 1].given.runs_on && given.kind != PALPATE_LINK_THREAD)
      fault = "a THREAD behind one that runs on";
    if (fault)
      return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                  "palpate_link: link %d: expected %s, found something else; the scene keeps its links",
                  static_cast<int>(i), fault);
    given.struct_bytes = sizeof(palpate_link);
    start(coming_[i], given, i);
  }
  for (std::int32_t i = 0; i < count; ++i) {
    Link& link = coming_[i];
    const Link* const end = links_ + count_;
    const Link* const known =
        std::find_if(static_cast<const Link*>(links_), end, [&](const Link& l) { return l.state.id == link.state.id; });
    if (known != end && known->given.kind == link.given.kind && known->given.radius == link.given.radius &&
        same_place(known->given.ends[0], link.given.ends[0]) && same_place(known->given.ends[1], link.given.ends[1])) {
      const palpate_link given = link.given;
      link = *known;
      link.rest_length = std::max(0.0, known->rest_length + given.rest_length - known->given.rest_length);
      link.given = given;
      continue;
    }
    link.reach = 0;
    for (int e = 0; e < 2; ++e) {
      find_end(link.given, link.given.ends[e], &link.ends[e]);
      link.reach += reach_of(link.ends[e]);
    }
  }
  std::swap(links_, coming_);
  count_ = count;
  return succeed(error);
}

void Links::forget() {
  for (std::int32_t i = 0; i < count_; ++i) start(links_[i], links_[i].given, i);
}

// ---- a step ----------------------------------------------------------------------------------------------------------

// Whether the link asks for rows. A slack thread does where the last step has stretched it.
bool Links::acts(const Link& link) const {
  if (link.state.condition == PALPATE_LINK_BROKEN || link.ends[0].count + link.ends[1].count == 0) return false;
  if (link.given.kind != PALPATE_LINK_THREAD) return true;
  return link.taut || (link.fresh && length(at(link.ends[1]) - at(link.ends[0])) > link.rest_length);
}

bool Links::in_chain(std::int32_t i) const {
  return links_[i].given.runs_on || (i > 0 && links_[i - 1].given.runs_on);
}

// m: no longer than this, since its ends were found.
double Links::longest(const Link& link) const {
  return length(at(link.ends[1]) - at(link.ends[0])) + kBoundFactor * link.reach * (path_ - link.path);
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

// The line between the ends as the last step left them, corrected for what the link's own force does there. Without the link the ends
// would be y = x + T C t apart. With it they are x = (L + T/k) t apart in the end, so that t is along (L + T/k + T C)^-1 y. To follow
// the line of x itself does not converge where T C is large against L.
void Links::turn(Link& link) const {
  const double pull = std::max(0.0, link.state.tension);
  Vec3 line = at(link.ends[1]) - at(link.ends[0]);
  if (pull > 0) {
    Mat3 system;
    add_scaled(system, pull, link.own);
    line += system * link.along;
    for (int i = 0; i < 3; ++i) system.m[i][i] += link.rest_length + pull * own_softness(link.given);
    line = solve3(system, line);
  }
  const Vec3 along = is_finite(line) ? unit_or_zero(line) : Vec3{};
  if (length(along) == 0)
    link.along = length(link.along) > 0 ? link.along : Vec3{0, 0, 1};
  else if (!(dot(along, link.along) > kTurned))
    link.along = along;
}

std::int32_t Links::begin(const OrganPose& organ, const Tensors& tensors, const ContactSolver& solver) {
  std::int32_t act = 0;
  for (std::int32_t i = 0; i < count_; ++i) {
    Link& link = links_[i];
    link.row_of = -1, link.before = link.state.condition;
    for (int e = 0; e < 2; ++e)
      if (link.given.ends[e].kind == PALPATE_END_WORLD)
        link.ends[e].rest = organ.point_to_organ(load3(link.given.ends[e].point));
    // A shorter rest length or an end that moved in the world may have used up what the bound left.
    if (!link.fresh && !(longest(link) + kLeastSlack < link.rest_length)) {
      for (LinkEnd& end : link.ends) end.moved = last_move(end, tensors, solver);
      link.fresh = 1, link.path = path_;
    }
    act += acts(link);
  }
  return act;
}

std::uint32_t Links::request(ContactRows& rows, ContactAdmission& admission) {
  std::uint32_t flags = 0;
  for (std::int32_t i = 0; i < count_; ++i) {
    Link& link = links_[i];
    if (!acts(link)) continue;
    const bool clip = link.given.kind == PALPATE_LINK_CLIP;
    if (!clip) turn(link);
    LinkWish wish;
    wish.link = i, wish.ends = link.ends, wish.softness = own_softness(link.given);
    wish.law = link.given.kind == PALPATE_LINK_THREAD ? ContactLaw::unilateral
               : clip                                 ? ContactLaw::sticking
                                                      : ContactLaw::sliding;
    const Vec3 apart = link.ends[1].rest - link.ends[0].rest;
    wish.along = link.along;
    wish.target = clip ? apart : Vec3{dot(link.along, apart) - link.rest_length, 0, 0};
    link.row_of = rows.add_link(wish);
    if (link.row_of < 0) {
      flags |= PALPATE_STEP_CONTACTS_DROPPED;
      continue;
    }
    bool deferred = false;
    if (!admission.admit(link.row_of, false, &deferred)) link.row_of = -1;
    if (deferred) flags |= PALPATE_STEP_WORK_DEFERRED;
  }
  return flags;
}

Vec3 Links::last_move(const LinkEnd& end, const Tensors& tensors, const ContactSolver& solver) {
  Vec3 moved;
  for (int v = 0; v < end.count; ++v) moved += end.weight[v] * solver.last_displacement(tensors, end.node[v]);
  return is_finite(moved) ? moved : Vec3{};
}

Operations Links::operations_to_end(std::int32_t contact_nodes) const {
  Operations nodes = 0, act = 0;
  for (std::int32_t i = 0; i < count_; ++i)
    if (links_[i].row_of >= 0) ++act, nodes += links_[i].ends[0].count + links_[i].ends[1].count;
  return 20 * act + 3 * nodes * contact_nodes;
}

void Links::move_ends(Link& link, const Tensors& tensors, const ContactConstraints& set, const Vec3* force,
                      const Vec3* modified, const ContactSolver& solver) const {
  std::int32_t e = link.row_of < 0 ? -1 : set.constraints[link.row_of].first_node;
  for (LinkEnd& end : link.ends) {
    end.moved = {};
    for (int v = 0; v < end.count; ++v) {
      Vec3 u;
      if (e >= 0)
        u = solver.displacement(set, force, e++);
      else
        for (std::int32_t b = 0; b < set.node_count; ++b)
          u += tensors.displacement(end.node[v], set.nodes[b].column) * modified[b];
      end.moved += end.weight[v] * u;
    }
    if (!is_finite(end.moved)) end.moved = {};
  }
}

// The reaction, the compliance and whether the link breaks.
std::uint32_t Links::read_solution(Link& link, const ContactConstraints& set, const ContactSolver& solver,
                                   std::uint64_t step) const {
  const std::int32_t p = link.row_of;
  const Vec3 reaction = solver.reaction(p);
  const bool clip = link.given.kind == PALPATE_LINK_CLIP;
  const Vec3 pull = clip ? reaction : reaction.x * link.along;
  link.state.tension = clip ? length(reaction) : reaction.x;
  store3(pull, link.state.force);
  link.own = solver.compliance_between_nodes(set, p);
  link.taut = link.state.tension > 0;
  if (link.taut || link.given.kind != PALPATE_LINK_THREAD) link.state.condition = PALPATE_LINK_TAUT;
  if (!(std::fabs(link.state.tension) > link.given.breaking_force)) return 0;
  link.state.condition = PALPATE_LINK_BROKEN, link.state.broken = step;
  return PALPATE_STEP_LINK_BROKE;
}

std::uint32_t Links::end(const Tensors& tensors, const ContactConstraints& set, const Vec3* force, const Vec3* modified,
                         const ContactSolver& solver, bool solved, std::uint64_t step) {
  std::uint32_t flags = 0;
  const bool known = walk(set, solver, solved);
  for (std::int32_t i = 0; i < count_; ++i) {
    Link& link = links_[i];
    palpate_link_state& state = link.state;
    const bool rests = known && may_rest(i);
    link.taut = 0, state.tension = 0;
    store3({}, state.force);
    if (state.condition != PALPATE_LINK_BROKEN) state.condition = PALPATE_LINK_SLACK;
    if (!solved) link.row_of = -1;
    if (link.row_of >= 0) flags |= read_solution(link, set, solver, step);
    link.fresh = !rests;
    if (rests) continue;
    move_ends(link, tensors, set, force, modified, solver);
    link.path = path_;
  }
  run_on();
  for (std::int32_t i = 0; i < count_; ++i) links_[i].state.rest_length = links_[i].rest_length;
  return flags;
}

const palpate_link_state* Links::state(std::int32_t i, const Tensors& tensors, const ContactSolver& solver) const {
  if (i < 0 || i >= count_) return nullptr;
  Link& link = links_[i];
  Vec3 now[2];
  for (int e = 0; e < 2; ++e) {
    const LinkEnd& end = link.ends[e];
    now[e] = end.rest + (link.fresh ? end.moved : last_move(end, tensors, solver));
    store3(now[e], link.state.ends[e]);
  }
  link.state.length = length(now[1] - now[0]);
  return &link.state;
}

// Lets neighbours on one thread share its length. A slack part counts with the tension below zero at which its slack would be gone.
void Links::run_on() {
  const auto softness_of = [](const Link& link) {
    return dot(link.along, link.own * link.along) + own_softness(link.given);
  };
  const auto pull_of = [&](const Link& link, double softness) {
    if (link.taut) return link.state.tension;
    return std::min(0.0, (length(at(link.ends[1]) - at(link.ends[0])) - link.rest_length) / softness);
  };
  for (std::int32_t i = 0; i + 1 < count_; ++i) {
    Link &one = links_[i], &next = links_[i + 1];
    if (!one.given.runs_on) continue;
    const bool ended = one.state.condition == PALPATE_LINK_BROKEN, begins = next.state.condition == PALPATE_LINK_BROKEN;
    if (ended || begins) {
      // Nothing holds the thread where it is broken: it runs out of the part beside, whose tension falls by half in each step.
      Link& whole = ended ? next : one;
      if (ended != begins && whole.taut) whole.rest_length += kRunsOn * whole.state.tension * softness_of(whole);
      continue;
    }
    if (!(one.taut || next.taut)) continue;
    // A part that was never taut has no line yet; it counts as soft as its neighbour.
    double a = softness_of(one), b = softness_of(next);
    if (length(one.along) == 0) a = b;
    if (length(next.along) == 0) b = a;
    if (!(a > 0 && b > 0)) continue;
    double way = kRunsOn * (pull_of(one, a) - pull_of(next, b)) / (1 / a + 1 / b);
    way = std::clamp(way, -one.rest_length, next.rest_length);
    one.rest_length += way, next.rest_length -= way;
  }
}

}  // namespace palpate
