#include "runtime/query/surface_query.h"

#include <algorithm>

#include "runtime/surface/surface_inside.h"

namespace palpate {
namespace {

// Mean edges of a ray that are looked at together: the box around a longer piece would hold many triangles beside the ray.
constexpr double kPiece = 4;
constexpr int kMostPieces = 1024;

}  // namespace

bool SurfaceQuery::create(SceneMemory& memory, const Tensors* tensors, const std::int32_t* touchable,
                          std::int32_t node_capacity, const BoundSurface* fine, bool large, double added_reach,
                          const OffsetRows& motions, double moved_reach) {
  tensors_ = tensors, fine_ = fine;
  return field_.create(memory, *tensors, touchable, node_capacity, large, added_reach, motions, moved_reach);
}

template <class Visit>
void SurfaceQuery::meet(Vec3 low, Vec3 high, Visit visit) {
  QueryWork work;
  const auto at = [&](std::int32_t node) { return place(node); };
  tree_.meet(low, high, field_.bound(), &work, at, at, visit);
}

// Cuts first and last, distances along the ray, to the box that the surface cannot leave. False where the ray misses that box.
bool SurfaceQuery::clip(Vec3 origin, Vec3 along, double* first, double* last) const {
  const double reach = tree_.largest_reach() * field_.bound().norm + 0.01 * tree_.mean_edge();
  for (int d = 0; d < 3; ++d) {
    const double low = tree_.low()[d] - reach - origin[d], high = tree_.high()[d] + reach - origin[d];
    if (along[d] == 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    const double a = low / along[d], b = high / along[d];
    *first = std::max(*first, std::min(a, b)), *last = std::min(*last, std::max(a, b));
  }
  return *first <= *last;
}

bool SurfaceQuery::cast_ray(Vec3 origin, Vec3 along, double longest, SurfaceHit* hit) {
  double first = 0, last = longest;
  if (tree_.triangle_count() == 0 || !clip(origin, along, &first, &last)) return false;
  const Vec3 end = origin + last * along;
  const double wanted = std::ceil((last - first) / (kPiece * tree_.mean_edge()));
  const int pieces = wanted >= 1 && wanted < kMostPieces ? static_cast<int>(wanted) : wanted >= 1 ? kMostPieces : 1;
  const double length = (last - first) / pieces;
  // The piece's ends are rounded.
  const double margin = 1e-9 * tree_.mean_edge() + 1e-14 * (largest_of(origin) + last);
  double best = INFINITY;
  for (int i = 0; i < pieces && best == INFINITY; ++i) {
    const double until = i + 1 == pieces ? last : first + (i + 1) * length;
    const Vec3 a = origin + (first + i * length) * along, b = origin + until * along;
    Vec3 low, high;
    for (int d = 0; d < 3; ++d) low[d] = std::min(a[d], b[d]) - margin, high[d] = std::max(a[d], b[d]) + margin;
    const auto visit = [&](std::int32_t triangle, const Vec3 corner[3]) {
      if (!corners_meet(corner, 3, 0, low, high) || segment_crosses(corner, origin, end) == 0) return;
      const Vec3 normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
      const double from = dot(normal, origin - corner[0]), to = dot(normal, end - corner[0]);
      const double distance = from == to ? 0 : last * std::clamp(from / (from - to), 0.0, 1.0);
      // One that is met behind this piece is met again in its own piece, after those before it.
      if (distance > until + margin) return;
      if (distance > best || (distance == best && hit->surface_point.triangle < triangle)) return;
      best = hit->distance = distance;
      hit->surface_point.triangle = triangle;
      closest_on_triangle(origin + distance * along, corner[0], corner[1], corner[2], hit->surface_point.barycentric);
      hit->outward = unit_or_zero(normal);
    };
    meet(low, high, visit);
  }
  hit->point = origin + hit->distance * along;
  return best < INFINITY;
}

bool SurfaceQuery::closest(Vec3 p, double farthest, SurfaceHit* hit) {
  QueryWork work;
  const auto at = [&](std::int32_t node) { return place(node); };
  const NearestPoint nearest = tree_.nearest(p, farthest, field_.bound(), &work, at, at);
  if (nearest.surface_point.triangle < 0) return false;
  hit->surface_point = nearest.surface_point;
  hit->distance = nearest.distance;
  hit->outward = nearest.outward;
  hit->point = Vec3{};
  for (int v = 0; v < 3; ++v)
    hit->point += nearest.surface_point.barycentric[v] * place(tree_.corners(nearest.surface_point.triangle)[v]);
  return true;
}

double SurfaceQuery::signed_distance(Vec3 p) {
  SurfaceHit hit;
  if (!closest(p, INFINITY, &hit)) return INFINITY;
  const bool inside =
      is_inside_surface(tree_, p, field_.bound(), [&](Vec3 low, Vec3 high, auto visit) { meet(low, high, visit); });
  return inside ? -hit.distance : hit.distance;
}

}  // namespace palpate
