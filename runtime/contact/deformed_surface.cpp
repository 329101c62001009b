#include "runtime/contact/deformed_surface.h"

#include <algorithm>

#include "runtime/surface/exact_signs.h"
#include "runtime/surface/moving_crossing.h"

namespace palpate {
namespace {

// side(edge) where it is the same for all three edges, so that the line passes through the triangle; else 0.
int common_side(const Vec3 corner[3], Vec3 p, Vec3 q) {
  const int first = side_of_edge(corner[0], corner[1], p, q);
  return first != 0 && side_of_edge(corner[1], corner[2], p, q) == first &&
                 side_of_edge(corner[2], corner[0], p, q) == first
             ? first
             : 0;
}

bool rests(const Vec3 before[3], const Vec3 now[3]) {
  for (int v = 0; v < 3; ++v)
    if (before[v].x != now[v].x || before[v].y != now[v].y || before[v].z != now[v].z) return false;
  return true;
}

// The crossing of a segment through a triangle that rests. Exact signs decide: a closed surface has no gap, and a crossing through
// an edge counts for one triangle.
int resting_crossing(Vec3 from, Vec3 to, const Vec3 corner[3], MovingCrossing* found) {
  const int before = side_of_plane(corner[0], corner[1], corner[2], from),
            after = side_of_plane(corner[0], corner[1], corner[2], to);
  if (before == after || common_side(corner, from, to) == 0) return 0;
  const Vec3 normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
  const double from_height = dot(normal, from - corner[0]), to_height = dot(normal, to - corner[0]);
  found->time = from_height == to_height ? 0 : std::clamp(from_height / (from_height - to_height), 0.0, 1.0);
  found->entering = after < 0;
  closest_on_triangle(from + found->time * (to - from), corner[0], corner[1], corner[2], found->barycentric);
  return 1;
}

bool meets(const Vec3 corner[3], double margin, Vec3 low, Vec3 high) {
  for (int d = 0; d < 3; ++d) {
    const double a = corner[0][d], b = corner[1][d], c = corner[2][d];
    if (std::min(a, std::min(b, c)) - margin > high[d] || std::max(a, std::max(b, c)) + margin < low[d]) return false;
  }
  return true;
}

}  // namespace

FieldBound DeformedSurface::bound() const {
  return field_ ? FieldBound{field_->norm(), field_->path(), 0} : FieldBound{};
}

FieldBound DeformedSurface::bound_without(std::int32_t tool, std::int32_t point) const {
  FieldBound bound = this->bound();
  bound.apart = field_->own_norm(tool, point);
  bound.norm = std::min(bound.norm + bound.apart, field_->norm_without(tool, point)) - bound.apart;
  return bound;
}

FieldBound DeformedSurface::bound_predicted() const {
  FieldBound bound = this->bound();
  bound.apart = field_->predicted_norm() + bound.norm;
  bound.norm = field_->predicted_norm() - bound.apart;
  return bound;
}

NearestPoint DeformedSurface::nearest(Vec3 p, double within) {
  return tree_->nearest(p, within, bound(), field_ != nullptr, &work_, [&](std::int32_t node) {
    const Vec3 rest = tree_->at_rest(node);
    return moves() ? rest + field_->at_node(node, &work_) : rest;
  });
}

NearestPoint DeformedSurface::nearest_without(Vec3 p, double within, std::int32_t tool, std::int32_t point) {
  if (!moves()) return nearest(p, within);
  return tree_->nearest(p, within, bound_without(tool, point), false, &work_, [&](std::int32_t node) {
    return tree_->at_rest(node) + field_->at_node_without(node, tool, point, &work_);
  });
}

NearestPoint DeformedSurface::nearest_predicted(Vec3 p, double within) {
  return tree_->nearest(p, within, bound_predicted(), false, &work_, [&](std::int32_t node) {
    return tree_->at_rest(node) + field_->predicted_at_node(node, &work_);
  });
}

template <class Place>
bool DeformedSurface::is_inside(Vec3 p, const FieldBound& bound, bool sees, Place place) {
  const double reach = tree_->largest_reach() * (bound.norm + bound.apart) + 0.01 * tree_->mean_edge();
  // The ray along the axis on which it leaves the surface's box first.
  Vec3 out = p;
  int axis = -1;
  double least = INFINITY, end = 0;
  for (int d = 0; d < 3; ++d) {
    const double low = tree_->low()[d] - reach, high = tree_->high()[d] + reach;
    if (p[d] < low || p[d] > high) return false;
    if (p[d] - low < least) least = p[d] - low, axis = d, end = low;
    if (high - p[d] < least) least = high - p[d], axis = d, end = high;
  }
  if (axis < 0) return false;
  out[axis] = end + (end < p[axis] ? -1 : 1) * tree_->mean_edge();
  Vec3 low = p, high = p;
  low[axis] = std::min(p[axis], out[axis]), high[axis] = std::max(p[axis], out[axis]);
  int winding = 0;
  tree_->meet(low, high, bound, sees, &work_, place, [&](std::int32_t, const Vec3 corner[3]) {
    if (!meets(corner, 0, low, high)) return;
    const int from = side_of_plane(corner[0], corner[1], corner[2], p),
              to = side_of_plane(corner[0], corner[1], corner[2], out);
    if (from != to && common_side(corner, p, out) != 0) winding += to > from ? 1 : -1;
  });
  return winding > 0;
}

bool DeformedSurface::is_inside(Vec3 p) {
  return is_inside(p, bound(), field_ != nullptr, [&](std::int32_t node) {
    const Vec3 rest = tree_->at_rest(node);
    return moves() ? rest + field_->at_node(node, &work_) : rest;
  });
}

bool DeformedSurface::is_inside_without(Vec3 p, std::int32_t tool, std::int32_t point) {
  if (!moves()) return is_inside(p);
  return is_inside(p, bound_without(tool, point), false, [&](std::int32_t node) {
    return tree_->at_rest(node) + field_->at_node_without(node, tool, point, &work_);
  });
}

bool DeformedSurface::is_inside_predicted(Vec3 p) {
  return is_inside(p, bound_predicted(), false,
                   [&](std::int32_t node) { return tree_->at_rest(node) + field_->predicted_at_node(node, &work_); });
}

int DeformedSurface::crossings(Vec3 from, Vec3 to, SurfaceCrossing* found) {
  Vec3 low, high;
  for (int d = 0; d < 3; ++d) low[d] = std::min(from[d], to[d]), high[d] = std::max(from[d], to[d]);
  FieldBound bound = this->bound();
  bound.apart = field_ ? field_->last_change() : 0;
  const double moved = largest_move();
  int count = 0;
  const auto now = [&](std::int32_t node) {
    const Vec3 rest = tree_->at_rest(node);
    return moves() ? rest + field_->at_node(node, &work_) : rest;
  };
  tree_->meet(low, high, bound, field_ != nullptr, &work_, now, [&](std::int32_t triangle, const Vec3 corner[3]) {
    if (!meets(corner, moved, low, high)) return;
    Vec3 before[3];
    for (int v = 0; v < 3; ++v) {
      const std::int32_t node = tree_->corners(triangle)[v];
      before[v] = field_ ? tree_->at_rest(node) + field_->before_at_node(node, &work_) : corner[v];
    }
    MovingCrossing passed[3];
    const int times = rests(before, corner) ? resting_crossing(from, to, corner, passed)
                                            : moving_crossings(from, to, before, corner, passed);
    work_ += 100;
    for (int c = 0; c < times; ++c) {
      int at = std::min(++count, kMaxCrossings + 1) - 1;
      // Where there is no room, the latest crossing is dropped.
      if (at == kMaxCrossings && found[--at].time <= passed[c].time) continue;
      for (; at > 0 && found[at - 1].time > passed[c].time; --at) found[at] = found[at - 1];
      found[at].time = passed[c].time, found[at].entering = passed[c].entering;
      found[at].surface_point.triangle = triangle;
      std::copy(passed[c].barycentric, passed[c].barycentric + 3, found[at].surface_point.barycentric);
    }
  });
  return count;
}

double DeformedSurface::largest_move() const {
  return field_ ? tree_->largest_reach() * field_->last_change() : 0;
}

double DeformedSurface::largest_move_without(std::int32_t tool, std::int32_t point) const {
  return field_ ? tree_->largest_reach() * field_->last_change_without(tool, point) : 0;
}

template <class AtNode>
Vec3 DeformedSurface::interpolate(const SurfacePoint& surface_point, AtNode at_node) const {
  Vec3 sum;
  for (int v = 0; v < 3; ++v)
    if (surface_point.barycentric[v] != 0)
      sum += surface_point.barycentric[v] * at_node(tree_->corners(surface_point.triangle)[v]);
  return sum;
}

Vec3 DeformedSurface::displacement(const SurfacePoint& surface_point) {
  if (!moves()) return {};
  return interpolate(surface_point, [&](std::int32_t n) { return field_->at_node(n, &work_); });
}

Vec3 DeformedSurface::displacement_without(const SurfacePoint& surface_point, std::int32_t tool, std::int32_t point) {
  if (!moves()) return {};
  return interpolate(surface_point, [&](std::int32_t n) { return field_->at_node_without(n, tool, point, &work_); });
}

Operations DeformedSurface::take_work() {
  const Operations done = work_;
  work_ = 0;
  return done;
}

}  // namespace palpate
