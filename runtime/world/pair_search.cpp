#include "runtime/world/pair_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate {
namespace {

// In mean edges of the second organ: within which a vertex counts as near; by how much it must go farther to count as far again; within
// which a vertex is looked for; after which motion a pair is looked at again; by how much its place lags behind the vertex.
constexpr double kMargin = 0.25, kStays = 1.5, kReach = 2, kAgain = 0.02, kLag = 0.1;
// A pair's normal stays while it turns by less than a degree (cosine).
constexpr double kSameNormal = 0.99985;
// The two surfaces face one another where their normals differ by more than about 100 degrees (cosine).
constexpr double kFaces = -0.2;
// A vertex that is less than this far from the surface, in mean edges, has no direction of its own.
constexpr double kOnSurface = 1e-3;
// Beyond this angle between the way to the vertex and the normal, the place is on an edge of the organ (cosine of 25 degrees).
constexpr double kOverFace = 0.9063;

// m: the longest way, in the frame of b, of a point of the box in the frame of a between two steps. A difference of rigid motions is
// longest at a corner.
double longest_way(const Pose& a_before, const Pose& b_before, const Pose& a, const Pose& b, Vec3 low, Vec3 high) {
  double longest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p = {corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y, corner & 4 ? high.z : low.z};
    longest = std::max(longest, length(b.to_body(a.to_world(p)) - b_before.to_body(a_before.to_world(p))));
  }
  return longest;
}

bool same_pose(const Pose& a, const Pose& b) {
  bool same = length(a.position - b.position) == 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) same = same && a.axes.m[i][j] == b.axes.m[i][j];
  return same;
}

}  // namespace

bool PairSearch::create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t count, std::int32_t most_pairs,
                        double friction) {
  organs_ = organs, organ_count_ = count, most_ = most_pairs, has_friction_ = friction > 0;
  for (std::int32_t k = 0; k < count; ++k)
    if (!surface_[k].create(memory, &touch(k).tree)) return false;
  const std::int32_t most_groups = count * (count - 1) / 2;
  groups_ = memory.array<OrganGroup>(static_cast<std::size_t>(most_groups));
  motions_ = memory.array<OrganGroup::Motion>(static_cast<std::size_t>(most_groups));
  if (memory.failed()) return false;
  for (std::int32_t k = 0; k < count; ++k)
    for (std::int32_t other = k + 1; other < count; ++other) {
      OrganGroup& group = groups_[group_count_] = OrganGroup{};
      const bool first = touch(k).tree.mean_edge() <= touch(other).tree.mean_edge();
      group.a = first ? k : other, group.b = first ? other : k;
      const double edge = touch(group.b).tree.mean_edge();
      group.margin = kMargin * edge, group.reach = kReach * edge;
      group.motion = motions_ + group_count_++;
      capacity_ += touch(group.a).tree.surface_nodes();
    }
  const auto vertices = static_cast<std::size_t>(capacity_);
  for (double** array : {&due_, &overlap_, &overlap_at_rest_}) *array = memory.array<double>(vertices);
  if (memory.failed()) return false;
  std::size_t first = 0;
  for (std::int32_t g = 0; g < group_count_; ++g) {
    OrganGroup& group = groups_[g];
    group.due = due_ + first, group.overlap = overlap_ + first, group.overlap_at_rest = overlap_at_rest_ + first;
    first += static_cast<std::size_t>(touch(group.a).tree.surface_nodes());
  }
  memory.keep_array(motions_, static_cast<std::size_t>(group_count_));
  memory.keep_array(due_, vertices);
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
  for (std::int32_t g = 0; g < group_count_; ++g) {
    OrganGroup& group = groups_[g];
    *group.motion = {};
    group.motion->pose_a = touch(group.a).organ.pose(), group.motion->pose_b = touch(group.b).organ.pose();
    const std::int32_t vertices = touch(group.a).tree.surface_nodes();
    for (std::int32_t v = 0; v < vertices; ++v) {
      // A vertex without a column does not move.
      group.due[v] = touch(group.a).column_of_node[v] < 0 ? INFINITY : 0;
      group.overlap[v] = group.overlap_at_rest[v];
    }
  }
}

