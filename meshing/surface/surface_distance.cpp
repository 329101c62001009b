#include <algorithm>
#include <cmath>
#include <numeric>

#include "meshing/surface/nearest_point.h"
#include "meshing/surface/surface_report.h"

namespace palpate {

SurfaceDistance measure_distance(const TriangleSurface& reference, const TriangleSurface& surface) {
  const NearestPoint nearest(surface);
  constexpr std::size_t kMostPoints = 100'000;
  const std::size_t stride = 1 + (reference.points.size() - 1) / kMostPoints;
  std::vector<double> distances;
  for (std::size_t p = 0; p < reference.points.size(); p += stride) {
    const Point away = reference.points[p] - nearest(reference.points[p]);
    distances.push_back(std::sqrt(dot(away, away)));
  }
  std::sort(distances.begin(), distances.end());
  SurfaceDistance result;
  result.mean_mm = std::accumulate(distances.begin(), distances.end(), 0.0) / static_cast<double>(distances.size());
  result.p95_mm = distances[static_cast<std::size_t>(0.95 * static_cast<double>(distances.size() - 1))];
  result.most_mm = distances.back();
  return result;
}

}  // namespace palpate
