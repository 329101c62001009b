#include "runtime/surface_index.h"

#include <algorithm>

namespace palpate {
namespace {

// Sign of a + b + c, exact: the parts of the sum are made non-overlapping, and the largest one decides.
int sign_of_sum(double a, double b, double c) {
  const auto two_sum = [](double x, double y, double& low) {
    const double high = x + y, x_part = high - y, y_part = high - x_part;
    low = (x - x_part) + (y - y_part);
    return high;
  };
  double low = 0, h0 = 0, h1 = 0;
  const double high = two_sum(a, b, low);
  const double q0 = two_sum(c, low, h0), q = two_sum(q0, high, h1);
  const double decides = q != 0 ? q : h1 != 0 ? h1 : h0;
  return (decides > 0) - (decides < 0);
}

// Sign of ax by - ay bx, exact for the given doubles.
int sign_of_cross(double ax, double ay, double bx, double by) {
  const double p = ax * by, q = ay * bx, difference = p - q;
  if (std::fabs(difference) > 4e-16 * (std::fabs(p) + std::fabs(q))) return (difference > 0) - (difference < 0);
  // p - q is exact here (they agree to the last bits); the rounding of the two products joins it.
  return sign_of_sum(difference, std::fma(ax, by, -p), -std::fma(ay, bx, -q));
}

struct Point2 {
  double x, y;
};

// How ties are broken: as if every point that is asked about stood at its place + (e, e^2, e^3) for an infinitely small
// e. A line is projected along its direction onto two axes u and v; the offset goes with it.
struct LineTie {
  int u, v, major;
  double shear_u, shear_v;  // direction's u and v per unit of major
};

int sign(double x) {
  return (x > 0) - (x < 0);
}

// Side of the origin, so displaced, with respect to the directed line a -> b.
int side_of_edge(Point2 a, Point2 b, const LineTie& tie) {
  if (const int decided = sign_of_cross(a.x, a.y, b.x, b.y)) return decided;
  const Point2 run{b.x - a.x, b.y - a.y};
  for (int axis = 0; axis < 3; ++axis) {  // powers of e in order
    const int decided = axis == tie.u   ? sign(-run.y)
                        : axis == tie.v ? sign(run.x)
                                        : sign_of_cross(tie.shear_u, tie.shear_v, run.x, run.y);
    if (decided) return decided;
  }
  return 0;
}

// +1 or -1 when the line through the origin meets the projected triangle (counter-clockwise or clockwise), else 0.
int meets(Point2 a, Point2 b, Point2 c, const LineTie& tie) {
  const int ab = side_of_edge(a, b, tie);
  if (ab == 0 || side_of_edge(b, c, tie) != ab || side_of_edge(c, a, tie) != ab) return 0;
  return ab;
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

Vec3 SurfaceIndex::at(const SurfacePlace& place) const {
  Vec3 sum;
  for (int v = 0; v < 3; ++v) sum += place.barycentric[v] * corner(place.triangle, v);
  return sum;
}

Vec3 SurfaceIndex::outward(std::int32_t triangle) const {
  const Vec3 a = corner(triangle, 0);
  return unit_or_zero(cross(corner(triangle, 1) - a, corner(triangle, 2) - a));
}

// Distance from the triangle's plane times twice its area, and which side that is; the same answer for the same
// triangle and point whoever asks. In the plane: as the displaced point would stand.
SurfaceIndex::Side SurfaceIndex::side(std::int32_t triangle, Vec3 p) const {
  const Vec3 a = corner(triangle, 0), normal = cross(corner(triangle, 1) - a, corner(triangle, 2) - a);
  const double height = dot(normal, p - a);
  for (const double decides : {height, normal.x, normal.y, normal.z})
    if (decides != 0) return {height, decides < 0};
  return {height, false};
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

// Every bucket that the triangle touches, with a margin far above the rounding of a walk.
template <class Visit>
void SurfaceIndex::cells_of_triangle(std::int32_t triangle, Visit visit) const {
  const Vec3 a = corner(triangle, 0), b = corner(triangle, 1), c = corner(triangle, 2);
  const double margin = 1e-4 * cell_;
  int first[3], last[3];
  for (int d = 0; d < 3; ++d) {
    first[d] = cell_of(std::min({a[d], b[d], c[d]}) - margin, d);
    last[d] = cell_of(std::max({a[d], b[d], c[d]}) + margin, d);
  }
  const Vec3 normal = unit_or_zero(cross(b - a, c - a));
  const double reach =
      (0.5 * cell_ + margin) * (std::fabs(normal.x) + std::fabs(normal.y) + std::fabs(normal.z)) + margin;
  for (int k = first[2]; k <= last[2]; ++k)
    for (int j = first[1]; j <= last[1]; ++j)
      for (int i = first[0]; i <= last[0]; ++i) {
        const Vec3 centre = low_ + Vec3{(i + 0.5) * cell_, (j + 0.5) * cell_, (k + 0.5) * cell_};
        if (std::fabs(dot(normal, centre - a)) <= reach) visit(i, j, k);
      }
}

// Buckets about one mean edge wide, no more than kMaxCells along an axis.
void SurfaceIndex::choose_cells() {
  double edges = 0;
  low_ = high_ = corner(0, 0);
  for (std::int32_t t = 0; t < triangle_count_; ++t)
    for (int v = 0; v < 3; ++v) {
      const Vec3 p = corner(t, v);
      edges += length(corner(t, (v + 1) % 3) - p);
      for (int d = 0; d < 3; ++d) low_[d] = std::min(low_[d], p[d]), high_[d] = std::max(high_[d], p[d]);
    }
  const Vec3 size = high_ - low_;
  const double largest = std::max({size.x, size.y, size.z});
  cell_ = std::max({edges / (3.0 * triangle_count_), largest / (kMaxCells - 2), 1e-12});
  for (int d = 0; d < 3; ++d) {
    low_[d] -= 1e-3 * cell_, high_[d] += 1e-3 * cell_;
    cells_[d] = std::min(kMaxCells, 1 + static_cast<int>((high_[d] - low_[d]) / cell_));
  }
}

bool SurfaceIndex::build(SceneMemory& memory, const double* position, const std::int32_t* triangles,
                         std::int32_t triangle_count) {
  position_ = position, triangles_ = triangles, triangle_count_ = triangle_count;
  seen_ = memory.array<std::uint32_t>(static_cast<std::size_t>(triangle_count));
  if (triangle_count > 0) choose_cells();

  // First how many entries, then how many per bucket, then the entries.
  std::uint64_t total = 0;
  for (std::int32_t t = 0; t < triangle_count; ++t) cells_of_triangle(t, [&](int, int, int) { ++total; });
  std::uint64_t slots = 16;
  while (slots < 2 * total) slots *= 2;
  table_ = memory.array<Bucket>(slots);
  entries_ = memory.array<std::int32_t>(total);
  if (memory.failed() || total > 0xffffffffull) return false;
  table_mask_ = slots - 1;
  for (std::int32_t t = 0; t < triangle_count; ++t)
    cells_of_triangle(t, [&](int i, int j, int k) {
      Bucket* bucket = slot(key(i, j, k));
      bucket->key = key(i, j, k);
      ++bucket->count;
    });
  std::uint32_t begin = 0;
  for (std::uint64_t s = 0; s < slots; ++s) {
    table_[s].begin = begin;
    begin += table_[s].count;
    table_[s].count = 0;
  }
  for (std::int32_t t = 0; t < triangle_count; ++t)
    cells_of_triangle(t, [&](int i, int j, int k) {
      Bucket* bucket = slot(key(i, j, k));
      entries_[bucket->begin + bucket->count++] = t;
    });
  return true;
}

bool SurfaceIndex::inside(Vec3 p) {
  for (int d = 0; d < 3; ++d)
    if (!(p[d] >= low_[d] && p[d] <= high_[d])) return false;
  next_stamp();
  bool odd = false;
  const auto count = [&](std::int32_t t) {
    const Vec3 a = corner(t, 0) - p, b = corner(t, 1) - p, c = corner(t, 2) - p;
    const int turn = meets({a.x, a.y}, {b.x, b.y}, {c.x, c.y}, {0, 1, 2, 0, 0});
    // The ray runs to +z: it meets an upward triangle from below its plane, a downward one from above.
    if (turn != 0 && side(t, p).below == (turn > 0)) odd = !odd;
  };
  const int i = cell_of(p.x, 0), j = cell_of(p.y, 1);
  for (int k = cell_of(p.z, 2); k < cells_[2]; ++k) visit_bucket(i, j, k, count);
  return odd;
}

// Every bucket that the segment passes, from a to b (Amanatides and Woo 1987), in exactly as many steps as it is long.
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
  int major = 0;
  for (int d = 1; d < 3; ++d)
    if (std::fabs(run[d]) > std::fabs(run[major])) major = d;
  if (!(std::fabs(run[major]) > 0)) return 0;
  const int u = (major + 1) % 3, v = (major + 2) % 3;
  const double shear_u = run[u] / run[major], shear_v = run[v] / run[major];
  // Along the segment: a vertex becomes a point of the plane, rounded once and shared by all its triangles.
  const auto project = [&](Vec3 corner) -> Point2 {
    const Vec3 s = corner - a;
    return {s[u] - shear_u * s[major], s[v] - shear_v * s[major]};
  };
  next_stamp();
  int count = 0;
  walk(a, b, [&](std::int32_t t) {
    const Side from = side(t, a), to = side(t, b);
    if (from.below == to.below) return;
    const Point2 p = project(corner(t, 0)), q = project(corner(t, 1)), r = project(corner(t, 2));
    if (meets(p, q, r, {u, v, major, shear_u, shear_v}) == 0) return;
    Crossing crossing;
    crossing.time = from.height == to.height ? 0 : std::clamp(from.height / (from.height - to.height), 0.0, 1.0);
    crossing.entering = to.below;
    crossing.place.triangle = t;
    closest_on_triangle(a + crossing.time * run, corner(t, 0), corner(t, 1), corner(t, 2), crossing.place.barycentric);
    ++count;
    int at = std::min(count, kMaxCrossings + 1) - 1;
    if (at == kMaxCrossings && found[--at].time <= crossing.time) return;  // full: the latest one gives way
    for (; at > 0 && found[at - 1].time > crossing.time; --at) found[at] = found[at - 1];
    found[at] = crossing;
  });
  return count;
}

}  // namespace palpate