// ---- motion ----------------------------------------------------------------------------------------------------------

void PairSearch::measure_motion(OrganGroup& group) const {
  TouchState &a = touch(group.a), &b = touch(group.b);
  OrganGroup::Motion& motion = *group.motion;
  const double path_a = a.deformed.path(), path_b = b.deformed.path();
  // An organ that was reset alone: everything is looked at.
  if (path_a < motion.path_a || path_b < motion.path_b)
    for (std::int32_t v = 0; v < a.tree.surface_nodes(); ++v) group.due[v] = std::min(group.due[v], motion.moved);
  motion.moved += a.tree.largest_reach() * std::max(0.0, path_a - motion.path_a) +
                  b.tree.largest_reach() * std::max(0.0, path_b - motion.path_b);
  const Pose &now_a = a.organ.pose(), &now_b = b.organ.pose();
  group.pose_a_before = motion.pose_a, group.pose_b_before = motion.pose_b;
  group.poses_change = !same_pose(now_a, motion.pose_a) || !same_pose(now_b, motion.pose_b);
  if (group.poses_change) {
    const double far = a.deformed.farthest_from_rest();
    const Vec3 room = {far, far, far};
    motion.moved += longest_way(motion.pose_a, motion.pose_b, now_a, now_b, a.tree.low() - room, a.tree.high() + room);
    motion.pose_a = now_a, motion.pose_b = now_b;
  }
  motion.path_a = path_a, motion.path_b = path_b;
}

// Whether the boxes of the two organs, as they are now, are apart by more than the margin.
bool PairSearch::is_apart(const OrganGroup& group) const {
  const TouchState &a = touch(group.a), &b = touch(group.b);
  const double room = a.deformed.farthest_from_rest() + b.deformed.farthest_from_rest() + kStays * group.margin;
  const Vec3 half = 0.5 * (a.tree.high() - a.tree.low());
  const Vec3 middle = to_second(group, 0.5 * (a.tree.low() + a.tree.high()));
  Vec3 extent;
  for (int j = 0; j < 3; ++j) {
    const Vec3 axis = turned_to_second(group, {j == 0 ? 1.0 : 0, j == 1 ? 1.0 : 0, j == 2 ? 1.0 : 0});
    for (int i = 0; i < 3; ++i) extent[i] += std::fabs(axis[i]) * half[j];
  }
  for (int i = 0; i < 3; ++i)
    if (middle[i] - extent[i] - room > b.tree.high()[i] || middle[i] + extent[i] + room < b.tree.low()[i]) return true;
  return false;
}

// ---- one vertex ------------------------------------------------------------------------------------------------------

Vec3 PairSearch::vertex_at_rest(const OrganPair& pair) const {
  const OrganGroup& g = group(pair);
  return to_second(g, touch(g.a).tree.at_rest(pair.vertex));
}

Vec3 PairSearch::place_at_rest(const OrganPair& pair) const {
  return touch(group(pair).b).tree.at_rest(surface_point_of(pair.triangle, pair.barycentric));
}

Vec3 PairSearch::target(const OrganPair& pair) const {
  const Vec3 apart = vertex_at_rest(pair) - place_at_rest(pair);
  return {-dot(pair.normal, apart) + pair.bulge - pair.overlap, -dot(pair.tangent, apart),
          -dot(cross(pair.normal, pair.tangent), apart)};
}

