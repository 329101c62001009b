// A bounding-volume tree over the triangles of a surface whose nodes move, and what is asked of such a surface: the nearest
// point, the side on which a point lies, the triangles near a way.
//
// The tree holds a box around the rest places of its triangles and a second one around the places where they were last seen.
// It is never refitted as a whole. Each box grows by a bound on how far its nodes may be now, and the boxes on the way to a
// triangle that a query looks at are refitted to what the query saw. So a part of the surface that nobody asks about costs
// nothing, and a part that does not move is looked at once.
//
// A box without active triangles is empty, from infinity to minus infinity, so that every query passes it over.
//
// The bound is that of energy. With C the compliance and f the nodal forces of a field u = C f, Cauchy and Schwarz give
//     |u_v| <= reach_v norm,   reach_v^2 = the largest eigenvalue of C_vv,   norm^2 = f^T C f,
// for every node v, however long the lever from the forces to the node is. The bound holds for the change of a field, too.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "runtime/base/scene_memory.h"
#include "runtime/base/step_work.h"
#include "runtime/base/vec3.h"
#include "runtime/surface/node_fans.h"
#include "runtime/surface/surface_index.h"

namespace palpate {

// How far the surface that is asked about may be from where the tree knows its nodes. All in sqrt(J).
struct FieldBound {
  double norm = 0;   // of the field that moves the surface from rest
  double path = 0;   // sum of the norms of the field's changes since the tree was made
  double apart = 0;  // norm of the difference between the surface that is asked about and the field's
};

// The surface point nearest to a place, among those within the asked distance.
struct NearestPoint {
  SurfacePoint surface_point;  // triangle -1: nothing within the asked distance
  double distance = 0;         // m; the asked distance where nothing is nearer
  // m / sqrt(J). The nearest distance stays above `distance` - |way of the place| - per_path * (growth of the path).
  double per_path = 0;
  bool outside = true;  // the side of the nearest point on which the place lies; true where nothing is near
  Vec3 outward;         // unit normal of its triangle; zero where nothing is near
};

// In place of `field` below, where the surface that is asked about is the one that the field makes.
struct AskedIsField {};

class SurfaceTree {
 public:
  // position [nodes][3] m and triangles [triangle_count][3] (checked, closed, counter-clockwise from outside) are borrowed.
  // active: [triangle_count], 0: the triangle is in no answer; borrowed; nullptr: all are active, for good. Those that are active are then the
  // closed surface. Reaches are zero: a surface at rest. False where there is no memory. Cost: F log F.
  bool build(SceneMemory& memory, const double* position, std::int32_t nodes, const std::int32_t* triangles,
             std::int32_t triangle_count, const std::uint8_t* active = nullptr);
  // As NodeFans::change (node_fans.h). The boxes around these triangles know rest places alone until a query looks at them. Cost: the leaves of these triangles, and their parents.
  void change(const std::int32_t* triangles, std::int32_t count);
  // The same of all triangles where the boxes are those of a state that was restored, and stay.
  void restored();
  // reach: [nodes] m / sqrt(J), read during the call. Where triangles change, all reaches must be the same, as those of a field whose norm is a
  // length: they do not follow the corners. And the path must grow by no less than a new corner moves from where the corner before it was.
  void set_reach(const double* reach);
  // Marks where the triangles were seen as part of a saved state (scene_memory.h). A surface at rest needs none of it.
  void keep_seen(SceneMemory& memory) { memory.keep_array(nodes_, static_cast<std::size_t>(node_count_)); }
  // Forgets where the triangles were seen: the surface is at rest, and paths begin at zero again.
  void forget();

