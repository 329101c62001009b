#include "runtime/contact/deformed_surface.h"

#include <algorithm>
#include <cmath>

#include "runtime/surface/moving_crossing.h"
#include "runtime/surface/surface_inside.h"

namespace palpate {
namespace {

bool rests(const Vec3 before[3], const Vec3 now[3]) {
  for (int v = 0; v < 3; ++v)
    if (before[v].x != now[v].x || before[v].y != now[v].y || before[v].z != now[v].z) return false;
  return true;
}

// The crossing of a segment through a triangle that rests. Exact signs decide: a closed surface has no gap, and a crossing through
// an edge counts for one triangle.
int resting_crossing(Vec3 from, Vec3 to, const Vec3 corner[3], MovingCrossing* found) {
  const int crosses = segment_crosses(corner, from, to);
  if (crosses == 0) return 0;
  const Vec3 normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
  const double from_height = dot(normal, from - corner[0]), to_height = dot(normal, to - corner[0]);
  found->time = from_height == to_height ? 0 : std::clamp(from_height / (from_height - to_height), 0.0, 1.0);
  found->entering = crosses > 0;
  closest_on_triangle(from + found->time * (to - from), corner[0], corner[1], corner[2], found->barycentric);
  return 1;
}

}  // namespace

bool DeformedSurface::create(SceneMemory& memory, SurfaceTree* tree, SurfaceField* field, const BoundSurface* bound) {
  tree_ = tree, field_ = field, bound_ = bound;
  if (!bound || !field) return true;
  for (Known* known : {&known_now_, &known_asked_}) {
    known->at = memory.array<Vec3>(static_cast<std::size_t>(bound->vertex_count()));
    known->stamp = memory.array<std::uint32_t>(static_cast<std::size_t>(bound->vertex_count()));
  }
  return !memory.failed();
}

void DeformedSurface::begin_query() {
  if (!bound_ || !field_ || ++query_ != 0) return;
  for (const Known* known : {&known_now_, &known_asked_})
    std::fill(known->stamp, known->stamp + bound_->vertex_count(), 0u);
  query_ = 1;
}

FieldBound DeformedSurface::bound_of(const AskedSurface& asked) const {
  if (!field_) return {};
  FieldBound bound{field_->norm(), field_->path(), 0};
  if (!moves() || asked.kind == AskedSurface::kNow) return bound;
  const bool predicted = asked.kind == AskedSurface::kPredicted;
  bound.apart = predicted ? field_->predicted_apart() : field_->own_norm(asked.contact);
  const double norm = predicted ? field_->predicted_norm() : field_->norm_without(asked.contact);
  bound.norm = std::min(bound.norm + bound.apart, norm) - bound.apart;
  return bound;
}

template <class At>
Vec3 DeformedSurface::displacement_at(std::int32_t vertex, At at) {
  if (!bound_) return at(vertex);
  work_.add(bound_->cost(vertex));
  return bound_->displacement(vertex, at);
}

// Of a node of the mesh.
Vec3 DeformedSurface::at_node(const AskedSurface& asked, std::int32_t node) {
  if (asked.kind == AskedSurface::kPredicted) return field_->predicted_at_node(node, &work_);
  if (asked.kind == AskedSurface::kWithout) return field_->at_node_without(node, asked.contact, &work_);
  return field_->at_node(node, &work_);
}

Vec3 DeformedSurface::displacement_of(const AskedSurface& asked, std::int32_t vertex) {
  if (!moves()) return {};
  const auto at_node = [&](std::int32_t node) { return this->at_node(asked, node); };
  if (!bound_) return at_node(vertex);
  const Known& known = asked.kind == AskedSurface::kNow ? known_now_ : known_asked_;
  if (known.stamp[vertex] == query_) return known.at[vertex];
  known.stamp[vertex] = query_;
  return known.at[vertex] = displacement_at(vertex, at_node);
}

// Calls run(field) with what the tree is to remember of a query: where the field has what the query looks at, unless the query does not
// evaluate the field itself.
template <class Run>
auto DeformedSurface::with_field(const AskedSurface& asked, Run run) {
  if (!field_ || asked.kind == AskedSurface::kPredicted) return run(nullptr);
  if (asked.kind == AskedSurface::kNow) return run(AskedIsField{});
  return run([&](std::int32_t node) { return place({}, node); });
}

NearestPoint DeformedSurface::nearest(const AskedSurface& asked, Vec3 p, double within, std::int32_t likely) {
  begin_query();
  if (likely >= 0) {
    Vec3 corner[3];
    for (int v = 0; v < 3; ++v) corner[v] = place(asked, tree_->corners(likely)[v]);
    double k[3];
    // A little more, so that the search finds that triangle, too.
    within =
        std::min(within, (1 + 1e-9) * std::sqrt(closest_on_triangle(p, corner[0], corner[1], corner[2], k)) + 1e-12);
    work_.add(80);
  }
  return with_field(asked, [&](auto field) {
    return tree_->nearest(
        p, within, bound_of(asked), &work_, [&](std::int32_t node) { return place(asked, node); }, field);
  });
}

template <class Visit>
void DeformedSurface::meet(const AskedSurface& asked, Vec3 low, Vec3 high, const FieldBound& bound, Visit visit) {
  with_field(asked, [&](auto field) {
    tree_->meet(
        low, high, bound, &work_, [&](std::int32_t node) { return place(asked, node); }, field, visit);
  });
}

bool DeformedSurface::is_inside(const AskedSurface& asked, Vec3 p) {
  begin_query();
  const FieldBound bound = bound_of(asked);
  return is_inside_surface(*tree_, p, bound,
                           [&](Vec3 low, Vec3 high, auto visit) { meet(asked, low, high, bound, visit); });
}

int DeformedSurface::crossings(Vec3 from, Vec3 to, SurfaceCrossing* found) {
  begin_query();
  Vec3 low, high;
  for (int d = 0; d < 3; ++d) low[d] = std::min(from[d], to[d]), high[d] = std::max(from[d], to[d]);
  FieldBound bound = bound_of({});
  bound.apart = field_ ? field_->last_change() : 0;
  const double moved = largest_move();
  int count = 0;
  meet({}, low, high, bound, [&](std::int32_t triangle, const Vec3 corner[3]) {
    if (!corners_meet(corner, 3, moved, low, high)) return;
    Vec3 swept[6];  // the corners before, and now
    Vec3 *const before = swept, *const now = swept + 3;
    for (int v = 0; v < 3; ++v) {
      const std::int32_t vertex = tree_->corners(triangle)[v];
      before[v] = now[v] = corner[v];
      if (field_)
        before[v] = tree_->at_rest(vertex) +
                    displacement_at(vertex, [&](std::int32_t node) { return field_->before_at_node(node, &work_); });
    }
    // The margin is for the rounding of moving_crossings(), which finds crossings a little beyond the border, too.
    if (!corners_meet(swept, 6, 1e-6 * tree_->mean_edge(), low, high)) return;
    MovingCrossing passed[3];
    const int times =
        rests(before, now) ? resting_crossing(from, to, now, passed) : moving_crossings(from, to, before, now, passed);
    work_.add(150);
    for (int c = 0; c < times; ++c) {
      int at = std::min(++count, kMaxCrossings + 1) - 1;
      // Where there is no room, the latest crossing is dropped.
      if (at == kMaxCrossings && found[--at].time <= passed[c].time) continue;
      for (; at > 0 && found[at - 1].time > passed[c].time; --at) found[at] = found[at - 1];
      found[at].time = passed[c].time, found[at].entering = passed[c].entering;
      found[at].surface_point = surface_point_of(triangle, passed[c].barycentric);
    }
  });
  return count;
}

double DeformedSurface::largest_move() const {
  return field_ ? tree_->largest_reach() * field_->last_change() : 0;
}

double DeformedSurface::farthest_from_rest() const {
  return field_ ? tree_->largest_reach() * (field_->norm() + field_->last_change()) : 0;
}

// The second part exceeds what the places were rounded by.
bool DeformedSurface::may_hold(Vec3 low, Vec3 high, double margin) const {
  margin += farthest_from_rest() + 1e-3 * tree_->mean_edge();
  for (int i = 0; i < 3; ++i)
    if (low[i] > tree_->high()[i] + margin || high[i] < tree_->low()[i] - margin) return false;
  return true;
}

double DeformedSurface::largest_move_without(const ContactId& id) const {
  return field_ ? tree_->largest_reach() * field_->last_change_without(id) : 0;
}

Vec3 DeformedSurface::displacement(const AskedSurface& asked, const SurfacePoint& surface_point) {
  begin_query();
  Vec3 sum;
  for (int v = 0; v < 3; ++v)
    if (surface_point.barycentric[v] != 0)
      sum += surface_point.barycentric[v] * displacement_of(asked, tree_->corners(surface_point.triangle)[v]);
  return sum;
}

Vec3 DeformedSurface::below_disc(const AskedSurface& asked, const SurfacePoint& surface_point, double radius,
                                 bool* lacks_nodes) {
  Vec3 sum;
  *lacks_nodes = false;
  if (!moves() || !work_.take(ContactPatch::kToPress + kOfTwoDiscs * field_->discs())) return sum;
  TouchableDisc disc;
  press_disc(discs_, bound_ ? bound_->beneath(surface_point) : surface_point, radius, ContactPatch::kMaxNodes, &disc);
  if (disc.count == 0) return sum;
  *lacks_nodes = disc.lacks_nodes;
  for (int e = 0; e < disc.count; ++e) sum += disc.weight[e] * at_node(asked, disc.node[e]);
  return sum - displacement(asked, surface_point) +
         field_->beyond_mesh(disc.disc, asked.contact, asked.kind == AskedSurface::kPredicted);
}

void DeformedSurface::corners(std::int32_t triangle, Vec3 corner[3]) {
  begin_query();
  for (int v = 0; v < 3; ++v) corner[v] = place({}, tree_->corners(triangle)[v]);
}

Vec3 DeformedSurface::normal(std::int32_t node) {
  Vec3 sum;
  tree_->around(node, [&](std::int32_t triangle) {
    Vec3 corner[3];
    corners(triangle, corner);
    work_.add(60);
    sum += cross(corner[1] - corner[0], corner[2] - corner[0]);
  });
  return unit_or_zero(sum);
}

Vec3 DeformedSurface::moved(const SurfacePoint& surface_point) {
  Vec3 sum;
  if (!field_ || !field_->has_offset()) return sum;
  for (int v = 0; v < 3; ++v)
    if (surface_point.barycentric[v] != 0)
      sum += surface_point.barycentric[v] *
             displacement_at(tree_->corners(surface_point.triangle)[v],
                             [&](std::int32_t node) { return field_->moved_at_node(node); });
  return sum;
}

Operations DeformedSurface::overshoot() const {
  constexpr Operations of_leaf = 1000, of_triangle = 60, vertices_of_leaf = 12;
  Operations most = 0, triangles = tree_->largest_fan();
  for (std::int32_t v = 0; bound_ && v < bound_->vertex_count(); ++v)
    most = std::max(most, Operations{bound_->cost(v)});
  return of_leaf + triangles * of_triangle + (2 * vertices_of_leaf + 3 * triangles) * most;
}

Operations DeformedSurface::take_work() {
  const Operations done = work_.done();
  work_ = {};
  return done;
}

}  // namespace palpate
