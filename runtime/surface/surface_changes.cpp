// A surface whose triangles come, go and get other corners. A program without such scenes leaves this file out.
#include <algorithm>

#include "runtime/surface/node_fans.h"
#include "runtime/surface/surface_index.h"
#include "runtime/surface/surface_index_cells.h"
#include "runtime/surface/surface_measure.h"
#include "runtime/surface/surface_tree.h"

namespace palpate {

// ---- fans ------------------------------------------------------------------------------------------------------------

void NodeFans::note(std::int32_t node) {
  if (noted_[node]) return;
  noted_[node] = 1;
  changed_[with_neighbours_++] = node;
}

// Takes an entry out of its list and puts it into that of the node `to`; -1: into none.
void NodeFans::move(std::int32_t entry, std::int32_t to) {
  const std::int32_t from = node_of_[entry];
  if (from == to) return;
  const auto place_in = [&](std::int32_t node) {
    std::int32_t* at = &first_[node];
    while (*at >= 0 && *at < entry) at = &next_[*at];
    note(node);
    return at;
  };
  if (from >= 0) *place_in(from) = next_[entry];
  if (to >= 0) {
    std::int32_t* const at = place_in(to);
    next_[entry] = *at, *at = entry;
  }
  node_of_[entry] = to;
}

void NodeFans::change(const std::int32_t* triangles, std::int32_t count) {
  for (std::int32_t i = 0; i < with_neighbours_; ++i) noted_[changed_[i]] = 0;
  with_neighbours_ = 0;
  for (std::int32_t i = 0; i < count; ++i)
    for (std::int32_t entry = 3 * triangles[i]; entry < 3 * triangles[i] + 3; ++entry)
      move(entry, active_[triangles[i]] ? triangles_[entry] : -1);
  changed_count_ = with_neighbours_;
  for (std::int32_t i = 0; i < changed_count_; ++i)
    around(changed_[i], [&](std::int32_t triangle, int) {
      for (int v = 0; v < 3; ++v) note(triangles_[3 * triangle + v]);
    });
}

void NodeFans::change_all() {
  list_all(active_);
  changed_count_ = with_neighbours_ = nodes_;
  for (std::int32_t n = 0; n < nodes_; ++n) changed_[n] = n, noted_[n] = 1;
}

// ---- tree ------------------------------------------------------------------------------------------------------------

void SurfaceTree::change(const std::int32_t* triangles, std::int32_t count) {
  fans_.change(triangles, count);
  for (std::int32_t i = 0; i < count; ++i) change_leaf(leaf_of_[triangles[i]]);
}

void SurfaceTree::sort_leaf(const Node& leaf) {
  std::sort(order_ + leaf.first, order_ + leaf.first + leaf.places,
            [&](std::int32_t a, std::int32_t b) { return is_active(a) != is_active(b) ? is_active(a) : a < b; });
}

void SurfaceTree::restored() {
  for (std::int32_t at = 0; at < node_count_; ++at)
    if (!nodes_[at].is_inner()) sort_leaf(nodes_[at]);
  fans_.change_all();
}

// The leaf's box at rest is its bound from now on: path 0 is when the surface rested.
void SurfaceTree::change_leaf(std::int32_t leaf) {
  Node& node = nodes_[leaf];
  sort_leaf(node);
  const std::int32_t* const first = order_ + node.first;
  node.count = 0;
  node.rest = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
  for (; node.count < node.places && is_active(first[node.count]); ++node.count)
    for (int v = 0; v < 3; ++v) grow(node.rest, at_rest(corners(first[node.count])[v]));
  forget(node);
  for (std::int32_t at = node.parent; at >= 0; at = nodes_[at].parent) {
    const Node &a = nodes_[nodes_[at].first], &b = nodes_[nodes_[at].first + 1];
    nodes_[at].rest = around_both(a.rest, b.rest), nodes_[at].seen = around_both(a.seen, b.seen);
    nodes_[at].path = std::min(a.path, b.path);
  }
}

// ---- index -----------------------------------------------------------------------------------------------------------

void SurfaceIndex::change(const std::int32_t* triangles, std::int32_t count) {
  for (std::int32_t i = 0; i < count; ++i)
    cells_of_triangle(triangles[i], [&](int x, int y, int z) {
      Bucket* const bucket = slot(key(x, y, z));
      std::int32_t *const first = entries_ + bucket->begin, *const end = first + bucket->count,
                          *const at = std::lower_bound(first, end, triangles[i]);
      const bool is_in = at < end && *at == triangles[i];
      if (is_in == is_active(triangles[i])) return;
      if (is_in) {
        std::copy(at + 1, end, at);
        --bucket->count;
      } else {
        std::copy_backward(at, end, end + 1);
        *at = triangles[i];
        ++bucket->count;
      }
    });
}

// ---- measure ---------------------------------------------------------------------------------------------------------

void SurfaceMeasure::change(const NodeFans& fans) {
  for (std::int32_t i = 0; i < fans.changed_count(); ++i) {
    const std::int32_t node = fans.changed()[i];
    outward_[node] = {}, spacing_[node] = 0;
    fans.around(node, [&](std::int32_t triangle, int) { add_area(node, twice_area(triangle)); });
    end_area(node);
  }
  for (std::int32_t i = 0; i < fans.with_neighbours(); ++i) {
    const std::int32_t node = fans.changed()[i];
    curvature_[node] = {};
    fans.around(node, [&](std::int32_t triangle, int) { add_scaled(curvature_[node], 1, turn_of(triangle)); });
    end_curvature(node);
  }
}

}  // namespace palpate
