#include "runtime/world/pair_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/contact/nearest_few.h"

namespace palpate {
namespace {

// In mean edges of the second organ: within which a vertex counts as near; by how much it must go farther to count as far again; within
// which a vertex is looked for; after which motion a pair is looked at again; by how much its place lags behind the vertex.
constexpr double kMargin = 0.25, kStays = 1.5, kReach = 2, kAgain = 0.02, kLag = 0.02, kLagWhereItSticks = 1;
// In mean edges of the second organ: a vertex that is farther inside, and that no pair holds, is told. Near that it is looked at before it can get
// there.
constexpr double kDeep = 0.1;
// A place that goes to and fro follows its vertex by a share of the way. Where organs or supports move, that share is at least the first number, and
// grows to so many times itself in each step in which the place goes on: the place keeps up with the organs.
constexpr double kLeastFollow = 1.0 / 32, kOnward = 1.1;
// Where organs and supports stand, the share is at least the first number, and grows by so much of itself the first time that the place goes on, twice
// as much the second time, and so on: the place comes to rest.
constexpr double kLeastFollowAtRest = 1.0 / 256, kOnwardAtRest = 0.01;
// Between ways whose cosine is less than 1 over this, a share grows or falls by part of that alone.
constexpr double kRamp = 4;
// A place turns back only where its way is longer than so many mean edges.
constexpr double kStill = 1e-3;
// Radians, by which the surface turns before a pair's normal follows: 0.05 degrees, so that the rows of pairs at rest stay as they are.
constexpr double kTurned = 9e-4;
// The two surfaces face one another where their normals differ by more than about 100 degrees (cosine).
constexpr double kFaces = -0.2;
// A vertex that is less than this far from the surface, in mean edges, has no direction of its own.
constexpr double kOnSurface = 1e-3;
// Barycentric weight below which a place is on an edge: rounding.
constexpr double kOnEdge = 1e-9;
// Beyond this angle between the way to the vertex and the normal, the place is on an edge of the organ (cosine of 25 degrees).
constexpr double kOverFace = 0.9063;
// Where the surface has turned by more than 60 degrees since it was at rest (cosine), friction above 0.58 holds tissue without pressing it in.
constexpr double kSteep = 0.5;

// m, of a place on an organ: the mean of what of_node says of its corners.
template <typename OfNode>
Vec3 mean_of_corners(const SurfaceTree& tree, const OrganPair& pair, const OfNode& of_node) {
  const std::int32_t* const corner = tree.corners(pair.triangle);
  Vec3 sum;
  for (int v = 0; v < 3; ++v) sum += pair.barycentric[v] * of_node(corner[v]);
  return sum;
}

// To how many times itself the share of a Follow grows. onward: as there.
double growth_of(const OrganGroup& group, double onward) {
  return group.moves ? kOnward : 1 + kOnwardAtRest * onward;
}

// How far two ways go on in one direction, from 1 to -1 where the second one turns back. still: a way no longer than that does not turn back.
double going_on(Vec3 way, Vec3 next, double still) {
  const double sizes = length(way) * length(next);
  if (!(sizes > 0)) return 0;
  const double cosine = dot(way, next) / sizes;
  return cosine < 0 ? cosine * std::clamp(length(next) / still - 1, 0.0, 1.0) : cosine;
}

// The share of the way `along` that a place or a normal goes. It changes without a jump as the way turns: where it jumped, a way across the last
// one made the last bits of two machines a per cent of their forces.
double share_of(const OrganGroup& group, Vec3 along, double still, Follow* follow) {
  const double on = std::clamp(kRamp * going_on(follow->way, along, still), -1.0, 1.0),
               least = group.moves ? kLeastFollow : kLeastFollowAtRest;
  follow->onward = (1 + std::min(0.0, on)) * follow->onward + std::max(0.0, on);
  const double grows = on < 0 ? 1 + 0.5 * on : 1 + (growth_of(group, follow->onward) - 1) * on;
  follow->share = std::clamp(grows * follow->share, least, 1.0);
  follow->way = follow->share * along;
  return follow->share;
}

// The normal of a pair goes from `before` towards what it is now. Returns whether it is there, within kTurned.
bool turn(const OrganGroup& group, Vec3 before, OrganPair* pair) {
  const Vec3 along = pair->normal - before;
  const double left = length(along) - kTurned;
  const double share = left > 0 ? share_of(group, along, kTurned, &pair->turns) * left / (left + kTurned) : 0;
  const Vec3 normal = unit_or_zero(before + share * along);
  pair->normal = length(normal) > 0 ? normal : before;
  pair->tangent = across(pair->normal, pair->tangent);
  return (1 - share) * length(along) <= kTurned * (1 + 1e-6);
}

bool has_stepped(const TouchState& organ) {
  return organ.field->has_offset() && organ.offset.stepped() > 0;
}

double signed_distance(const NearestPoint& nearest) {
  return nearest.outside ? nearest.distance : -nearest.distance;
}

}  // namespace

double moving_share(const TouchState& second, const OrganPair& pair) {
  const std::int32_t* const corner = second.surface.triangles + 3 * static_cast<std::size_t>(pair.triangle);
  double moves = 0;
  for (int v = 0; v < 3; ++v)
    if (second.surface.column_of_node[corner[v]] >= 0) moves += pair.barycentric[v];
  return moves;
}

bool PairSearch::create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t count, std::int32_t most_pairs,
                        double friction) {
  organs_ = organs, organ_count_ = count, most_ = most_pairs, has_friction_ = friction > 0;
  for (std::int32_t k = 0; k < count; ++k)
    if (!surface_[k].create(memory, *organs_[k])) return false;
  const std::int32_t most_groups = count * (count - 1);
  groups_ = memory.array<OrganGroup>(static_cast<std::size_t>(most_groups));
  motions_ = memory.array<OrganGroup::Motion>(static_cast<std::size_t>(most_groups));
  if (memory.failed()) return false;
  for (std::int32_t k = 0; k < count; ++k)
    for (std::int32_t other = k + 1; other < count; ++other)
      for (const bool second : {false, true}) {
        OrganGroup& group = groups_[group_count_] = OrganGroup{};
        const bool first_is_finer = surface_[k].tree().mean_edge() <= surface_[other].tree().mean_edge();
        group.second = second;
        group.a = first_is_finer != second ? k : other, group.b = first_is_finer != second ? other : k;
        const double edge = surface_[group.b].tree().mean_edge();
        group.margin = kMargin * edge, group.reach = kReach * std::max(edge, surface_[group.a].tree().mean_edge());
        group.motion = motions_ + group_count_++;
        capacity_ += surface_[group.a].tree().surface_nodes();
      }
  const auto vertices = static_cast<std::size_t>(capacity_);
  looks_ = memory.array<OrganGroup::Look>(vertices);
  for (double** array : {&overlap_, &overlap_at_rest_, &inside_at_rest_}) *array = memory.array<double>(vertices);
  if (memory.failed()) return false;
  std::size_t first = 0;
  for (std::int32_t g = 0; g < group_count_; ++g) {
    OrganGroup& group = groups_[g];
    group.look = looks_ + first, group.overlap = overlap_ + first, group.overlap_at_rest = overlap_at_rest_ + first;
    group.inside_at_rest = inside_at_rest_ + first;
    first += static_cast<std::size_t>(surface_[group.a].tree().surface_nodes());
  }
  memory.keep_array(motions_, static_cast<std::size_t>(group_count_));
  memory.keep_array(looks_, vertices);
  memory.keep_array(overlap_, vertices);
  pairs_ = memory.array<OrganPair>(static_cast<std::size_t>(capacity_));
  found_ = memory.array<OrganPair>(static_cast<std::size_t>(capacity_));
  nearness_ = memory.array<double>(static_cast<std::size_t>(capacity_));
  memory.keep(count_);
  memory.keep_array(pairs_, static_cast<std::size_t>(capacity_), count_);
  if (memory.failed()) return false;
  for (std::int32_t g = 0; g < group_count_; ++g) find_overlaps(groups_[g]);
  forget();
  return true;
}

