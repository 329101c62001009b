#include "meshing/surface/offset_to_volume.h"

#include <cmath>
#include <limits>

namespace palpate {
namespace {

std::vector<Point> point_normals(const TriangleSurface& surface) {
  std::vector<Point> normals(surface.points.size(), Point{});
  for (const auto& [a, b, c] : surface.triangles) {
    const Point n = cross(surface.points[b] - surface.points[a], surface.points[c] - surface.points[a]);
    for (const std::int32_t p : {a, b, c}) normals[p] = normals[p] + n;
  }
  for (Point& n : normals) {
    const double length = std::sqrt(dot(n, n));
    n = (length > 0 ? 1 / length : 0) * n;
  }
  return normals;
}

TriangleSurface moved(const TriangleSurface& surface, const std::vector<Point>& normals, double distance) {
  TriangleSurface result = surface;
  for (std::size_t p = 0; p < normals.size(); ++p) result.points[p] = surface.points[p] + distance * normals[p];
  return result;
}

}  // namespace

double offset_to_volume(std::vector<TriangleSurface*> shells, double volume_mm3) {
  std::vector<std::vector<Point>> normals;
  double surface_area = 0, triangles = 0;
  for (const TriangleSurface* shell : shells) {
    normals.push_back(point_normals(*shell));
    surface_area += area(*shell);
    triangles += static_cast<double>(shell->triangles.size());
  }
  const double most = std::sqrt(4 * surface_area / (std::sqrt(3.0) * triangles));
  const auto volume_at = [&](double distance) {
    double sum = 0;
    for (std::size_t s = 0; s < shells.size(); ++s) sum += enclosed_volume(moved(*shells[s], normals[s], distance));
    return sum;
  };
  // the volume is a cubic polynomial of d; its slope at d = 0 is about the area
  double distance = 0;
  for (int iteration = 0; iteration < 20; ++iteration) {
    const double miss = volume_at(distance) - volume_mm3;
    if (std::abs(miss) <= 1e-12 * std::abs(volume_mm3)) break;
    const double step = 1e-4 * most;
    const double slope = (volume_at(distance + step) - volume_at(distance - step)) / (2 * step);
    if (!(slope > 0)) return std::numeric_limits<double>::quiet_NaN();
    distance -= miss / slope;
    if (!(std::abs(distance) <= most)) return std::numeric_limits<double>::quiet_NaN();
  }
  for (std::size_t s = 0; s < shells.size(); ++s) *shells[s] = moved(*shells[s], normals[s], distance);
  return distance;
}

}  // namespace palpate
