#include "runtime/links/link.h"

#include <algorithm>
#include <cmath>

#include "runtime/base/host_struct.h"
#include "runtime/contact/contact_laws.h"
#include "runtime/include/palpate/palpate_links.h"
#include "runtime/pose/pose.h"

namespace palpate {
namespace {

constexpr double kFarthest = 1e6;  // m, as palpate.h states
// A line that turned by less (0.1 milliradian) keeps its row: the force is then off by a ten-thousandth across the line.
constexpr double kTurned = 1 - 0.5e-8;
// The same of a part of a thread, as a share of its tension, and the least share that it exerts.
constexpr double kTurnedShare = 1e-4, kLeastShare = 1e-3;

bool is_known(int kind, int last) {
  return kind >= 1 && kind <= last;
}

bool same_place(const palpate_link_end& a, const palpate_link_end& b) {
  if (a.kind != b.kind) return false;
  if (a.kind == PALPATE_END_WORLD) return true;  // it may be moved
  return a.triangle == b.triangle && std::equal(a.barycentric, a.barycentric + 3, b.barycentric);
}

// m, in the organ's frame.
Vec3 place_at_rest(const LinkSurface& surface, const palpate_link_end& end) {
  const std::int32_t* const corner = surface.triangles + 3 * static_cast<std::size_t>(end.triangle);
  Vec3 place;
  for (int v = 0; v < 3; ++v)
    place += end.barycentric[v] * load3(surface.disc.rest + 3 * static_cast<std::size_t>(corner[v]));
  return place;
}

void find_disc(const DiscSource& source, const SurfacePoint& place, double radius, LinkEnd* to) {
  TouchableDisc disc;
  press_disc(source, place, radius, LinkEnd::kMostNodes, &disc);
  if (disc.count == 0) return;
  to->count = disc.count, to->local = disc.local, to->disc = disc.disc;
  std::copy(disc.node, disc.node + disc.count, to->node);
  std::copy(disc.weight, disc.weight + disc.count, to->weight);
}

const char* fault_of(const palpate_link_end& end, const LinkSurface* surface) {
  if (!is_known(enum_number(end.kind), PALPATE_END_WORLD)) return "an end of kind SURFACE_POINT or WORLD";
  if (end.kind == PALPATE_END_WORLD) return is_position(end.point) ? nullptr : "an end's point within 1e6 m";
  if (end.triangle < 0 || !surface || end.triangle >= surface->triangle_count) return "an end's triangle from 0 to F-1";
  if (surface->active && !surface->active[end.triangle]) return "an end's triangle that is part of the surface";
  double sum = 0;
  for (const double k : end.barycentric) {
    if (!(k >= -1e-6 && k <= 1 + 1e-6)) return "barycentric weights from 0 to 1";
    sum += k;
  }
  return std::fabs(sum - 1) <= 1e-6 ? nullptr : "barycentric weights that sum to 1";
}

// The disc of which `share` of a force acts, and whose displacement counts as much.
ContactDisc scaled(const ContactDisc& disc, double share) {
  ContactDisc part = disc;
  part.normal_root = share * disc.normal_root, part.tangent_root = Mat3{};
  add_scaled(part.tangent_root, share, disc.tangent_root);
  return part;
}

}  // namespace

// ---- what the host gives ---------------------------------------------------------------------------------------------

const char* fault_of(const Link* links, std::int32_t index, std::int32_t count, const LinkSurface* const surface[2]) {
  const palpate_link& link = links[index].given;
  if (!is_known(enum_number(link.kind), PALPATE_LINK_CLIP)) return "a kind THREAD, SPRING or CLIP";
  for (int e = 0; e < 2; ++e)
    if (const char* fault = fault_of(link.ends[e], surface[e])) return fault;
  if (link.ends[0].kind == PALPATE_END_WORLD && link.ends[1].kind == PALPATE_END_WORLD)
    return "at least one end on the organ's surface";
  if (!(link.rest_length >= 0 && link.rest_length <= kFarthest)) return "a rest_length from 0 to 1e6 m";
  if (link.kind == PALPATE_LINK_CLIP && link.rest_length != 0) return "a CLIP of rest_length 0";
  if (!(link.stiffness > 0)) return "a stiffness above 0 N/m";
  if (!(link.breaking_force > 0)) return "a breaking_force above 0 N";
  if (!(link.radius >= 0 && link.radius <= 1)) return "a radius from 0 to 1 m";
  for (int e = 0; e < 2; ++e)
    if (link.radius > 0 && surface[e] && !surface[e]->disc.patch)
      return "a radius of 0 in a scene whose contact is not PATCH";
  if (link.runs_on && link.kind != PALPATE_LINK_THREAD) return "runs_on on a THREAD alone";
  if (link.id < -1) return "an id of 0 or more, or -1";
  for (const Link* other = links; other != links + index; ++other)
    if (other->state.id == id_of(link, index)) return "another id for each link";
  if (link.runs_on && index + 1 == count) return "a link behind one that runs on";
  if (index > 0 && links[index - 1].given.runs_on && link.kind != PALPATE_LINK_THREAD)
    return "a THREAD behind one that runs on";
  return nullptr;
}

bool is_same_link(const Link& a, const Link& b) {
  bool same = a.given.kind == b.given.kind && a.given.radius == b.given.radius;
  for (int e = 0; e < 2; ++e)
    same = same && a.ends[e].organ == b.ends[e].organ && same_place(a.given.ends[e], b.given.ends[e]);
  return same;
}

void start_link(Link& link, const palpate_link& given, std::int32_t index) {
  link.given = given;
  link.along = link.pull = link.target = link.reaction = {}, link.share = 1, link.rest_length = given.rest_length,
  link.own = Mat3{}, link.taut = 0;
  drop_rows(link);
  for (LinkEnd& end : link.ends) end.driven = end.moved = end.moved_in_organ = {};
  link.fresh = 1, link.before = PALPATE_LINK_SLACK, link.path = -INFINITY;
  link.state = {};
  link.state.id = id_of(given, index);
  link.state.rest_length = given.rest_length;
}

void continue_link(Link& link, const Link& known) {
  const palpate_link given = link.given;
  link = known;
  link.rest_length = known.rest_length + given.rest_length - known.given.rest_length;
  link.given = given;
}

void find_link_end(const LinkSurface& surface, const palpate_link_end& from, double radius, LinkEnd* to) {
  const std::int32_t organ = to->organ;
  *to = LinkEnd{};
  to->organ = organ;
  if (from.kind == PALPATE_END_WORLD) return;
  to->rest_in_organ = place_at_rest(surface, from);
  const std::int32_t* const corner = surface.triangles + 3 * static_cast<std::size_t>(from.triangle);
  double sum = 0;
  for (int v = 0; v < 3; ++v) {
    if (surface.disc.column_of_node[corner[v]] < 0 || !(from.barycentric[v] > 0)) continue;
    to->node[to->count] = corner[v], to->weight[to->count++] = from.barycentric[v];
    sum += from.barycentric[v];
  }
  for (int e = 0; e < to->count; ++e) to->weight[e] /= sum;
  if (radius > 0 && to->count > 0)
    find_disc(surface.disc, surface_point_of(from.triangle, from.barycentric), radius, to);
}

Vec3 driven_by(const DisplacementField& field, const LinkSurface& surface, const palpate_link_end& given,
               const LinkEnd& end) {
  Vec3 driven;
  if (given.kind == PALPATE_END_WORLD) return driven;
  const std::int32_t* const corner = surface.triangles + 3 * static_cast<std::size_t>(given.triangle);
  for (int v = 0; v < end.count; ++v) driven += end.weight[v] * field.moved_at_node(end.node[v]);
  for (int v = 0; end.count == 0 && v < 3; ++v) driven += given.barycentric[v] * field.moved_at_node(corner[v]);
  return driven;
}

// ---- a step ----------------------------------------------------------------------------------------------------------

// The line between the ends as the last step left them, corrected for what the link's own force does there. Without the link the ends
// would be y = x + T C t apart. With it they are x = (L + T/k) t apart in the end, so that t is along (L + T/k + T C)^-1 y. To follow
// the line of x itself does not converge where T C is large against L.
void turn_link(Link& link) {
  if (const double share = length(link.pull); share > 0) {
    const double least = std::max(kLeastShare, std::min(1.0, share));
    if (length(link.pull - link.share * link.along) > kTurnedShare)
      link.along = unit_or_zero(link.pull), link.share = least;
    return;
  }
  link.share = 1;
  const double pull = std::max(0.0, link.state.tension);
  Vec3 line = link.apart();
  if (pull > 0) {
    Mat3 system;
    add_scaled(system, pull, link.own);
    line += system * link.along;
    for (int i = 0; i < 3; ++i) system.m[i][i] += std::max(0.0, link.rest_length + pull * link.softness());
    line = solve3(system, line);
  }
  const Vec3 along = is_finite(line) ? unit_or_zero(line) : Vec3{};
  if (length(along) == 0)
    link.along = length(link.along) > 0 ? link.along : Vec3{0, 0, 1};
  else if (!(dot(along, link.along) > kTurned))
    link.along = along;
}

Vec3 turned(const Link& link, double tension, Vec3 last) {
  constexpr int kRounds = 3;  // the length follows within some per cent
  Vec3 pull = last, gap = link.gap;
  for (int round = 0; round < kRounds; ++round) {
    Mat3 system;
    add_scaled(system, tension, link.own);
    const Vec3 line = link.gap + system * last;
    for (int i = 0; i < 3; ++i) system.m[i][i] += length(gap);
    const Vec3 next = solve3(system, line);
    if (!is_finite(next)) return last;
    pull = length(next) > 1 ? unit_or_zero(next) : next;
    gap = link.gap - link.own * (tension * (pull - last));
  }
  return pull;
}

ContactLaw law_of(const Link& link) {
  const palpate_link_kind kind = link.given.kind;
  if (kind == PALPATE_LINK_CLIP) return ContactLaw::sticking;
  return kind == PALPATE_LINK_THREAD ? ContactLaw::unilateral : ContactLaw::sliding;
}

LinkWish link_wish(const Link& link, std::int32_t index, Vec3 apart) {
  const bool clip = link.given.kind == PALPATE_LINK_CLIP;
  LinkWish wish;
  wish.link = wish.thread = index, wish.ends = link.ends, wish.softness = link.softness();
  wish.law = law_of(link);
  wish.along = link.along, wish.share = link.share;
  wish.target = clip ? apart : Vec3{link.share * dot(link.along, apart) - link.rest_length, 0, 0};
  return wish;
}

LinkRow::LinkRow(const LinkWish& link, ContactSource source, const Mat3* frame)
    : wish({{source, link.thread, 0}, link.link - link.thread}) {
  const LinkEnd *const a = link.ends, *const b = link.ends + 1;
  ContactConstraint& rows = wish.rows;
  rows.law = link.law, rows.joined = link.joined;
  wish.contact.index = link.link, wish.target = link.target, wish.node = node, wish.weight = weight;
  for (const LinkEnd* end : {a, b})
    for (int v = 0; v < end->count; ++v) {
      node[wish.count] = end->node[v];
      weight[wish.count++] = (end == a ? link.share : -link.share) * end->weight[v];
    }
  rows.discs[0] = scaled(a->disc, link.share), rows.discs[1] = opposite(scaled(b->disc, link.share));
  add_scaled(rows.local, link.share * link.share, a->local);
  add_scaled(rows.local, link.share * link.share, b->local);
  if (a->disc.radius > 0 && b->disc.radius > 0) {
    const Mat3 between = compliance_between(rows.discs[0], rows.discs[1]);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) rows.local.m[i][j] += between.m[i][j] + between.m[j][i];
  }
  if (link.law != ContactLaw::sticking) {
    const Vec3 tangent = across(link.along, {}), row[3] = {link.along, tangent, cross(link.along, tangent)};
    wish.set_frame(row);
    rows.axes = link.joined ? 0 : 1;
  } else if (frame) {
    rows.frame = *frame, rows.framed = true;
  }
  if (rows.framed) {
    rows.local = times_transposed(rows.frame * rows.local, rows.frame);
    for (ContactDisc& disc : rows.discs) disc = in_frame(disc, rows.frame);
  }
  for (int i = 0; i < 3; ++i) rows.local.m[i][i] += link.softness;
}