void PairSearch::forget() {
  count_ = 0;
  for (std::int32_t k = 0; k < organ_count_; ++k) surface_[k].forget();
  for (std::int32_t g = 0; g < group_count_; ++g) {
    OrganGroup& group = groups_[g];
    *group.motion = {};
    group.motion->pose_a = touch(group.a).organ.pose(), group.motion->pose_b = touch(group.b).organ.pose();
    const std::int32_t vertices = surface_[group.a].tree().surface_nodes();
    for (std::int32_t v = 0; v < vertices; ++v) group.look[v] = {}, group.overlap[v] = group.overlap_at_rest[v];
  }
}

// ---- motion ----------------------------------------------------------------------------------------------------------

void PairSearch::measure_motion(OrganGroup& group) const {
  TouchState &a = touch(group.a), &b = touch(group.b);
  const OrganSurface &of_a = surface_[group.a], &of_b = surface_[group.b];
  OrganGroup::Motion& motion = *group.motion;
  const double path_a = of_a.deformed().path(), path_b = of_b.deformed().path();
  const std::uint64_t changes = a.surface.changes + b.surface.changes;
  // An organ that was reset alone, or whose surface has other triangles: everything is looked at.
  if (path_a < motion.path_a || path_b < motion.path_b || changes != motion.changes)
    std::fill(group.look, group.look + of_a.tree().surface_nodes(), OrganGroup::Look{});
  const Pose &now_a = a.organ.pose(), &now_b = b.organ.pose();
  group.pose_a_before = motion.pose_a, group.pose_b_before = motion.pose_b;
  const bool poses_change = !same_pose(now_a, motion.pose_a) || !same_pose(now_b, motion.pose_b);
  group.moves = poses_change || has_stepped(a) || has_stepped(b);
  if (poses_change) {
    const double far = of_a.deformed().farthest_from_rest();
    const Vec3 room = {far, far, far};
    motion.way +=
        longest_way(motion.pose_a, motion.pose_b, {now_a, of_a.tree().low() - room, of_a.tree().high() + room}, now_b);
    motion.pose_a = now_a, motion.pose_b = now_b;
  }
  motion.path_a = path_a, motion.path_b = path_b, motion.changes = changes;
}

