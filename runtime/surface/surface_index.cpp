#include "runtime/surface/surface_index.h"

#include <algorithm>

#include "runtime/surface/exact_signs.h"

namespace palpate {
namespace {

// True where the triangle lies wholly below or above [low, high] along an axis, so that nothing within can meet it.
bool apart(double a, double b, double c, double low, double high) {
  return (a < low && b < low && c < low) || (a > high && b > high && c > high);
}

// side(edge) where it is the same for all three edges, so that the line passes through the triangle; else 0.
template <class Side>
int common_side(Vec3 a, Vec3 b, Vec3 c, Side side) {
  const int first = side(a, b);
  return first != 0 && side(b, c) == first && side(c, a) == first ? first : 0;
}

}  // namespace

double closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c, double barycentric[3]) {
  // Voronoi regions of vertices, edges and face in turn (Ericson, Real-Time Collision Detection, 5.1.5).
  const auto done = [&](double u, double v, double w) {
    barycentric[0] = u, barycentric[1] = v, barycentric[2] = w;
    const Vec3 gap = p - (u * a + v * b + w * c);
    return dot(gap, gap);
  };
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
               d6 = dot(ac, cp);
  if (d1 <= 0 && d2 <= 0) return done(1, 0, 0);
  if (d3 >= 0 && d4 <= d3) return done(0, 1, 0);
  if (d6 >= 0 && d5 <= d6) return done(0, 0, 1);
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return done(1 - d1 / (d1 - d3), d1 / (d1 - d3), 0);
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return done(1 - d2 / (d2 - d6), 0, d2 / (d2 - d6));
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return done(0, 1 - w, w);
  }
  const double sum = va + vb + vc;
  if (!(sum > 0)) return done(1, 0, 0);
  return done(1 - vb / sum - vc / sum, vb / sum, vc / sum);
}

Vec3 SurfaceIndex::position(const SurfacePoint& surface_point) const {
  Vec3 sum;
  for (int v = 0; v < 3; ++v) sum += surface_point.barycentric[v] * corner(surface_point.triangle, v);
  return sum;
}

Vec3 SurfaceIndex::outward(std::int32_t triangle) const {
  const Vec3 a = corner(triangle, 0);
  return unit_or_zero(cross(corner(triangle, 1) - a, corner(triangle, 2) - a));
}

int SurfaceIndex::cell_of(double x, int axis) const {
  const double at = (x - low_[axis]) / cell_;
  if (!(at > 0)) return 0;
  return at >= cells_[axis] ? cells_[axis] - 1 : static_cast<int>(at);
}

std::uint64_t SurfaceIndex::key(int i, int j, int k) {
  return 1 + static_cast<std::uint64_t>(i) + (static_cast<std::uint64_t>(j) << 20) +
         (static_cast<std::uint64_t>(k) << 40);
}

SurfaceIndex::Bucket* SurfaceIndex::slot(std::uint64_t wanted) const {
  std::uint64_t hash = wanted * 0x9e3779b97f4a7c15ull;
  hash ^= hash >> 32;
  for (;; ++hash) {
    Bucket* bucket = table_ + (hash & table_mask_);
    if (bucket->key == wanted || bucket->key == 0) return bucket;
  }
}

void SurfaceIndex::next_stamp() {
  if (++stamp_ != 0) return;
  for (std::int32_t t = 0; t < triangle_count_; ++t) seen_[t] = 0;
  stamp_ = 1;
}

bool SurfaceIndex::inside(Vec3 p) {
  for (int d = 0; d < 3; ++d)
    if (!(p[d] >= low_[d] && p[d] <= high_[d])) return false;
  next_stamp();
  bool odd = false;
  const auto count = [&](std::int32_t t) {
    const Vec3 a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    if (apart(a.x, b.x, c.x, p.x, p.x) || apart(a.y, b.y, c.y, p.y, p.y)) return;
    const int turn = common_side(a, b, c, [&](Vec3 v, Vec3 w) { return side_of_edge_from_above(v, w, p); });
    // The ray runs towards +z: it reaches a triangle that faces up from below its plane, one that faces down from above.
    if (turn != 0 && side_of_plane(a, b, c, p) == -turn) odd = !odd;
  };
  const int i = cell_of(p.x, 0), j = cell_of(p.y, 1);
  for (int k = cell_of(p.z, 2); k < cells_[2]; ++k) visit_bucket(i, j, k, count);
  return odd;
}

