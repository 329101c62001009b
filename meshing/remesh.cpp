#include "meshing/remesh.h"

#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <cmath>
#include <limits>

#include "meshing/surface_mesh.h"

namespace palpate {

namespace {

TriangleSurface isotropic(const TriangleSurface& surface, double edge_mm, unsigned iterations,
                          unsigned relaxation_steps) {
  CgalMesh mesh = to_cgal(surface);
  CGAL::Polygon_mesh_processing::isotropic_remeshing(mesh.faces(), edge_mm, mesh,
                                                     CGAL::parameters::number_of_iterations(iterations)
                                                         .number_of_relaxation_steps(relaxation_steps)
                                                         .do_project(relaxation_steps > 0));
  return from_cgal(mesh);
}

// Long edges halved: the same shape in more triangles.
TriangleSurface split(const TriangleSurface& surface, double edge_mm) {
  CgalMesh mesh = to_cgal(surface);
  CGAL::Polygon_mesh_processing::split_long_edges(mesh.edges(), edge_mm, mesh);
  return from_cgal(mesh);
}

}  // namespace

TriangleSurface remesh_evenly(const TriangleSurface& surface, std::size_t triangles, unsigned iterations) {
  const double goal = static_cast<double>(triangles);
  double edge = edge_for_count(area(surface), goal);
  // the search works on about sixteen times as many triangles: fewer would decide the count, more would cost time
  const TriangleSurface dense = goal * 16 < static_cast<double>(surface.triangles.size())
                                    ? isotropic(surface, edge / 4, 1, 0)
                                    : split(surface, edge / 3);
  TriangleSurface best;
  double best_miss = std::numeric_limits<double>::infinity();
  edge *= 1.06;  // remeshing leaves about 12 % more triangles than equilateral ones would be
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
  CgalMesh mesh = to_cgal(surface);
  // closed: E = 3 F / 2
  simplification::edge_collapse(mesh, simplification::Count_stop_predicate<CgalMesh>(triangles / 2 * 3 + 1),
                                CGAL::parameters::get_cost(simplification::LindstromTurk_cost<CgalMesh>())
                                    .get_placement(simplification::LindstromTurk_placement<CgalMesh>())
                                    .filter(simplification::Bounded_normal_change_filter<>()));
  return from_cgal(mesh);
}

double edge_for_count(double area_mm2, double count) {
  return std::sqrt(4 * area_mm2 / (std::sqrt(3.0) * count));
}

}  // namespace palpate