void PairSearch::look_after(OrganGroup& group, std::int32_t vertex, double room, double per_path) const {
  const OrganGroup::Motion& motion = *group.motion;
  group.look[vertex] = {room, motion.path_a, motion.path_b, motion.way, per_path};
}

bool PairSearch::is_due(const OrganGroup& group, std::int32_t vertex) const {
  const OrganGroup::Look& look = group.look[vertex];
  const OrganGroup::Motion& now = *group.motion;
  return !(look.room > touch(group.a).surface.node_reach[vertex] * (now.path_a - look.path_a) +
                           look.per_path * (now.path_b - look.path_b) + (now.way - look.way));
}

// Whether the boxes of the two organs, as they are now, are apart by more than the margin.
bool PairSearch::is_apart(const OrganGroup& group) const {
  const OrganSurface &of_a = surface_[group.a], &of_b = surface_[group.b];
  const double room =
      of_a.deformed().farthest_from_rest() + of_b.deformed().farthest_from_rest() + kStays * group.margin;
  return are_apart({touch(group.a).organ.pose(), of_a.tree().low(), of_a.tree().high()},
                   {touch(group.b).organ.pose(), of_b.tree().low(), of_b.tree().high()}, room);
}

// ---- one vertex ------------------------------------------------------------------------------------------------------

Vec3 PairSearch::vertex_at_rest(const OrganPair& pair) const {
  const OrganGroup& g = group(pair);
  return to_second(g, surface_[g.a].tree().at_rest(pair.vertex));
}

Vec3 PairSearch::place_at_rest(const OrganPair& pair) const {
  return surface_[group(pair).b].tree().at_rest(surface_point_of(pair.triangle, pair.barycentric));
}