  std::int32_t triangle_count() const { return triangle_count_; }  // inactive ones included
  bool is_active(std::int32_t triangle) const { return !active_ || active_[triangle] != 0; }
  // [triangle_count] the triangles leaf by leaf, so that neighbours at rest stand near one another; inactive ones included.
  const std::int32_t* order() const { return order_; }
  std::int32_t surface_nodes() const { return surface_nodes_; }
  double largest_reach() const { return triangle_count_ > 0 ? nodes_[0].reach : 0; }
  double mean_edge() const { return mean_edge_; }  // as when it was built, like low() and high()
  std::int32_t largest_fan() const {
    return fans_.largest();
  }  // triangles around one node at most, whichever are active
  const NodeFans& fans() const { return fans_; }
  Vec3 low() const { return low_; }
  Vec3 high() const { return high_; }
  const std::int32_t* corners(std::int32_t triangle) const {
    return triangles_ + 3 * static_cast<std::size_t>(triangle);
  }
  Vec3 at_rest(std::int32_t node) const { return load3(position_ + 3 * static_cast<std::size_t>(node)); }
  Vec3 at_rest(const SurfacePoint& surface_point) const;
  Vec3 outward_at_rest(std::int32_t triangle) const;

  // Calls visit(triangle) for every triangle around a node.
  template <class Visit>
  void around(std::int32_t node, Visit visit) const {
    fans_.around(node, [&](std::int32_t triangle, int) { visit(triangle); });
  }

  // Calls visit(triangle) for every triangle whose box at rest may meet the box [low, high], whatever was seen.
  template <class Visit>
  void near_at_rest(Vec3 low, Vec3 high, Operations* work, Visit visit) const;

  // In all other queries, place(node) gives the place of a node of the surface that is asked about, and field(node) that of the surface
  // that the field makes, m. The tree remembers the latter. field: nullptr where the tree is not told, as where the surface does not move.

  // A query that ends before it is finished (work->ended()) has an answer without meaning.

  // Calls visit(triangle, corner) for every triangle whose box may meet the box [low, high]; corner: [3] its corners now.
  template <class Place, class Field, class Visit>
  void meet(Vec3 low, Vec3 high, const FieldBound& bound, QueryWork* work, Place place, Field field, Visit visit);

  // The nearest surface point within `within` metres.
  template <class Place, class Field>
  NearestPoint nearest(Vec3 p, double within, const FieldBound& bound, QueryWork* work, Place place, Field field);

 private:
  static constexpr int kLeaf = 4;
  static constexpr int kDeepest = 64;
  struct Box {
    Vec3 low, high;
  };
  struct Node {
    Box rest, seen;
    double reach;         // largest of its nodes' reaches
    double path;          // least path at which one of its triangles was seen
    std::int32_t first;   // inner: its first child; the other one follows. leaf: its first triangle in order_
    std::int32_t count;   // active triangles of a leaf, which stand first
    std::int32_t parent;  // -1: the root
    std::int32_t places;  // triangles of a leaf; 0: inner
    bool is_inner() const { return places == 0; }
  };
  std::int32_t split(std::int32_t parent, std::int32_t at, std::int32_t first, std::int32_t last);
  Box rest_box(std::int32_t triangle) const;
  static void forget(Node& node);
  void sort_leaf(const Node& leaf);
  void change_leaf(std::int32_t leaf);
  static double gap(const Box& box, Vec3 p);
  static void grow(Box& box, Vec3 p);
  static Box around_both(const Box& a, const Box& b);
  static bool same(const Box& a, const Box& b);
  static bool apart(const Box& box, double margin, Vec3 low, Vec3 high);
  double distance_bound(const Node& node, Vec3 p, const FieldBound& bound) const;
  bool may_meet(const Node& node, Vec3 low, Vec3 high, const FieldBound& bound) const;
  template <class Place, class Field, class Visit>
  void look_at(std::int32_t leaf, double path, const QueryWork& work, Place place, Field field, Visit visit);
  void refit(std::int32_t leaf, const Box& box, double path);
  template <class Place>
  void decide_side(NearestPoint& nearest, Vec3 p, QueryWork* work, Place place);