// The place of the pair and its normal. off: from the nearest place to the vertex.
void PairSearch::anchor(const OrganGroup& group, const NearestPoint& nearest, Vec3 off, OrganPair* pair) const {
  const TouchState& b = touch(group.b);
  const OrganSurface::Smooth smooth = surface_[group.b].at(nearest.surface_point);
  // The triangle has turned since rest, and the smooth normal with it.
  Vec3 normal = unit_or_zero(smooth.normal + nearest.outward - b.tree.outward_at_rest(nearest.surface_point.triangle));
  double bulge = smooth.bulge;
  if (length(normal) == 0) normal = smooth.normal;
  if (nearest.outside && nearest.distance > kOnSurface * b.tree.mean_edge() &&
      dot(off, normal) < kOverFace * nearest.distance)
    normal = (1 / nearest.distance) * off, bulge = 0;
  pair->triangle = nearest.surface_point.triangle;
  std::copy(nearest.surface_point.barycentric, nearest.surface_point.barycentric + 3, pair->barycentric);
  pair->normal = normal, pair->bulge = bulge;
  pair->tangent = across(normal, pair->tangent);
}

// Looks at a vertex. True where it is near the other organ: *pair, which holds the pair of the last step where there was one, is then up
// to date.
bool PairSearch::look(std::int32_t g, std::int32_t vertex, bool held, OrganPair* pair) {
  OrganGroup& group = groups_[g];
  TouchState &a = touch(group.a), &b = touch(group.b);
  const double moved = group.motion->moved, edge = b.tree.mean_edge();
  const Vec3 u = a.field.empty() ? Vec3{} : a.field.at_node(vertex, &work_);
  const Vec3 p = to_second(group, a.tree.at_rest(vertex) + u);
  const NearestPoint nearest = b.deformed.nearest({}, p, group.reach);
  if (nearest.surface_point.triangle < 0) {
    group.due[vertex] = moved + group.reach - group.margin;
    return false;
  }
  const double near = nearest.outside ? nearest.distance : -nearest.distance;
  if (near > (held ? kStays : 1) * group.margin) {
    group.due[vertex] = moved + near - group.margin;
    return false;
  }
  group.due[vertex] = moved + kAgain * edge;
  // Friction opposes the whole way of this step, that of moving organs too: a pair has its place where the last step left the vertex.
  NearestPoint under = nearest;
  Vec3 at = p;
  if (held && has_friction_ && group.poses_change) {
    const Vec3 left = to_second_before(group, a.tree.at_rest(vertex) + u);
    const NearestPoint there = b.deformed.nearest({}, left, group.reach);
    if (there.surface_point.triangle >= 0) under = there, at = left;
  }
  const Vec3 place = b.tree.at_rest(under.surface_point) + b.deformed.displacement({}, under.surface_point);
  OrganPair found = held ? *pair : OrganPair{};
  anchor(group, under, at - place, &found);
  const Vec3 facing = turned_to_second(group, surface_[group.a].normal(vertex));
  if (dot(found.normal, facing) > kFaces) return false;
  if (held) {
    const SurfacePoint before = surface_point_of(pair->triangle, pair->barycentric);
    const Vec3 was = b.tree.at_rest(before) + b.deformed.displacement({}, before);
    // A pair that sticks keeps its place; one with friction that slips gets the nearest one; one without lags a little behind.
    const double lag = !has_friction_ ? kLag : pair->slips ? 0 : 10 * kLag;
    if (length(was - place) < lag * edge && dot(found.normal, pair->normal) > kSameNormal) found = *pair;
  } else {
    found.slips = 1;
  }
  found.group = g, found.vertex = vertex, found.near = near;
  // An overlap counts as touching until the organs part there.
  const double gap = dot(found.normal, at - place) - found.bulge;
  group.overlap[vertex] = std::min(group.overlap[vertex], std::max(0.0, -gap) + 1e-6 * edge);
  found.overlap = group.overlap[vertex];
  *pair = found;
  return true;
}

void PairSearch::let_slip(std::int32_t i) {
  OrganPair& pair = pairs_[i];
  pair.slips = 1;
  if (has_friction_) groups_[pair.group].due[pair.vertex] = groups_[pair.group].motion->moved;
}

// ---- all vertices ----------------------------------------------------------------------------------------------------