Vec3 PairSearch::target(const OrganPair& pair) const {
  const Vec3 apart = vertex_at_rest(pair) - place_at_rest(pair);
  return {-dot(pair.normal, apart) + pair.bulge - pair.overlap, -dot(pair.tangent, apart),
          -dot(cross(pair.normal, pair.tangent), apart)};
}

Vec3 PairSearch::moved_apart(const OrganPair& pair) const {
  const OrganGroup& g = group(pair);
  const TouchState &a = touch(g.a), &b = touch(g.b);
  const OrganSurface& of_b = surface_[g.b];
  if (!a.field->has_offset() && !b.field->has_offset()) return {};
  const Vec3 apart = turned_to_second(g, a.field->moved_at_node(pair.vertex)) -
                     mean_of_corners(of_b.tree(), pair, [&](std::int32_t n) { return b.field->moved_at_node(n); });
  return {dot(pair.normal, apart), dot(pair.tangent, apart), dot(cross(pair.normal, pair.tangent), apart)};
}

// Where the last step has left a vertex of the first organ, in the second one's frame, as its surface at the pair has moved since.
// vertex: where it is now, in the first organ's frame.
Vec3 PairSearch::left_by_last_step(const OrganGroup& group, const OrganPair& pair, Vec3 vertex) const {
  const TouchState &a = touch(group.a), &b = touch(group.b);
  const OrganSurface& of_b = surface_[group.b];
  const Vec3 step_a = has_stepped(a) ? a.offset.step_of(pair.vertex) : Vec3{};
  const Vec3 left = to_second_before(group, vertex - step_a);
  if (!has_stepped(b)) return left;
  return left + mean_of_corners(of_b.tree(), pair, [&](std::int32_t n) { return b.offset.step_of(n); });
}

// The place of the pair and its normal. off: from the nearest place to the vertex.
void PairSearch::anchor(const OrganGroup& group, const NearestPoint& nearest, Vec3 off, OrganPair* pair) {
  const OrganSurface& of_b = surface_[group.b];
  Vec3 normal = surface_[group.b].normal(nearest.surface_point, nearest.outward);
  pair->over_edge = 0;
  double bulge = surface_[group.b].bulge(nearest.surface_point);
  if (nearest.outside && nearest.distance > kOnSurface * of_b.tree().mean_edge() &&
      dot(off, normal) < kOverFace * nearest.distance)
    normal = (1 / nearest.distance) * off, bulge = 0, pair->over_edge = 1;
  pair->triangle = nearest.surface_point.triangle;
  std::copy(nearest.surface_point.barycentric, nearest.surface_point.barycentric + 3, pair->barycentric);
  pair->normal = normal, pair->bulge = bulge;
  pair->tangent = across(normal, pair->tangent);
}

// On an edge or a corner of the surface each triangle there has the nearest place, and the last bits decide which one the search names: on the rim of a
// block the one above or the one at its side. The place is of the triangle that faces the vertex most. off: m, from the place to the vertex;
// facing: unit, outward from the vertex' own organ.
void PairSearch::face(const OrganGroup& group, Vec3 off, Vec3 facing, NearestPoint* nearest) const {
  const OrganSurface& of_b = surface_[group.b];
  SurfacePoint& place = nearest->surface_point;
  std::int32_t held[3], count = 0;
  double weight[3];
  for (int v = 0; v < 3; ++v)
    if (place.barycentric[v] > kOnEdge)
      held[count] = of_b.tree().corners(place.triangle)[v], weight[count++] = place.barycentric[v];
  if (count == 3) return;
  const bool has_way = nearest->outside && nearest->distance > kOnSurface * of_b.tree().mean_edge();
  const Vec3 toward = has_way ? off : -1 * facing;
  double most = -INFINITY;
  of_b.tree().around(held[0], [&](std::int32_t triangle) {
    const std::int32_t* const corner = of_b.tree().corners(triangle);
    if (count == 2 && std::find(corner, corner + 3, held[1]) == corner + 3) return;
    Vec3 now[3];
    of_b.deformed().corners(triangle, now);
    const Vec3 outward = unit_or_zero(cross(now[1] - now[0], now[2] - now[0]));
    if (!(dot(outward, toward) > most)) return;
    most = dot(outward, toward), nearest->outward = outward, place.triangle = triangle;
  });
  for (int v = 0; v < 3; ++v) {
    const std::int32_t corner = of_b.tree().corners(place.triangle)[v];
    place.barycentric[v] = corner == held[0] ? weight[0] : count == 2 && corner == held[1] ? weight[1] : 0;
  }
}

