#include "runtime/crossings/crossing_check.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/surface/surface_tree.h"

namespace palpate {
namespace {

// The determinant of the rows a, b and c; 0 where rounding could change its sign: it rounds by less than 1e-14 of their lengths' product
// (surface/exact_signs.h). What such a rounding decides is far below the single precision of the positions, so nothing exact is asked here.
double sure_determinant(Vec3 a, Vec3 b, Vec3 c) {
  const double determinant = dot(cross(a, b), c);
  return determinant * determinant > 1e-28 * dot(a, a) * dot(b, b) * dot(c, c) ? determinant : 0;
}

// Whether the edge from p to q passes through the inside of a triangle.
bool passes(Vec3 p, Vec3 q, const Vec3 corner[3], CrossedEdge* edge) {
  const Vec3 u = corner[1] - corner[0], v = corner[2] - corner[0];
  const double from = sure_determinant(u, v, p - corner[0]), to = sure_determinant(u, v, q - corner[0]);
  if (!(from * to < 0)) return false;
  double sum = 0;
  for (int c = 0; c < 3; ++c) {
    const Vec3 a = corner[(c + 1) % 3], b = corner[(c + 2) % 3];
    edge->weight[c] = sure_determinant(p - a, b - a, q - p);
    if (!(edge->weight[c] * edge->weight[0] > 0)) return false;
    sum += edge->weight[c];
  }
  for (double& weight : edge->weight) weight /= sum;
  edge->along = from / (from - to);
  return true;
}

// What no point is in yet.
template <class Box>
void empty(Box* box) {
  for (int d = 0; d < 3; ++d) box->low[d] = INFINITY, box->high[d] = -INFINITY;
}

template <class Box>
void grow(Box* box, const float* low, const float* high) {
  for (int d = 0; d < 3; ++d)
    box->low[d] = std::min(box->low[d], low[d]), box->high[d] = std::max(box->high[d], high[d]);
}

template <class Box>
bool are_apart(const Box& a, const Box& b) {
  for (int d = 0; d < 3; ++d)
    if (a.low[d] > b.high[d] || b.low[d] > a.high[d]) return true;
  return false;
}

bool has(const std::int32_t node[3], std::int32_t asked) {
  return node[0] == asked || node[1] == asked || node[2] == asked;
}

}  // namespace

bool triangles_cross(const Vec3 a[3], const std::int32_t node_a[3], const Vec3 b[3], const std::int32_t node_b[3],
                     CrossedEdge* edge) {
  for (const bool of_a : {true, false}) {
    const Vec3* const own = of_a ? a : b;
    const std::int32_t *const own_node = of_a ? node_a : node_b, *const other_node = of_a ? node_b : node_a;
    for (int c = 0; c < 3; ++c) {
      const int next = (c + 1) % 3;
      // An edge with a shared vertex meets the other triangle there.
      if (has(other_node, own_node[c]) || has(other_node, own_node[next])) continue;
      if (!passes(own[c], own[next], of_a ? b : a, edge)) continue;
      edge->of_a = of_a, edge->from = c, edge->to = next;
      return true;
    }
  }
  return false;
}

bool CrossingCheck::create(SceneMemory& memory, const double* rest, std::int32_t nodes, const ShapedSurface& surface,
                           const palpate_crossings_def& def) {
  def_ = def, rest_ = rest, nodes_ = nodes;
  triangles_ = surface.triangles, triangle_count_ = surface.triangle_count, active_ = surface.active;
  while (leaves_ < triangle_count_ / kLeaf + 1) leaves_ *= 2;
  order_ = memory.array<std::int32_t>(static_cast<std::size_t>(triangle_count_));
  boxes_ = memory.array<Box>(2 * static_cast<std::size_t>(leaves_) - 1);
  positions_ = memory.array<float>(3 * static_cast<std::size_t>(nodes));
  finding_ = memory.array<palpate_crossing>(kMostKept), kept_ = memory.array<palpate_crossing>(kMostKept);
  if (memory.failed()) return false;
  calls_ = def.crossings_calls;
  SceneMemory scratch = memory.of_same_host();
  SurfaceTree at_rest;
  const bool made = at_rest.build(scratch, rest, nodes, triangles_, triangle_count_);
  if (made) std::copy_n(at_rest.order(), triangle_count_, order_);
  scratch.release_all();
  return made;
}

void CrossingCheck::grow(Box* box, std::int32_t triangle) const {
  for (int v = 0; v < 3; ++v) {
    const float* const x = positions_ + 3 * static_cast<std::size_t>(triangles_[3 * triangle + v]);
    palpate::grow(box, x, x);
  }
}

void CrossingCheck::corners(std::int32_t triangle, Vec3 corner[3]) const {
  for (int v = 0; v < 3; ++v) {
    const float* const x = positions_ + 3 * static_cast<std::size_t>(triangles_[3 * triangle + v]);
    corner[v] = {x[0], x[1], x[2]};
  }
}

bool CrossingCheck::go_on(const float* positions) {
  if (calls_ < def_.crossings_calls) ++calls_;
  if (!runs_ && calls_ >= def_.crossings_calls && !begin(positions)) return false;
  for (Operations left = def_.crossings_operations; runs_ && left > 0;) left -= unfitted_ > 0 ? refit() : search();
  return true;
}

bool CrossingCheck::begin(const float* positions) {
  const std::size_t floats = 3 * static_cast<std::size_t>(nodes_);
  float sum = 0;  // 0 where all are finite, else NaN
  for (std::size_t i = 0; i < floats; ++i) sum += 0 * positions[i];
  if (sum != 0) return false;
  std::copy_n(positions, floats, positions_);
  runs_ = true, calls_ = 0, found_ = 0;
  unfitted_ = 2 * leaves_ - 1, leaf_ = other_ = leaves_ - 1;
  return true;
}

// Refits the last box that is not refitted yet. Returns the operations that it took.
Operations CrossingCheck::refit() {
  const std::int32_t at = --unfitted_, leaf = at - (leaves_ - 1);
  Box* const box = boxes_ + at;
  empty(box);
  for (int child = 1; leaf < 0 && child < 3; ++child)
    palpate::grow(box, boxes_[2 * at + child].low, boxes_[2 * at + child].high);
  for (std::int32_t i = first_of(leaf); leaf >= 0 && i < first_of(leaf + 1); ++i)
    if (is_active(order_[i])) grow(box, order_[i]);
  return leaf < 0 ? 20 : 100;
}

// Looks at the box that comes next. Returns the operations that it took.
Operations CrossingCheck::search() {
  Operations work = 10;
  const bool is_apart = are_apart(boxes_[leaf_], boxes_[other_]), is_leaf = other_ >= leaves_ - 1;
  if (!is_apart && is_leaf) work += compare(leaf_ - (leaves_ - 1), other_ - (leaves_ - 1));
  if (!is_apart && !is_leaf) {
    other_ = 2 * other_ + 1;
    return work;
  }
  // The next box behind this one in the order of a walk: the other child of the nearest parent whose first child leads here.
  while (other_ > 0 && other_ % 2 == 0) other_ = (other_ - 1) / 2;
  if (other_ > 0) {
    ++other_;
    return work;
  }
  other_ = ++leaf_;
  if (leaf_ == 2 * leaves_ - 1) end();
  return work;
}

Operations CrossingCheck::compare(std::int32_t leaf, std::int32_t other) {
  Operations work = 0;
  for (std::int32_t i = first_of(leaf); i < first_of(leaf + 1); ++i)
    for (std::int32_t j = leaf == other ? i + 1 : first_of(other); j < first_of(other + 1); ++j) {
      const std::int32_t a = std::min(order_[i], order_[j]), b = std::max(order_[i], order_[j]);
      work += 15;
      if (!is_active(a) || !is_active(b)) continue;
      Box box_a, box_b;
      empty(&box_a), empty(&box_b);
      grow(&box_a, a), grow(&box_b, b);
      if (are_apart(box_a, box_b)) continue;
      work += 100;
      Vec3 at_a[3], at_b[3];
      corners(a, at_a), corners(b, at_b);
      CrossedEdge edge = {};
      if (triangles_cross(at_a, triangles_ + 3 * a, at_b, triangles_ + 3 * b, &edge)) add(a, b, edge);
    }
  return work;
}

void CrossingCheck::add(std::int32_t a, std::int32_t b, const CrossedEdge& edge) {
  if (found_++ >= kMostKept) return;
  palpate_crossing& crossing = finding_[found_ - 1];
  crossing = {{a, b}, {}, {}};
  const std::int32_t own = edge.of_a ? a : b, other = edge.of_a ? b : a;
  Vec3 corner[3];
  corners(own, corner);
  const auto at_rest = [&](std::int32_t triangle, int v) {
    return load3(rest_ + 3 * static_cast<std::size_t>(triangles_[3 * triangle + v]));
  };
  Vec3 rest_of_other;
  for (int v = 0; v < 3; ++v) rest_of_other += edge.weight[v] * at_rest(other, v);
  const Vec3 rest_of_own = at_rest(own, edge.from) + edge.along * (at_rest(own, edge.to) - at_rest(own, edge.from));
  store3(corner[edge.from] + edge.along * (corner[edge.to] - corner[edge.from]), crossing.place);
  store3(edge.of_a ? rest_of_own : rest_of_other, crossing.rest[0]);
  store3(edge.of_a ? rest_of_other : rest_of_own, crossing.rest[1]);
}

void CrossingCheck::end() {
  runs_ = false;
  ++checks_;
  pairs_ = found_;
  std::swap(finding_, kept_);
}

}  // namespace palpate
