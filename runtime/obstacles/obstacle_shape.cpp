#include "runtime/obstacles/obstacle_shape.h"

#include <cmath>

#include "runtime/base/sine.h"

namespace palpate {
namespace {

constexpr std::int32_t kCornersOfDisc = 48, kMostVertices = 1'000'000;
constexpr double kFarthest = 1e3;  // m, of a vertex from the origin of its frame
// Beyond this angle between the way to a point and the normal, the place is on an edge. A corner whose normal differs by more from that of a
// triangle counts there as flat (cosine of 25 degrees).
constexpr double kSmooth = 0.9063;
// m: a point that is nearer to the surface has no direction of its own.
constexpr double kOnSurface = 1e-6;

}  // namespace

const char* ObstacleShape::copy(SceneMemory& memory, const palpate_obstacle& from) {
  const bool is_mesh = from.kind == PALPATE_OBSTACLE_MESH, is_disc = from.kind == PALPATE_OBSTACLE_DISC;
  if (is_mesh && (!from.positions || !from.triangles || from.vertex_count < 3 || from.vertex_count > kMostVertices ||
                  from.triangle_count < 1 || from.triangle_count > 2 * kMostVertices))
    return "positions and triangles of 3 to 1 million vertices";
  const std::int32_t corners = is_mesh   ? from.vertex_count
                               : is_disc ? kCornersOfDisc
                                         : 4,
                     count = is_mesh ? from.triangle_count : corners - 2;
  auto* const position = memory.array<double>(3 * static_cast<std::size_t>(corners));
  auto* const triangle = memory.array<std::int32_t>(3 * static_cast<std::size_t>(count));
  if (memory.failed()) return nullptr;
  for (std::int32_t n = 0; n < corners; ++n) {
    double* const at = position + 3 * static_cast<std::size_t>(n);
    const SineCosine on_circle = sine_cosine(6.283185307179586 / corners * n);
    if (is_disc) at[0] = from.size[0] * on_circle.cosine, at[1] = from.size[0] * on_circle.sine;
    if (!is_disc && !is_mesh) {
      at[0] = (n == 0 || n == 3 ? -0.5 : 0.5) * from.size[0];
      at[1] = (n < 2 ? -0.5 : 0.5) * from.size[1];
    }
    for (int i = 0; i < 3 && is_mesh; ++i) {
      at[i] = from.positions[3 * static_cast<std::size_t>(n) + i];
      if (!(std::fabs(at[i]) <= kFarthest)) return "vertices within 1000 m of its origin";
    }
  }
  for (std::int32_t t = 0; t < count; ++t)
    for (int v = 0; v < 3; ++v) {
      std::int32_t& corner = triangle[3 * static_cast<std::size_t>(t) + v];
      corner = is_mesh ? from.triangles[3 * static_cast<std::size_t>(t) + v] : v == 0 ? 0 : t + v;
      if (corner < 0 || corner >= corners) return "triangles of its own vertices";
    }
  tree_.build(memory, position, corners, triangle, count);
  return nullptr;
}

// Triangles that have the edge in this direction.
std::int32_t ObstacleShape::count_edge(std::int32_t from, std::int32_t to) const {
  std::int32_t count = 0;
  tree_.around(from, [&](std::int32_t triangle) {
    const std::int32_t* const corner = tree_.corners(triangle);
    for (int v = 0; v < 3; ++v) count += corner[v] == from && corner[(v + 1) % 3] == to;
  });
  return count;
}

const char* ObstacleShape::find_normals(SceneMemory& memory) {
  const auto vertices = static_cast<std::size_t>(tree_.surface_nodes());
  normal_ = memory.array<Vec3>(vertices);
  on_border_ = memory.array<std::int32_t>(vertices);
  if (memory.failed()) return nullptr;
  for (std::int32_t t = 0; t < tree_.triangle_count(); ++t) {
    const std::int32_t* const corner = tree_.corners(t);
    const Vec3 a = tree_.at_rest(corner[0]), twice = cross(tree_.at_rest(corner[1]) - a, tree_.at_rest(corner[2]) - a);
    if (length(unit_or_zero(twice)) == 0) return "triangles with an area";
    for (int v = 0; v < 3; ++v) {
      const std::int32_t from = corner[v], to = corner[(v + 1) % 3];
      normal_[from] += twice;
      if (count_edge(from, to) > 1 || count_edge(to, from) > 1)
        return "each edge in one or two triangles, which have it in opposite directions";
      if (count_edge(to, from) == 0) on_border_[from] = on_border_[to] = 1;
    }
  }
  for (std::size_t n = 0; n < vertices; ++n) normal_[n] = unit_or_zero(normal_[n]);
  return nullptr;
}

const char* ObstacleShape::create(SceneMemory& memory, const palpate_obstacle& from) {
  const char* const wrong = copy(memory, from);
  return wrong || memory.failed() ? wrong : find_normals(memory);
}

bool ObstacleShape::is_on_border(const SurfacePoint& place) const {
  std::int32_t on[3];
  int count = 0;
  for (int v = 0; v < 3; ++v)
    if (place.barycentric[v] != 0) on[count++] = tree_.corners(place.triangle)[v];
  if (count == 1) return on_border_[on[0]] != 0;
  return count == 2 && count_edge(on[0], on[1]) + count_edge(on[1], on[0]) == 1;
}

// Between the normals of the corners where the surface is smooth there.
Vec3 ObstacleShape::normal_at(const SurfacePoint& place, Vec3 flat) const {
  Vec3 sum;
  for (int v = 0; v < 3; ++v) {
    const Vec3 of_corner = normal_[tree_.corners(place.triangle)[v]];
    sum += place.barycentric[v] * (dot(of_corner, flat) > kSmooth ? of_corner : flat);
  }
  return unit_or_zero(sum);
}

bool ObstacleShape::nearest(Vec3 p, double within, QueryWork* work, ObstaclePlace* place) {
  const NearestPoint found = tree_.nearest(
      p, within, {}, work, [&](std::int32_t n) { return tree_.at_rest(n); }, nullptr);
  if (found.surface_point.triangle < 0 || (!found.outside && is_on_border(found.surface_point))) return false;
  place->at = tree_.at_rest(found.surface_point);
  place->normal = normal_at(found.surface_point, found.outward);
  const Vec3 off = p - place->at;
  place->gap = dot(off, place->normal);
  if (found.outside && found.distance > kOnSurface && place->gap < kSmooth * found.distance)
    place->normal = (1 / found.distance) * off, place->gap = found.distance;
  return true;
}

}  // namespace palpate