// Makes the pair whose place is nearest to a point of the second organ's frame. Returns the place, m.
Vec3 PairSearch::anchor_under(const OrganGroup& group, NearestPoint nearest, Vec3 at, Vec3 facing, OrganPair* pair) {
  const OrganSurface& of_b = surface_[group.b];
  const Vec3 place =
      of_b.tree().at_rest(nearest.surface_point) + of_b.deformed().displacement({}, nearest.surface_point);
  face(group, at - place, facing, &nearest);
  anchor(group, nearest, at - place, pair);
  return place;
}

// Contact forces move a vertex along the surface, and its place decides their direction: where tissue is soft and the surface bent, a
// place that goes all the way sends the vertex back by more. So a pair whose place turns back goes half as far as before, and one that
// goes on goes farther again. With friction the place is the vertex's own. before: the pair as it was, whose place is now at `was`; at: the
// vertex; found: the pair all the way, whose place is *place.
void PairSearch::follow(const OrganGroup& group, const OrganPair& before, Vec3 was, Vec3 at, Vec3 facing,
                        OrganPair* found, Vec3* place) {
  const OrganSurface& of_b = surface_[group.b];
  const double share = share_of(group, *place - was, kStill * of_b.tree().mean_edge(), &found->moves);
  if (share == 1 || rubs(before)) return;
  const Vec3 between = was + share * (at - was);
  const NearestPoint under = of_b.deformed().nearest({}, between, group.reach, found->triangle);
  if (under.surface_point.triangle >= 0) *place = anchor_under(group, under, between, facing, found);
}

// The pair that was found has its place where it was before; its normal is the one there now.
void PairSearch::keep_place(const OrganGroup& group, const OrganPair& before, OrganPair* found) {
  Vec3 outward;
  *found = before;
  place_now(group, *found, &outward);
  found->normal = normal_at(group, *found, outward);
  found->moves.share = std::min(1.0, growth_of(group, 1) * found->moves.share);
}

// Of the second organ's surface at the pair's place. outward: of its triangle now.
Vec3 PairSearch::normal_at(const OrganGroup& group, const OrganPair& pair, Vec3 outward) {
  return surface_[group.b].normal(surface_point_of(pair.triangle, pair.barycentric), outward);
}

// The pair's place on the deformed second organ, m; outward: of its triangle.
Vec3 PairSearch::place_now(const OrganGroup& group, const OrganPair& pair, Vec3* outward) const {
  Vec3 corner[3];
  surface_[group.b].deformed().corners(pair.triangle, corner);
  *outward = unit_or_zero(cross(corner[1] - corner[0], corner[2] - corner[0]));
  return pair.barycentric[0] * corner[0] + pair.barycentric[1] * corner[1] + pair.barycentric[2] * corner[2];
}

void PairSearch::note_where(const OrganGroup& group, Vec3 at, OrganPair* pair) const {
  pair->seen_apart = at - place_now(group, *pair, &pair->seen_outward);
}

// Whether the pair, whose vertex is at `at`, has moved so little since it was looked for that it needs no search. Its normal then turns with
// the surface. *moved: m, of the vertex from the place since then.
bool PairSearch::stands(const OrganGroup& group, Vec3 at, OrganPair* pair, double* moved) {
  Vec3 outward;
  *moved = length(at - place_now(group, *pair, &outward) - pair->seen_apart);
  if (!(*moved < kAgain * surface_[group.b].tree().mean_edge())) return false;
  if (pair->over_edge || length(outward - pair->seen_outward) < kTurned) return true;
  const Vec3 before = pair->normal;
  pair->normal = normal_at(group, *pair, outward);
  pair->seen_outward = turn(group, before, pair) ? outward : Vec3{};
  return true;
}