// Visits every bucket that the segment from a to b passes, in order (Amanatides and Woo 1987). The number of steps follows from
// the end buckets alone, so rounding cannot make the walk miss its end.
template <class Visit>
void SurfaceIndex::walk(Vec3 a, Vec3 b, Visit visit) {
  double enter = 0, leave = 1;
  for (int d = 0; d < 3; ++d) {
    const double run = b[d] - a[d];
    if (run == 0) {
      if (a[d] < low_[d] || a[d] > high_[d]) return;
      continue;
    }
    const double t0 = (low_[d] - a[d]) / run, t1 = (high_[d] - a[d]) / run;
    enter = std::max(enter, std::min(t0, t1)), leave = std::min(leave, std::max(t0, t1));
  }
  if (!(enter <= leave)) return;
  const Vec3 from = a + enter * (b - a), to = a + leave * (b - a);
  int at[3], end[3], step[3];
  double next[3], stride[3];
  for (int d = 0; d < 3; ++d) {
    at[d] = cell_of(from[d], d), end[d] = cell_of(to[d], d);
    step[d] = end[d] > at[d] ? 1 : -1;
    const double run = std::fabs(to[d] - from[d]);
    const double edge = low_[d] + (at[d] + (step[d] > 0 ? 1 : 0)) * cell_;
    stride[d] = run > 0 ? cell_ / run : 0;
    next[d] = run > 0 ? std::fabs(edge - from[d]) / run : 0;
  }
  visit_bucket(at[0], at[1], at[2], visit);
  for (;;) {
    int axis = -1;
    for (int d = 0; d < 3; ++d)
      if (at[d] != end[d] && (axis < 0 || next[d] < next[axis])) axis = d;
    if (axis < 0) return;
    at[axis] += step[axis];
    next[axis] += stride[axis];
    visit_bucket(at[0], at[1], at[2], visit);
  }
}

int SurfaceIndex::crossings(Vec3 a, Vec3 b, Crossing* found) {
  const Vec3 run = b - a;
  if (!(largest_of(run) > 0)) return 0;
  const Vec3 low{std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)},
      high{std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
  next_stamp();
  int count = 0;
  walk(a, b, [&](std::int32_t t) {
    const Vec3 p = corner(t, 0), q = corner(t, 1), r = corner(t, 2);
    if (apart(p.x, q.x, r.x, low.x, high.x) || apart(p.y, q.y, r.y, low.y, high.y) ||
        apart(p.z, q.z, r.z, low.z, high.z))
      return;
    const int from = side_of_plane(p, q, r, a), to = side_of_plane(p, q, r, b);
    if (from == to) return;
    if (common_side(p, q, r, [&](Vec3 v, Vec3 w) { return side_of_edge(v, w, a, b); }) == 0) return;
    const Vec3 normal = cross(q - p, r - p);
    const double from_height = dot(normal, a - p), to_height = dot(normal, b - p);
    Crossing crossing;
    crossing.time = from_height == to_height ? 0 : std::clamp(from_height / (from_height - to_height), 0.0, 1.0);
    crossing.entering = to < 0;
    crossing.surface_point.triangle = t;
    closest_on_triangle(a + crossing.time * run, p, q, r, crossing.surface_point.barycentric);
    ++count;
    int at = std::min(count, kMaxCrossings + 1) - 1;
    if (at == kMaxCrossings && found[--at].time <= crossing.time) return;  // no room: the latest crossing is dropped
    for (; at > 0 && found[at - 1].time > crossing.time; --at) found[at] = found[at - 1];
    found[at] = crossing;
  });
  return count;
}

}  // namespace palpate
