#include "runtime/inside/tetrahedron_tree.h"

#include <algorithm>

#include "runtime/surface/surface_index.h"

namespace palpate {
namespace {

constexpr std::int32_t kLeaf = 4;      // tetrahedra at most
constexpr int kDeepest = 64;           // twice the levels of 2^31 tetrahedra
constexpr double kOnTheFace = -1e-12;  // a weight above it counts as inside

}  // namespace

Vec3 TetrahedronTree::corner(std::int32_t tetrahedron, int c) const {
  const std::int32_t node =
      geometry_.tetrahedra[4 * static_cast<std::size_t>(tetrahedron) + static_cast<std::size_t>(c)];
  return load3(geometry_.nodes + 3 * static_cast<std::size_t>(node));
}

bool TetrahedronTree::create(SceneMemory& memory, const TetrahedronGeometry& geometry) {
  geometry_ = geometry;
  const auto count = static_cast<std::size_t>(geometry.tetrahedron_count);
  order_ = memory.array<std::int32_t>(count);
  boxes_ = memory.array<Box>(count + 1);
  SceneMemory scratch = memory.of_same_host();
  double* const middle = scratch.array<double>(3 * count);
  const bool made = !memory.failed() && !scratch.failed();
  if (made) {
    for (std::int32_t e = 0; e < geometry.tetrahedron_count; ++e) {
      order_[e] = e;
      store3(corner(e, 0) + corner(e, 1) + corner(e, 2) + corner(e, 3), middle + 3 * static_cast<std::size_t>(e));
    }
    boxes_[0].first = 0, boxes_[0].last = geometry.tetrahedron_count;
    box_count_ = 1;
    for (std::int32_t box = 0; box < box_count_; ++box) split(box, middle);
  }
  scratch.release_all();
  return made;
}

// Fills the box and, where it has many tetrahedra, makes its children. middle: [E][3] of any scale.
void TetrahedronTree::split(std::int32_t b, const double* middle) {
  Box& box = boxes_[b];
  double least[3], most[3];
  for (int d = 0; d < 3; ++d) box.low[d] = least[d] = INFINITY, box.high[d] = most[d] = -INFINITY;
  for (std::int32_t at = box.first; at < box.last; ++at)
    for (int d = 0; d < 3; ++d) {
      const double m = middle[3 * static_cast<std::size_t>(order_[at]) + static_cast<std::size_t>(d)];
      least[d] = std::min(least[d], m), most[d] = std::max(most[d], m);
      for (int c = 0; c < 4; ++c) {
        const double x = corner(order_[at], c)[d];
        box.low[d] = std::min(box.low[d], x), box.high[d] = std::max(box.high[d], x);
      }
    }
  if (box.last - box.first <= kLeaf) return;
  int axis = 0;
  for (int d = 1; d < 3; ++d)
    if (most[d] - least[d] > most[axis] - least[axis]) axis = d;
  const std::int32_t half = box.first + (box.last - box.first) / 2;
  // The index decides between equal places, so that every build makes the same tree.
  std::nth_element(order_ + box.first, order_ + half, order_ + box.last, [&](std::int32_t i, std::int32_t j) {
    const double x = middle[3 * static_cast<std::size_t>(i) + static_cast<std::size_t>(axis)],
                 y = middle[3 * static_cast<std::size_t>(j) + static_cast<std::size_t>(axis)];
    return x < y || (x == y && i < j);
  });
  box.child = box_count_;
  boxes_[box_count_].first = box.first, boxes_[box_count_].last = half;
  boxes_[box_count_ + 1].first = half, boxes_[box_count_ + 1].last = box.last;
  box_count_ += 2;
}

double TetrahedronTree::distance_from_box(const Box& box, Vec3 p) const {
  Vec3 gap;
  for (int d = 0; d < 3; ++d) gap[d] = std::max(0.0, std::max(box.low[d] - p[d], p[d] - box.high[d]));
  return length(gap);
}

// Weights and distance. From outside, the nearest point lies on a face whose far side has p. A tetrahedron that is too thin for weights
// has the distance NaN, and is never the nearest.
void TetrahedronTree::measure(std::int32_t tetrahedron, Vec3 p, Found* found) const {
  const Vec3 x[4] = {corner(tetrahedron, 0), corner(tetrahedron, 1), corner(tetrahedron, 2), corner(tetrahedron, 3)};
  const Vec3 a = x[1] - x[0], b = x[2] - x[0], c = x[3] - x[0], q = p - x[0];
  const double volume = dot(a, cross(b, c));
  found->tetrahedron = tetrahedron;
  found->weight[1] = dot(q, cross(b, c)) / volume;
  found->weight[2] = dot(q, cross(c, a)) / volume;
  found->weight[3] = dot(q, cross(a, b)) / volume;
  found->weight[0] = 1 - found->weight[1] - found->weight[2] - found->weight[3];
  double square = INFINITY;
  bool inside = true;
  for (int w = 0; w < 4; ++w) {
    if (found->weight[w] >= kOnTheFace) continue;
    inside = false;
    double barycentric[3];
    square = std::min(square, closest_on_triangle(p, x[(w + 1) % 4], x[(w + 2) % 4], x[(w + 3) % 4], barycentric));
  }
  found->distance = inside ? 0 : std::sqrt(square);
  for (const double weight : found->weight)
    if (!std::isfinite(weight)) found->distance = NAN;
}

TetrahedronTree::Found TetrahedronTree::nearest(Vec3 p, double farthest) const {
  Found best;
  best.distance = farthest;
  std::int32_t open[kDeepest];
  int count = 0;
  if (geometry_.tetrahedron_count > 0) open[count++] = 0;
  while (count > 0) {
    const Box& box = boxes_[open[--count]];
    if (!(distance_from_box(box, p) <= best.distance)) continue;
    if (box.child > 0) {
      const bool first_is_near = distance_from_box(boxes_[box.child], p) <= distance_from_box(boxes_[box.child + 1], p);
      open[count++] = box.child + (first_is_near ? 1 : 0);
      open[count++] = box.child + (first_is_near ? 0 : 1);
      continue;
    }
    for (std::int32_t at = box.first; at < box.last; ++at) {
      Found found;
      measure(order_[at], p, &found);
      const bool nearer = found.distance < best.distance;
      const bool earlier =
          found.distance == best.distance && (best.tetrahedron < 0 || found.tetrahedron < best.tetrahedron);
      if (nearer || earlier) best = found;
    }
  }
  if (best.tetrahedron < 0) best.distance = 0;
  return best;
}

}  // namespace palpate
