// Makes the tree, when a scene is created; what a step asks of it is in surface_tree.cpp.
#include <algorithm>

#include "runtime/surface/surface_tree.h"

namespace palpate {

SurfaceTree::Box SurfaceTree::rest_box(std::int32_t triangle) const {
  const std::int32_t* node = corners(triangle);
  const Vec3 a = at_rest(node[0]), b = at_rest(node[1]), c = at_rest(node[2]);
  return around_both({a, a}, around_both({b, b}, {c, c}));
}

bool SurfaceTree::build(SceneMemory& memory, const double* position, std::int32_t nodes, const std::int32_t* triangles,
                        std::int32_t triangle_count, const std::uint8_t* active) {
  position_ = position, triangles_ = triangles, surface_nodes_ = nodes, triangle_count_ = triangle_count;
  active_ = active;
  const std::size_t count = static_cast<std::size_t>(triangle_count);
  nodes_ = memory.array<Node>(count + 1);  // a leaf has two triangles or more
  order_ = memory.array<std::int32_t>(count);
  if (active) leaf_of_ = memory.array<std::int32_t>(count);
  if (memory.failed() || !fans_.build(memory, nodes, triangles, triangle_count, active)) return false;
  if (triangle_count == 0) return true;

  double edges = 0;
  std::int32_t active_count = 0;
  for (std::int32_t t = 0; t < triangle_count; ++t) {
    if (!is_active(t)) continue;
    order_[active_count++] = t;
    for (int v = 0; v < 3; ++v) edges += length(at_rest(corners(t)[v]) - at_rest(corners(t)[(v + 1) % 3]));
  }
  mean_edge_ = edges / (3.0 * std::max(1, active_count));
  for (std::int32_t t = 0, at = active_count; at < triangle_count; ++t)
    if (!is_active(t)) order_[at++] = t;

  node_count_ = 1;
  split(-1, 0, 0, triangle_count);
  low_ = nodes_[0].rest.low, high_ = nodes_[0].rest.high;
  return true;
}

// Makes node `at` of the triangles order_[first .. last - 1], halved along their centres' longest extent. Active ones, which stand first, are
// parted from the others before all else, so that the surface as it is now has the tree that it would have alone.
std::int32_t SurfaceTree::split(std::int32_t parent, std::int32_t at, std::int32_t first, std::int32_t last) {
  Node& node = nodes_[at];
  node = Node{};
  node.parent = parent;
  Box centres = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
  node.rest = centres;
  const auto twice_centre = [&](std::int32_t triangle) {
    const Box box = rest_box(triangle);
    return box.low + box.high;
  };
  for (std::int32_t i = first; i < last; ++i) {
    const Box box = rest_box(order_[i]);
    if (is_active(order_[i])) node.rest = around_both(node.rest, box);
    centres = around_both(centres, {box.low + box.high, box.low + box.high});
  }
  forget(node);
  const bool is_mixed = is_active(order_[first]) && !is_active(order_[last - 1]);
  if (last - first <= kLeaf && !is_mixed) {
    std::sort(order_ + first, order_ + last);
    node.first = first, node.places = last - first, node.count = is_active(order_[first]) ? node.places : 0;
    for (std::int32_t i = first; i < last && leaf_of_; ++i) leaf_of_[order_[i]] = at;
    return at;
  }
  const Vec3 size = centres.high - centres.low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  std::int32_t middle = first + (last - first) / 2;
  if (is_mixed)
    for (middle = first; is_active(order_[middle]);) ++middle;
  // Ties are decided by number, so that every C++ library makes the same tree.
  const auto is_before = [&](std::int32_t a, std::int32_t b) {
    const double x = twice_centre(a)[axis], y = twice_centre(b)[axis];
    return x != y ? x < y : a < b;
  };
  if (!is_mixed) std::nth_element(order_ + first, order_ + middle, order_ + last, is_before);
  const std::int32_t children = node_count_;
  node_count_ += 2;
  node.first = children;
  split(at, children, first, middle);
  split(at, children + 1, middle, last);
  return at;
}

}  // namespace palpate
