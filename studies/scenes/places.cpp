#include "studies/scenes/places.h"

#include <algorithm>

#include "formats/errors.h"

namespace palpate::scenes {
namespace {

using Eigen::Vector3d;

Vector3d node(const ElasticBody& body, std::int32_t n) {
  return Vector3d(body.nodes[static_cast<std::size_t>(n)].data());
}

SurfacePlace place_on(const ElasticBody& body, std::size_t triangle) {
  const auto& t = body.triangles[triangle];
  const Vector3d a = node(body, t[0]), b = node(body, t[1]), c = node(body, t[2]);
  return {static_cast<std::int32_t>(triangle), (a + b + c) / 3, (b - a).cross(c - a).normalized()};
}

std::vector<char> touchable_nodes(const ElasticBody& body) {
  std::vector<char> free(body.nodes.size());
  for (const std::int32_t n : body.touchable) {
    const auto& f = body.fixed[static_cast<std::size_t>(n)];
    free[static_cast<std::size_t>(n)] = !f[0] && !f[1] && !f[2];
  }
  return free;
}

// m along the ray, at most `longest`.
double way_through(const ElasticBody& body, const Vector3d& from, const Vector3d& along, double longest) {
  for (const auto& t : body.triangles) {
    const Vector3d a = node(body, t[0]);
    Eigen::Matrix3d m;
    m << node(body, t[1]) - a, node(body, t[2]) - a, -along;
    if (std::abs(m.determinant()) < 1e-30) continue;
    const Vector3d x = m.partialPivLu().solve(from - a);
    if (x[0] >= 0 && x[1] >= 0 && x[0] + x[1] <= 1 && x[2] > 1e-9) longest = std::min(longest, x[2]);
  }
  return longest;
}

// Of the nodes in the outer eighth of the box at one side, those that may be touched along all axes, times their share: a blunt side counts
// more than a tip.
double freedom_of_side(const ElasticBody& body, const Box& box, int axis, double sign) {
  const double deep = (box.high[axis] - box.low[axis]) / 8;
  const std::vector<char> free = touchable_nodes(body);
  int all = 0, of = 0;
  for (std::int32_t n = 0; n < body.surface_count; ++n) {
    const double x = node(body, n)[axis];
    if (sign > 0 ? x < box.high[axis] - deep : x > box.low[axis] + deep) continue;
    ++all, of += free[static_cast<std::size_t>(n)];
  }
  return all > 0 ? static_cast<double>(of) * of / all : 0;
}

}  // namespace

Box box_of(const ElasticBody& body) {
  Box box{node(body, 0), node(body, 0)};
  for (std::int32_t n = 0; n < body.surface_count; ++n)
    box.low = box.low.cwiseMin(node(body, n)), box.high = box.high.cwiseMax(node(body, n));
  double best = -1;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {1.0, -1.0})
      if (const double free = freedom_of_side(body, box, axis, sign); free > best)
        best = free, box.axis = axis, box.sign = sign;
  return box;
}

std::vector<SurfacePlace> touchable_places(const ElasticBody& body, std::size_t count) {
  const std::vector<char> free = touchable_nodes(body);
  std::vector<SurfacePlace> all, some;
  for (std::size_t t = 0; t < body.triangles.size(); ++t)
    if (std::ranges::all_of(body.triangles[t], [&](std::int32_t n) { return free[static_cast<std::size_t>(n)] != 0; }))
      all.push_back(place_on(body, t));
  for (std::size_t i = 0; i < std::min(count, all.size()); ++i)
    some.push_back(all[i * all.size() / std::min(count, all.size())]);
  return some;
}

Way longest_way(const ElasticBody& body) {
  const double size = box_of(body).size();
  Way best;
  for (const SurfacePlace& place : touchable_places(body, 200))
    if (const double length = way_through(body, place.point, -place.outward, size);
        length < size && length > best.length)
      best = {place, -place.outward, length};
  if (best.length == 0) throw InputError("expected triangles whose three nodes may be touched, found none");
  return best;
}

SurfacePlace place_at_the_side(const ElasticBody& body, const Box& box) {
  const std::vector<SurfacePlace> places = touchable_places(body, 2000);
  const Vector3d middle = 0.5 * (box.low + box.high);
  // Far out and facing outwards: no other part of the organ lies in front of it.
  const auto aside = [&](const SurfacePlace& p) {
    Vector3d way = p.point - middle;
    way[box.axis] = 0;
    return way.dot(p.outward);
  };
  return *std::ranges::max_element(places, {}, aside);
}

palpate_pose over(const Box& box, double gap) {
  const int a = box.axis, other = (a + 2) % 3;  // the turn by 180 degrees is about the third axis
  Vector3d position = Vector3d::Zero();
  position[a] = box.sign > 0 ? 2 * box.high[a] + gap : 2 * box.low[a] - gap;
  position[other] = box.low[other] + box.high[other];
  palpate_pose pose = pose_at(position);
  pose.orientation[0] = 0, pose.orientation[1 + (a + 1) % 3] = 1;
  return pose;
}

double gap_of_first_touch(palpate_bundle* bundle, const Box& box, double within) {
  PlayedWorld world({{bundle, pose_at({0, 0, 0})}, {bundle, over(box, within)}}, touching_scene(), 500);
  double gap = within;
  while (world.pressing() == 0 && gap > -0.4 * box.depth()) {
    gap -= within;
    world.place(1, over(box, gap));
    world.touch();
  }
  return gap;
}

}  // namespace palpate::scenes