// Whether a pair stays where it is although the nearest place to its vertex, which is at `at`, is on another side of the second organ. Without
// this a pair that presses near an edge would be lost, and its vertex would be found again when the organs are deep in one another. A vertex that
// has come out beside its place is no longer held by it.
bool PairSearch::keeps_place(const OrganGroup& group, const OrganPair& pair, Vec3 at, bool outside) const {
  Vec3 outward;
  return !group.second && pair.reaction.x > 0 &&
         length(at - place_now(group, pair, &outward)) < (outside ? kStays * group.margin : group.reach);
}

// Too far from the other surface for a pair: the vertex is looked at again when it may have come nearer.
bool PairSearch::is_far(OrganGroup& group, std::int32_t vertex, bool held, const NearestPoint& nearest) const {
  if (nearest.surface_point.triangle < 0) {
    const std::int64_t deep = group.look[vertex].deep;  // farther in than it is looked for
    look_after(group, vertex, group.reach - group.margin, nearest.per_path);
    group.look[vertex].deep = deep;
    return true;
  }
  const double near = signed_distance(nearest);
  if (near <= (held ? kStays : 1) * group.margin) return false;
  look_after(group, vertex, near - group.margin, nearest.per_path);
  return true;
}

// The surface there faces the same way as the vertex's own: nothing touches, but what is held stays. True where it does.
bool PairSearch::faces_away(OrganGroup& group, std::int32_t vertex, bool held, Vec3 p, const NearestPoint& nearest,
                            OrganPair* pair) const {
  const double near = signed_distance(nearest), edge = surface_[group.b].tree().mean_edge();
  if (held && keeps_place(group, *pair, p, nearest.outside)) {
    pair->near = near;
    note_where(group, p, pair);
    return true;
  }
  const double deeper = -near - kDeep * edge - group.inside_at_rest[vertex];
  group.look[vertex].deep = deeper > 0;
  group.look[vertex].room = std::min(kAgain * edge, std::fabs(deeper));
  return false;
}

// What was found goes on from the pair of the last step. Whether its normal has turned all its way.
bool PairSearch::follow_last(OrganGroup& group, const OrganPair& last, Vec3 at, Vec3 facing, OrganPair* found,
                             Vec3* place) {
  const OrganSurface& of_b = surface_[group.b];
  const SurfacePoint before = surface_point_of(last.triangle, last.barycentric);
  const Vec3 was = of_b.tree().at_rest(before) + of_b.deformed().displacement({}, before);
  follow(group, last, was, at, facing, found, place);
  // A pair that sticks keeps its place; one with friction that slips gets the nearest one; one without lags a little behind.
  const double lag = !rubs(last) ? kLag : last.slips ? 0 : kLagWhereItSticks;
  if (length(was - *place) < lag * of_b.tree().mean_edge() && !found->over_edge && !last.over_edge)
    keep_place(group, last, found);
  return turn(group, last.normal, found);
}