void PairSearch::search_group(std::int32_t g, std::int32_t* next_held) {
  OrganGroup& group = groups_[g];
  measure_motion(group);
  const std::int32_t first = *next_held;
  while (*next_held < count_ && pairs_[*next_held].group == g) ++*next_held;
  if (first == *next_held && is_apart(group)) return;
  std::int32_t held = first;
  const double moved = group.motion->moved;
  const std::int32_t vertices = touch(group.a).tree.surface_nodes();
  for (std::int32_t v = 0; v < vertices; ++v) {
    const bool is_held = held < *next_held && pairs_[held].vertex == v;
    OrganPair* const before = is_held ? pairs_ + held++ : nullptr;
    if (group.due[v] > moved) {
      if (is_held) found_[found_count_++] = *before;
      continue;
    }
    OrganPair& pair = found_[found_count_];
    pair = is_held ? *before : OrganPair{};
    found_count_ += look(g, v, is_held, &pair);
  }
}

// Where there are more pairs than the world has room for, those whose surfaces are farther apart go.
std::uint32_t PairSearch::keep_nearest() {
  if (found_count_ <= most_) return 0;
  for (std::int32_t i = 0; i < found_count_; ++i) nearness_[i] = found_[i].near;
  std::nth_element(nearness_, nearness_ + most_, nearness_ + found_count_);
  const double farthest = nearness_[most_];
  // Of those that are equally far, the first ones stay.
  std::int32_t kept = 0, equal = most_;
  for (std::int32_t i = 0; i < found_count_; ++i) equal -= found_[i].near < farthest;
  for (std::int32_t i = 0; i < found_count_; ++i) {
    const bool stays = found_[i].near < farthest || (found_[i].near == farthest && equal-- > 0);
    if (stays)
      found_[kept++] = found_[i];
    else
      groups_[found_[i].group].due[found_[i].vertex] = groups_[found_[i].group].motion->moved;
  }
  found_count_ = kept;
  return PALPATE_STEP_CONTACTS_DROPPED;
}

std::uint32_t PairSearch::search() {
  work_ = {};
  for (std::int32_t k = 0; k < organ_count_; ++k) touch(k).work.add(touch(k).deformed.take_work());
  std::int32_t next_held = 0;
  found_count_ = 0;
  for (std::int32_t g = 0; g < group_count_; ++g) search_group(g, &next_held);
  const std::uint32_t flags = keep_nearest();
  std::swap(pairs_, found_);
  count_ = found_count_;
  for (std::int32_t k = 0; k < organ_count_; ++k) touch(k).work.add(touch(k).deformed.take_work());
  return flags;
}

// ---- overlaps --------------------------------------------------------------------------------------------------------

void PairSearch::find_overlaps(OrganGroup& group) {
  TouchState &a = touch(group.a), &b = touch(group.b);
  for (std::int32_t v = 0; v < a.tree.surface_nodes(); ++v) {
    const Vec3 p = to_second(group, a.tree.at_rest(v));
    const NearestPoint nearest = b.deformed.nearest({}, p, group.reach);
    if (nearest.surface_point.triangle < 0) continue;
    const Vec3 off = p - b.tree.at_rest(nearest.surface_point);
    OrganPair pair;
    anchor(group, nearest, off, &pair);
    const Vec3 facing = turned_to_second(group, surface_[group.a].normal(v));
    const double gap = dot(pair.normal, off) - pair.bulge;
    if (gap < 0 && dot(pair.normal, facing) < kFaces) group.overlap_at_rest[v] = -gap;
  }
  a.deformed.take_work(), b.deformed.take_work();
}

double PairSearch::largest_overlap(std::int32_t g, std::int32_t* vertices) const {
  double largest = 0;
  *vertices = 0;
  for (std::int32_t v = 0; v < touch(groups_[g].a).tree.surface_nodes(); ++v) {
    largest = std::max(largest, groups_[g].overlap_at_rest[v]);
    *vertices += groups_[g].overlap_at_rest[v] > 0;
  }
  return largest;
}

}  // namespace palpate
