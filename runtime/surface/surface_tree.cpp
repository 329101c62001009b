#include "runtime/surface/surface_tree.h"

#include <algorithm>

namespace palpate {
namespace {

// The bound is exact for exact numbers. Tensors are stored in single or half precision or compressed, so the bound gets a margin.
constexpr double kMargin = 1.02;

Vec3 lower(Vec3 a, Vec3 b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
Vec3 upper(Vec3 a, Vec3 b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

// atan(x) for 0 <= x <= 1, to 1e-4 (Abramowitz and Stegun 4.4.49 with its first five terms). The C library's own function differs
// from version to version, and a step's bits must not.
double arc_tangent(double x) {
  const double s = x * x;
  return x * (0.9998660 + s * (-0.3302995 + s * (0.1801410 + s * (-0.0851330 + s * 0.0208351))));
}

}  // namespace

double corner_angle(Vec3 a, Vec3 b, Vec3 c) {
  constexpr double quarter = 1.5707963267948966;
  const Vec3 u = b - a, v = c - a;
  const double across = length(cross(u, v)), along = dot(u, v), size = std::fabs(along);
  if (!(across > 0)) return along < 0 ? 2 * quarter : 0;
  const double sharp = across <= size ? arc_tangent(across / size) : quarter - arc_tangent(size / across);
  return along < 0 ? 2 * quarter - sharp : sharp;
}

Vec3 SurfaceTree::at_rest(const SurfacePoint& surface_point) const {
  Vec3 sum;
  const std::int32_t* node = corners(surface_point.triangle);
  for (int v = 0; v < 3; ++v) sum += surface_point.barycentric[v] * at_rest(node[v]);
  return sum;
}

Vec3 SurfaceTree::outward_at_rest(std::int32_t triangle) const {
  const std::int32_t* node = corners(triangle);
  const Vec3 a = at_rest(node[0]);
  return unit_or_zero(cross(at_rest(node[1]) - a, at_rest(node[2]) - a));
}

SurfaceTree::Box SurfaceTree::around_both(const Box& a, const Box& b) {
  return {lower(a.low, b.low), upper(a.high, b.high)};
}

void SurfaceTree::set_reach(const double* reach) {
  // Children stand after their parents.
  for (std::int32_t at = node_count_ - 1; at >= 0; --at) {
    Node& node = nodes_[at];
    if (node.is_inner()) {
      node.reach = std::max(nodes_[node.first].reach, nodes_[node.first + 1].reach);
      continue;
    }
    node.reach = 0;
    for (std::int32_t i = node.first; i < node.first + node.places; ++i)
      for (int v = 0; v < 3; ++v) node.reach = std::max(node.reach, kMargin * reach[corners(order_[i])[v]]);
  }
}

void SurfaceTree::forget() {
  for (std::int32_t at = 0; at < node_count_; ++at) forget(nodes_[at]);
}

// What is empty has no path, so that it does not make its parents older.
void SurfaceTree::forget(Node& node) {
  node.seen = node.rest, node.path = node.rest.low.x > node.rest.high.x ? INFINITY : 0;
}

bool SurfaceTree::same(const Box& a, const Box& b) {
  for (int d = 0; d < 3; ++d)
    if (a.low[d] != b.low[d] || a.high[d] != b.high[d]) return false;
  return true;
}

void SurfaceTree::refit(std::int32_t leaf, const Box& box, double path) {
  nodes_[leaf].seen = box, nodes_[leaf].path = path;
  for (std::int32_t at = nodes_[leaf].parent; at >= 0; at = nodes_[at].parent) {
    Node& node = nodes_[at];
    const Node &a = nodes_[node.first], &b = nodes_[node.first + 1];
    const Box seen = around_both(a.seen, b.seen);
    const double least = std::min(a.path, b.path);
    if (node.path == least && same(node.seen, seen)) return;  // so are all above it
    node.seen = seen, node.path = least;
  }
}

}  // namespace palpate
