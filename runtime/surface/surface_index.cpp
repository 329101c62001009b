#include "runtime/surface/surface_index.h"

namespace palpate {
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

}  // namespace palpate