  const double* position_ = nullptr;
  const std::int32_t* triangles_ = nullptr;
  const std::uint8_t* active_ = nullptr;
  std::int32_t surface_nodes_ = 0, triangle_count_ = 0, node_count_ = 0;
  Node* nodes_ = nullptr;
  std::int32_t* order_ = nullptr;    // [triangles] in the order of the leaves
  std::int32_t* leaf_of_ = nullptr;  // [triangles] the leaf of each, where triangles change
  NodeFans fans_;
  Vec3 low_, high_;
  double mean_edge_ = 0;
};

// The angle of a triangle at the corner a, in radians, to 1e-4.
double corner_angle(Vec3 a, Vec3 b, Vec3 c);

inline double SurfaceTree::gap(const Box& box, Vec3 p) {
  // x + |x| is exactly twice the larger one of x and 0, and takes no jump.
  const auto twice = [](double low, double high, double at) {
    const double below = low - at, above = at - high;
    return (below + std::fabs(below)) + (above + std::fabs(above));
  };
  return 0.5 * length({twice(box.low.x, box.high.x, p.x), twice(box.low.y, box.high.y, p.y),
                       twice(box.low.z, box.high.z, p.z)});
}

inline void SurfaceTree::grow(Box& box, Vec3 p) {
  box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
  box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
}

inline double SurfaceTree::distance_bound(const Node& node, Vec3 p, const FieldBound& bound) const {
  const double from_rest = gap(node.rest, p) - node.reach * (bound.norm + bound.apart),
               from_seen = gap(node.seen, p) - node.reach * (bound.path - node.path + bound.apart);
  return std::max(0.0, std::max(from_rest, from_seen));
}

inline bool SurfaceTree::apart(const Box& box, double margin, Vec3 low, Vec3 high) {
  return box.low.x - margin > high.x || box.high.x + margin < low.x || box.low.y - margin > high.y ||
         box.high.y + margin < low.y || box.low.z - margin > high.z || box.high.z + margin < low.z;
}

inline bool SurfaceTree::may_meet(const Node& node, Vec3 low, Vec3 high, const FieldBound& bound) const {
  return !apart(node.rest, node.reach * (bound.norm + bound.apart), low, high) &&
         !apart(node.seen, node.reach * (bound.path - node.path + bound.apart), low, high);
}

// Visits the triangles of a leaf with their corners, and refits the boxes around it to where the field has them.
template <class Place, class Field, class Visit>
void SurfaceTree::look_at(std::int32_t leaf, double path, const QueryWork& work, Place place, Field field,
                          Visit visit) {
  constexpr bool remembers = !std::is_same_v<Field, std::nullptr_t>, is_the_field = std::is_same_v<Field, AskedIsField>;
  const Node& node = nodes_[leaf];
  Box box{{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
  for (std::int32_t i = node.first; i < node.first + node.count; ++i) {
    const std::int32_t triangle = order_[i];
    Vec3 corner[3];
    for (int v = 0; v < 3; ++v) {
      corner[v] = place(corners(triangle)[v]);
      if constexpr (is_the_field)
        grow(box, corner[v]);
      else if constexpr (remembers)
        grow(box, field(corners(triangle)[v]));
    }
    visit(triangle, corner);
  }
  if (remembers && !work.ended()) refit(leaf, box, path);
}

template <class Visit>
void SurfaceTree::near_at_rest(Vec3 low, Vec3 high, Operations* work, Visit visit) const {
  if (triangle_count_ == 0) return;
  std::int32_t stack[kDeepest];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[stack[--top]];
    *work += 8 + 20 * node.count;
    if (apart(node.rest, 0, low, high)) continue;
    if (node.is_inner()) stack[top++] = node.first, stack[top++] = node.first + 1;
    for (std::int32_t i = node.first; i < node.first + node.count; ++i) visit(order_[i]);
  }
}

template <class Place, class Field, class Visit>
void SurfaceTree::meet(Vec3 low, Vec3 high, const FieldBound& bound, QueryWork* work, Place place, Field field,
                       Visit visit) {
  if (triangle_count_ == 0) return;
  std::int32_t stack[kDeepest];
  int top = 0;
  stack[top++] = 0;
  while (top > 0 && !work->ended()) {
    const std::int32_t at = stack[--top];
    const Node& node = nodes_[at];
    work->add(12);
    if (!may_meet(node, low, high, bound)) continue;
    if (node.is_inner()) {
      stack[top++] = node.first, stack[top++] = node.first + 1;
      continue;
    }
    look_at(at, bound.path, *work, place, field, [&](std::int32_t triangle, const Vec3 corner[3]) {
      work->add(60);
      visit(triangle, corner);
    });
  }
}

template <class Place, class Field>
NearestPoint SurfaceTree::nearest(Vec3 p, double within, const FieldBound& bound, QueryWork* work, Place place,
                                  Field field) {
  NearestPoint best;
  best.distance = within;
  if (triangle_count_ == 0) return best;
  double steepest = 0;  // largest reach / distance of what was looked at or passed over
  const auto pass = [&](double reach, double distance) {
    const double slope = distance > 0 ? reach / distance : (reach > 0 ? INFINITY : 0);
    if (slope > steepest) steepest = slope;
  };
  struct Waiting {
    std::int32_t node;
    double distance;
  };
  Waiting stack[kDeepest];
  int top = 0;
  stack[top++] = {0, distance_bound(nodes_[0], p, bound)};
  while (top > 0 && !work->ended()) {
    const Waiting next = stack[--top];
    const Node& node = nodes_[next.node];
    if (next.distance >= best.distance) {
      pass(node.reach, next.distance);
      continue;
    }
    if (node.is_inner()) {
      const Node *const first = nodes_ + node.first, *const second = first + 1;
      const Waiting child[2] = {{node.first, distance_bound(*first, p, bound)},
                                {node.first + 1, distance_bound(*second, p, bound)}};
      work->add(24);
      // Where the bounds do not tell them apart, first the one that was seen nearer.
      const bool equal = child[0].distance == child[1].distance;
      const int near = equal ? gap(second->seen, p) < gap(first->seen, p) : child[1].distance < child[0].distance;
      stack[top++] = child[1 - near], stack[top++] = child[near];
      continue;
    }
    look_at(next.node, bound.path, *work, place, field, [&](std::int32_t triangle, const Vec3 corner[3]) {
      work->add(80);
      double k[3];
      const double distance = std::sqrt(closest_on_triangle(p, corner[0], corner[1], corner[2], k));
      pass(node.reach, distance);
      // Of two triangles at one distance the first one counts, whatever the order of the visits.
      if (distance > best.distance ||
          (distance == best.distance && best.surface_point.triangle >= 0 && best.surface_point.triangle < triangle))
        return;
      best.distance = distance;
      best.surface_point.triangle = triangle;
      for (int v = 0; v < 3; ++v) best.surface_point.barycentric[v] = k[v];
    });
  }
  best.per_path = best.distance * steepest;
  if (best.surface_point.triangle >= 0 && !work->ended()) decide_side(best, p, work, place);
  return best;
}

// The side of the surface at its nearest point: the sign of the distance to the plane of the face, or, at an edge or a vertex, the
// sign against the faces' normals weighted by their angles there. Source: Baerentzen and Aanaes 2005, Signed distance computation
// using the angle weighted pseudonormal.
template <class Place>
void SurfaceTree::decide_side(NearestPoint& nearest, Vec3 p, QueryWork* work, Place place) {
  const std::int32_t* own = corners(nearest.surface_point.triangle);
  const double* k = nearest.surface_point.barycentric;
  const auto normal_of = [&](const std::int32_t* node, Vec3 corner[3]) {
    for (int v = 0; v < 3; ++v) corner[v] = place(node[v]);
    return unit_or_zero(cross(corner[1] - corner[0], corner[2] - corner[0]));
  };
  Vec3 corner[3];
  nearest.outward = normal_of(own, corner);
  const Vec3 closest = k[0] * corner[0] + k[1] * corner[1] + k[2] * corner[2];
  Vec3 sum = nearest.outward;
  int on[3], count = 0;  // the corners whose weight is not zero
  for (int v = 0; v < 3; ++v)
    if (k[v] != 0) on[count++] = v;
  if (count < 3) {
    sum = {};
    const std::int32_t node = own[on[0]], other = count == 2 ? own[on[1]] : -1;
    fans_.around(node, [&](std::int32_t triangle, int v) {
      const std::int32_t* around = corners(triangle);
      if (count == 2 && around[0] != other && around[1] != other && around[2] != other) return;
      Vec3 there[3];
      const Vec3 normal = normal_of(around, there);
      work->add(60);
      double weight = 1;
      if (count == 1) weight = corner_angle(there[v], there[(v + 1) % 3], there[(v + 2) % 3]);
      sum += weight * normal;
    });
  }
  nearest.outside = dot(p - closest, sum) >= 0;
}

}  // namespace palpate
