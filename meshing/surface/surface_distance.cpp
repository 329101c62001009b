#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "meshing/surface/surface_mesh.h"
#include "meshing/surface/surface_report.h"

namespace palpate {

SurfaceDistance measure_distance(const TriangleSurface& reference, const TriangleSurface& surface) {
  using Primitive = CGAL::AABB_face_graph_triangle_primitive<CgalMesh>;
  const CgalMesh mesh = to_cgal(surface);
  CGAL::AABB_tree<CGAL::AABB_traits<CgalKernel, Primitive>> tree(faces(mesh).begin(), faces(mesh).end(), mesh);
  tree.accelerate_distance_queries();

  constexpr std::size_t kMostPoints = 100'000;
  const std::size_t stride = 1 + (reference.points.size() - 1) / kMostPoints;
  std::vector<double> distances;
  for (std::size_t p = 0; p < reference.points.size(); p += stride) {
    const auto& [x, y, z] = reference.points[p];
    distances.push_back(std::sqrt(tree.squared_distance({x, y, z})));
  }
  std::sort(distances.begin(), distances.end());
  SurfaceDistance result;
  result.mean_mm = std::accumulate(distances.begin(), distances.end(), 0.0) / static_cast<double>(distances.size());
  result.p95_mm = distances[static_cast<std::size_t>(0.95 * static_cast<double>(distances.size() - 1))];
  result.most_mm = distances.back();
  return result;
}

}  // namespace palpate
