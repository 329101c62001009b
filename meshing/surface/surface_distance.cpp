#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "meshing/surface/nearest_point.h"
#include "meshing/surface/surface_report.h"

namespace palpate {

SurfaceDistance measure_distance(const TriangleSurface& reference, const TriangleSurface& surface) {
  const NearestPoint nearest(surface);
  std::vector<Point> normals(reference.points.size());
  for (const auto& [a, b, c] : reference.triangles) {
    const Point n = cross(reference.points[b] - reference.points[a], reference.points[c] - reference.points[a]);
    for (const std::int32_t p : {a, b, c}) normals[p] = normals[p] + n;
  }
  constexpr std::size_t kMostPoints = 100'000;
  const std::size_t stride = 1 + (reference.points.size() - 1) / kMostPoints;
  SurfaceDistance result;
  std::vector<double> distances;
  for (std::size_t p = 0; p < reference.points.size(); p += stride) {
    const Point away = reference.points[p] - nearest(reference.points[p]);
    const double distance = std::sqrt(dot(away, away));
    distances.push_back(distance);
    if (distance <= result.outside_mm) continue;
    // The side of a tip is at right angles to the way back to the organ; rounding may turn it to either side.
    if (dot(away, normals[p]) < -0.5 * distance * std::sqrt(dot(normals[p], normals[p]))) continue;
    result.outside_mm = distance;
    result.outside_place = reference.points[p];
  }
  std::sort(distances.begin(), distances.end());
  result.mean_mm = std::accumulate(distances.begin(), distances.end(), 0.0) / static_cast<double>(distances.size());
  result.p95_mm = distances[static_cast<std::size_t>(0.95 * static_cast<double>(distances.size() - 1))];
  result.most_mm = distances.back();
  return result;
}

std::string lost_tip_warning(const SurfaceDistance& distance, double voxels_mm3, double voxel_mm,
                             const std::string& cure) {
  const double farthest = std::max(std::cbrt(voxels_mm3) / 20, 2 * voxel_mm);
  if (distance.outside_mm <= farthest) return {};
  const Point& place = distance.outside_place;
  return fmt::format(
      "voxels of the label lie up to {:.3g} mm outside of the surface, the farthest near ({:.5g}, {:.5g}, {:.5g}) mm; "
      "expected at most {:.3g} mm, a twentieth of the organ's size: a thin tip was lost; {}",
      distance.outside_mm, place[0], place[1], place[2], farthest, cure);
}

}  // namespace palpate
