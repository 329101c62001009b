#include "meshing/surface/remesh.h"

#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "meshing/surface/improve_triangles.h"
#include "meshing/surface/surface_mesh.h"

namespace palpate {

namespace {

// Bounds of simplify_by_curvature. No collapse may leave a triangle below kLeastRatio: at 0.5 no angle is below 16.8
// degrees. Triangles above kGoodRatio are not improved. A higher bound increases the distance to the organ, because
// stretched triangles follow a bend better. With a kGoodRatio of 0.6 the liver's tetrahedra had dihedral angles below
// 10 degrees.
constexpr double kLeastRatio = 0.5, kGoodRatio = 0.7;
constexpr int kImprovingPasses = 5;

// sharp: degrees between the normals of two triangles; an edge with more stays where it is.
TriangleSurface isotropic(const TriangleSurface& surface, double edge_mm, unsigned iterations,
                          unsigned relaxation_steps, double sharp = 180) {
  CgalMesh mesh = to_cgal(surface);
  const auto stays = mesh.add_property_map<CgalMesh::Edge_index, bool>("e:stays", false).first;
  if (sharp < 180) CGAL::Polygon_mesh_processing::detect_sharp_edges(mesh, sharp, stays);
  CGAL::Polygon_mesh_processing::isotropic_remeshing(mesh.faces(), edge_mm, mesh,
                                                     CGAL::parameters::number_of_iterations(iterations)
                                                         .number_of_relaxation_steps(relaxation_steps)
                                                         .do_project(relaxation_steps > 0)
                                                         .edge_is_constrained_map(stays));
  return from_cgal(mesh);
}

// Splits long edges: the same shape with more triangles.
TriangleSurface split(const TriangleSurface& surface, double edge_mm) {
  CgalMesh mesh = to_cgal(surface);
  CGAL::Polygon_mesh_processing::split_long_edges(mesh.edges(), edge_mm, mesh);
  return from_cgal(mesh);
}

// Refuses a collapse that leaves a triangle below the least radius ratio, unless the smallest ratio around it does
// not fall.
class ShapeFilter {
 public:
  explicit ShapeFilter(double least_ratio) : least_ratio_(least_ratio) {}

  // profile.triangles() lists the two triangles that vanish first. In all others the collapse moves v1.
  template <typename Profile>
  boost::optional<typename Profile::Point> operator()(const Profile& profile,
                                                      boost::optional<typename Profile::Point> placed) const {
    if (!placed) return placed;
    const auto point = [](const auto& p) { return Point{p.x(), p.y(), p.z()}; };
    const auto at = [&](const auto& vertex) { return point(get(profile.vertex_point_map(), vertex)); };
    const int vanishing = (profile.left_face_exists() ? 1 : 0) + (profile.right_face_exists() ? 1 : 0);
    double before = 1, after = 1;
    int t = 0;
    for (const auto& triangle : profile.triangles()) {
      const Point p = at(triangle.v0), r = at(triangle.v2);
      before = std::min(before, radius_ratio(p, at(triangle.v1), r));
      if (t++ >= vanishing) after = std::min(after, radius_ratio(p, point(*placed), r));
    }
    if (after < least_ratio_ && after < before) return boost::none;
    return placed;
  }

 private:
  double least_ratio_;
};

double mean_radius_ratio(const TriangleSurface& surface) {
  double sum = 0;
  for (const auto& [a, b, c] : surface.triangles)
    sum += radius_ratio(surface.points[a], surface.points[b], surface.points[c]);
  return sum / static_cast<double>(surface.triangles.size());
}

}  // namespace

TriangleSurface remesh_between_edges(const TriangleSurface& surface, double edge_mm) {
  constexpr double kSharp = 30;
  return isotropic(surface, edge_mm, 3, 2, kSharp);
}

TriangleSurface remesh_evenly(const TriangleSurface& surface, std::size_t triangles, unsigned iterations) {
  const double goal = static_cast<double>(triangles);
  double edge = edge_for_count(area(surface), goal);
  // The search starts from about sixteen times as many triangles as wanted. With fewer, the input limits the result;
  // with more, the search takes longer.
  // Splitting many needles would give millions of triangles.
  const bool needles = mean_radius_ratio(surface) < 0.4;
  if (needles && goal * 4 < static_cast<double>(surface.triangles.size()))
    return remesh_evenly(simplify_by_curvature(surface, 4 * triangles), triangles, iterations);
  const TriangleSurface dense = needles ? isotropic(surface, edge / 2, 2, 0)
                                : goal * 16 < static_cast<double>(surface.triangles.size())
                                    ? isotropic(surface, edge / 4, 1, 0)
                                    : split(surface, edge / 3);
  TriangleSurface best;
  double best_miss = std::numeric_limits<double>::infinity();
  edge *= 1.06;  // remeshing makes about 12 % more triangles than equilateral ones of this edge
  for (int trial = 0; trial < 8 && best_miss > 0.005; ++trial) {
    TriangleSurface found = isotropic(dense, edge, iterations, 2);
    const double count = static_cast<double>(found.triangles.size());
    if (std::abs(count / goal - 1) < best_miss) {
      best_miss = std::abs(count / goal - 1);
      best = std::move(found);
    }
    edge *= std::sqrt(count / goal);
  }
  return best;
}

TriangleSurface simplify_by_curvature(const TriangleSurface& surface, std::size_t triangles) {
  namespace simplification = CGAL::Surface_mesh_simplification;
  // Collapses need a surface of several times the wanted number to choose from. Splitting keeps its shape.
  const bool too_few = surface.triangles.size() < 4 * triangles;
  const double edge = edge_for_count(area(surface), static_cast<double>(triangles));
  CgalMesh mesh = to_cgal(too_few ? split(surface, edge / 3) : surface);
  const std::size_t edges = triangles / 2 * 3 + 1;  // a closed surface has E = 3 F / 2
  // lower the bound when it refuses every collapse before the wanted number is reached
  for (double least_ratio = kLeastRatio; mesh.number_of_edges() >= edges; least_ratio /= 2) {
    if (least_ratio < 0.01) least_ratio = 0;
    const simplification::Bounded_normal_change_filter<ShapeFilter> filter{ShapeFilter(least_ratio)};
    simplification::edge_collapse(mesh, simplification::Count_stop_predicate<CgalMesh>(edges),
                                  CGAL::parameters::get_cost(simplification::LindstromTurk_cost<CgalMesh>())
                                      .get_placement(simplification::LindstromTurk_placement<CgalMesh>())
                                      .filter(filter));
    mesh.collect_garbage();
    if (least_ratio == 0) break;
  }
  TriangleSurface result = from_cgal(mesh);
  improve_triangles(result, surface, kGoodRatio, kImprovingPasses);
  return result;
}

double edge_for_count(double area_mm2, double count) {
  return std::sqrt(4 * area_mm2 / (std::sqrt(3.0) * count));
}

double triangles_for_edge(double area_mm2, double edge_mm) {
  return 4 * area_mm2 / (std::sqrt(3.0) * edge_mm * edge_mm);
}

}  // namespace palpate