// Looks at a vertex. True where it is near the other organ: *pair, which holds the pair of the last step where there was one, is then up
// to date.
bool PairSearch::look(std::int32_t g, std::int32_t vertex, bool held, OrganPair* pair) {
  OrganGroup& group = groups_[g];
  TouchState &a = touch(group.a), &b = touch(group.b);
  const OrganSurface &of_a = surface_[group.a], &of_b = surface_[group.b];
  const double edge = of_b.tree().mean_edge();
  const Vec3 u = a.field->empty() ? Vec3{} : a.field->at_node(vertex, &work_);
  const Vec3 p = to_second(group, of_a.tree().at_rest(vertex) + u);
  // The bound on the pair's motion was used up, as a rule without as much motion. A pair that slips has no room and is looked for in every step,
  // but where nothing moves the organs: there it would creep.
  const bool creeps = held && group.moves && pair->slips && rubs(*pair);
  if (double moved = 0; held && !creeps && stands(group, p, pair, &moved)) {
    const bool turns = length(pair->seen_outward) == 0;
    look_after(group, vertex, turns ? 0 : kAgain * edge - moved, of_b.tree().largest_reach());
    return true;
  }
  // Friction opposes the whole way of this step, that of moving organs and supports too: a pair has its place where the last step left
  // the vertex.
  const bool drags = held && rubs(*pair) && group.moves;
  Vec3 at = drags ? left_by_last_step(group, *pair, of_a.tree().at_rest(vertex) + u) : p;
  NearestPoint under = of_b.deformed().nearest({}, at, group.reach, held ? pair->triangle : -1);
  // Where the vertex is near wherever it has gone since then, that search says enough.
  const bool near_anyway =
      !drags || (under.surface_point.triangle >= 0 && signed_distance(under) + length(p - at) <= kStays * group.margin);
  const auto nearest_to_vertex = [&] { return of_b.deformed().nearest({}, p, group.reach, pair->triangle); };
  const NearestPoint nearest = near_anyway ? under : nearest_to_vertex();
  if (is_far(group, vertex, held, nearest)) return false;
  if (under.surface_point.triangle < 0) under = nearest, at = p;
  const double near = signed_distance(nearest);
  look_after(group, vertex, kAgain * edge, of_b.tree().largest_reach());
  OrganPair found = held ? *pair : OrganPair{};
  const Vec3 facing = turned_to_second(group, surface_[group.a].normal(vertex));
  Vec3 place = anchor_under(group, under, at, facing, &found);
  if (dot(found.normal, facing) > kFaces)
    return faces_away(group, vertex, held, p, drags ? nearest_to_vertex() : nearest, pair);
  const double gap = dot(found.normal, at - place) - found.bulge;
  // Between two supports there is nothing to solve: a pair only says that they are in one another, by more than the meshes show.
  const bool none_moves = a.surface.column_of_node[vertex] < 0 && moving_share(b, found) == 0;
  if (const double left = gap + group.overlap[vertex] + kDeep * edge; none_moves && left > 0) {
    group.look[vertex].room = std::min(kAgain * edge, left);
    return false;
  }
  if (!held) found.slips = 1;
  const bool turned = !held || follow_last(group, *pair, at, facing, &found, &place);
  found.group = g, found.vertex = vertex, found.near = near;
  // An overlap counts as touching until the organs part there.
  group.overlap[vertex] = std::min(group.overlap[vertex], std::max(0.0, -gap) + 1e-6 * edge);
  found.overlap = group.overlap[vertex];
  note_where(group, p, &found);
  if (!turned) found.seen_outward = {}, group.look[vertex].room = 0;
  *pair = found;
  return true;
}

bool PairSearch::is_steep(const OrganPair& pair) const {
  const SurfaceTree& tree = surface_[group(pair).b].tree();
  const std::int32_t* const corner = tree.corners(pair.triangle);
  const Vec3 first = tree.at_rest(corner[0]);
  const Vec3 across = cross(tree.at_rest(corner[1]) - first, tree.at_rest(corner[2]) - first);
  return !pair.over_edge && dot(across, pair.normal) < kSteep * length(across);
}

void PairSearch::let_slip(std::int32_t i) {
  OrganPair& pair = pairs_[i];
  pair.slips = 1;
  if (rubs(pair)) groups_[pair.group].look[pair.vertex].room = 0;
}

// ---- all vertices ----------------------------------------------------------------------------------------------------