void slacken_link(Link& link) {
  link.taut = 0, link.state.tension = 0;
  store3({}, link.state.force);
  if (link.state.condition != PALPATE_LINK_BROKEN) link.state.condition = PALPATE_LINK_SLACK;
}

std::uint32_t read_reaction(Link& link, Vec3 reaction, bool may_break, std::uint64_t step) {
  const bool clip = link.given.kind == PALPATE_LINK_CLIP;
  const Vec3 pull = clip ? reaction : (link.share * reaction.x) * link.along;
  link.state.tension = clip ? length(reaction) : reaction.x;
  store3(pull, link.state.force);
  link.taut = link.state.tension > 0;
  if (link.taut || link.given.kind != PALPATE_LINK_THREAD) link.state.condition = PALPATE_LINK_TAUT;
  if (!may_break || !(std::fabs(link.state.tension) > link.given.breaking_force)) return 0;
  link.state.condition = PALPATE_LINK_BROKEN, link.state.broken = step;
  return PALPATE_STEP_LINK_BROKE;
}

Vec3 moved_by(const DisplacementField& field, const LinkEnd& end) {
  Vec3 moved;
  for (int v = 0; v < end.count; ++v) moved += end.weight[v] * field.by_contacts(end.node[v]);
  return is_finite(moved) ? moved : Vec3{};
}

}  // namespace palpate
