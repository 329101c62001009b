#include "runtime/surface/bound_surface.h"

#include <algorithm>

namespace palpate {

double BoundSurface::reach(std::int32_t vertex, const double* of_node) const {
  const Vertex& bound = vertices_[vertex];
  double sum = 0;
  for (int i = 0; i < 3; ++i) sum += bound.weight[i] * of_node[mesh_corners(bound.triangle)[i]];
  for (std::int32_t t = bound.first; t < bound.first + bound.turns; ++t) {
    double squares = 0;  // of the Frobenius norm, which is no smaller than the largest stretch
    for (const auto& row : turns_[t].m)
      for (const float x : row) squares += static_cast<double>(x) * static_cast<double>(x);
    sum += std::sqrt(squares) * of_node[turns_[t].node];
  }
  return sum;
}

// Between the places that the corners are bound to the point moves in a straight line, which cuts off edges of the mesh: the place
// is the nearest point of the mesh's triangles around the corners' nodes.
SurfacePoint BoundSurface::beneath(const SurfacePoint& point) const {
  const std::int32_t* corner = corners(point.triangle);
  const Vertex* bound[3];
  for (int v = 0; v < 3; ++v) bound[v] = vertices_ + corner[v];
  SurfacePoint below;
  if (bound[0]->triangle == bound[1]->triangle && bound[0]->triangle == bound[2]->triangle) {
    below.triangle = bound[0]->triangle;
    for (int v = 0; v < 3; ++v)
      for (int i = 0; i < 3; ++i) below.barycentric[i] += point.barycentric[v] * bound[v]->weight[i];
    return below;
  }
  Vec3 place;
  for (int v = 0; v < 3; ++v)
    for (int i = 0; i < 3; ++i)
      place += point.barycentric[v] * bound[v]->weight[i] * mesh_at_rest(mesh_corners(bound[v]->triangle)[i]);
  double best = INFINITY;
  const auto look_at = [&](std::int32_t triangle) {
    const std::int32_t* node = mesh_corners(triangle);
    double k[3];
    const double distance =
        closest_on_triangle(place, mesh_at_rest(node[0]), mesh_at_rest(node[1]), mesh_at_rest(node[2]), k);
    // Of two triangles at one distance the first one counts.
    if (distance > best || (distance == best && below.triangle < triangle)) return;
    best = distance;
    below.triangle = triangle;
    std::copy(k, k + 3, below.barycentric);
  };
  for (int v = 0; v < 3; ++v)
    for (int i = 0; i < 3; ++i) {
      const std::int32_t node = mesh_corners(bound[v]->triangle)[i];
      for (std::int32_t f = fan_start_[node]; f < fan_start_[node + 1]; ++f) look_at(fan_[f]);
    }
  return below;
}

Vec3 BoundSurface::outward(const SurfacePoint& point) const {
  Vec3 sum;
  for (int v = 0; v < 3; ++v) sum += point.barycentric[v] * unit_or_zero(area_[corners(point.triangle)[v]]);
  sum = unit_or_zero(sum);
  return length(sum) > 0 ? sum : index_.outward(point.triangle);
}

// The mean is that of the triangles whose centres are below the disc, weighted by their area, less towards its rim, so that the mean
// is continuous while the disc moves. Triangles that turn away from the normal at the place itself belong to another side of the organ.
// That normal counts as much as one vertex' share of the surface, so that a disc that is small against the triangles has it.
Vec3 BoundSurface::outward(const SurfacePoint& point, double radius, const SurfaceTree& tree, Operations* work) const {
  const Vec3 here = outward(point), centre = index_.position(point);
  if (!(radius > 0)) return here;
  double share = 0;
  for (int v = 0; v < 3; ++v) share += point.barycentric[v] * length(area_[corners(point.triangle)[v]]);
  Vec3 sum = share * here;
  const Vec3 reach{radius, radius, radius};
  tree.near_at_rest(centre - reach, centre + reach, work, [&](std::int32_t triangle) {
    const Vec3 a = index_.corner(triangle, 0), b = index_.corner(triangle, 1), c = index_.corner(triangle, 2);
    const Vec3 from = (1.0 / 3) * (a + b + c) - centre;
    const double squares = dot(from, from) / (radius * radius);
    if (!(squares < 1)) return;
    const Vec3 area = 0.5 * cross(b - a, c - a);
    const double along = dot(unit_or_zero(area), here);
    if (along > 0) sum += (std::min(1.0, 3 * along) * (1 - squares * squares)) * area;
  });
  sum = unit_or_zero(sum);
  return length(sum) > 0 ? sum : here;
}

}  // namespace palpate