// Returns whether a vertex is deep inside the other organ without a pair.
bool PairSearch::search_group(std::int32_t g, std::int32_t* next_held) {
  OrganGroup& group = groups_[g];
  measure_motion(group);
  const std::int32_t first = *next_held;
  while (*next_held < count_ && pairs_[*next_held].group == g) ++*next_held;
  if (first == *next_held && is_apart(group)) return false;
  bool deep = false;
  std::int32_t held = first;
  const std::int32_t vertices = surface_[group.a].tree().surface_nodes();
  for (std::int32_t v = 0; v < vertices; ++v) {
    OrganPair* const before = held < *next_held && pairs_[held].vertex == v ? pairs_ + held++ : nullptr;
    if (!touch(group.a).surface.has_triangles(v)) continue;
    const bool is_held = before && touch(group.b).surface.is_active(before->triangle);
    if (!is_due(group, v)) {
      if (is_held) found_[found_count_++] = *before;
      deep = deep || group.look[v].deep;
      continue;
    }
    OrganPair& pair = found_[found_count_];
    pair = is_held ? *before : OrganPair{};
    found_count_ += look(g, v, is_held, &pair);
    deep = deep || group.look[v].deep;
  }
  return deep;
}

// Where there are more pairs than the world has room for, those whose surfaces are farther apart go.
std::uint32_t PairSearch::keep_nearest() {
  if (found_count_ <= most_) return 0;
  std::int32_t kept = 0;
  visit_nearest(
      found_count_, most_, [&](std::int32_t i) { return found_[i].near; }, nearness_,
      [&](std::int32_t i, bool stays) {
        if (stays)
          found_[kept++] = found_[i];
        else
          groups_[found_[i].group].look[found_[i].vertex].room = 0;
      });
  found_count_ = kept;
  return PALPATE_STEP_CONTACTS_DROPPED;
}

std::uint32_t PairSearch::search() {
  work_ = {};
  for (std::int32_t k = 0; k < organ_count_; ++k)
    touch(k).work.add(surface_[k].deformed().take_work()), surface_[k].begin_step();
  std::int32_t next_held = 0;
  found_count_ = 0;
  bool deep = false;
  for (std::int32_t g = 0; g < group_count_; ++g) deep = search_group(g, &next_held) || deep;
  const std::uint32_t flags = keep_nearest() | (deep ? std::uint32_t{PALPATE_STEP_NOT_TOUCHABLE} : 0u);
  std::swap(pairs_, found_);
  count_ = found_count_;
  for (std::int32_t k = 0; k < organ_count_; ++k) touch(k).work.add(surface_[k].deformed().take_work());
  return flags;
}

// ---- overlaps --------------------------------------------------------------------------------------------------------

void PairSearch::find_overlaps(OrganGroup& group) {
  const OrganSurface &of_a = surface_[group.a], &of_b = surface_[group.b];
  for (std::int32_t v = 0; v < of_a.tree().surface_nodes(); ++v) {
    if (!touch(group.a).surface.has_triangles(v)) continue;
    const Vec3 p = to_second(group, of_a.tree().at_rest(v));
    NearestPoint nearest = of_b.deformed().nearest({}, p, group.reach);
    if (nearest.surface_point.triangle < 0) continue;
    const Vec3 off = p - of_b.tree().at_rest(nearest.surface_point);
    const Vec3 facing = turned_to_second(group, surface_[group.a].normal(v));
    OrganPair pair;
    face(group, off, facing, &nearest);
    anchor(group, nearest, off, &pair);
    const double gap = dot(pair.normal, off) - pair.bulge;
    if (gap < 0 && dot(pair.normal, facing) < kFaces) group.overlap_at_rest[v] = -gap;
    if (!nearest.outside && dot(pair.normal, facing) >= kFaces) group.inside_at_rest[v] = nearest.distance;
  }
  of_a.deformed().take_work(), of_b.deformed().take_work();
}

double PairSearch::largest_overlap(std::int32_t g, std::int32_t* vertices) const {
  double largest = 0;
  *vertices = 0;
  for (std::int32_t v = 0; v < surface_[groups_[g].a].tree().surface_nodes(); ++v) {
    largest = std::max(largest, groups_[g].overlap_at_rest[v]);
    *vertices += groups_[g].overlap_at_rest[v] > 0;
  }
  return largest;
}

}  // namespace palpate
