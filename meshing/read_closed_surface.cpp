#include "meshing/read_closed_surface.h"

#include <CGAL/IO/polygon_soup_io.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <fmt/format.h>

#include <filesystem>

#include "formats/errors.h"
#include "meshing/surface_mesh.h"

namespace palpate {

namespace PMP = CGAL::Polygon_mesh_processing;

void refuse_self_intersection(const TriangleSurface& surface, const std::string& name) {
  const CgalMesh mesh = to_cgal(surface);
  std::vector<std::pair<CgalMesh::Face_index, CgalMesh::Face_index>> pairs;
  PMP::self_intersections(mesh, std::back_inserter(pairs));
  if (pairs.empty()) return;
  const auto& p = mesh.point(mesh.source(mesh.halfedge(pairs.front().first)));
  throw InputError(
      fmt::format("{}: {} pairs of triangles cross or touch, the first near ({:.6g}, {:.6g}, {:.6g}); expected "
                  "surfaces that keep apart; repair it with palpate-surface",
                  name, pairs.size(), p.x(), p.y(), p.z()));
}

TriangleSurface read_closed_surface(const std::string& file) {
  std::vector<CgalKernel::Point_3> points;
  std::vector<std::vector<std::size_t>> polygons;
  if (!std::filesystem::is_regular_file(file)) throw InputError(fmt::format("{}: no such file", file));
  if (!CGAL::IO::read_polygon_soup(file, points, polygons) || polygons.empty())
    throw InputError(fmt::format("{}: not a readable surface; expected OFF, STL, OBJ or PLY", file));
  PMP::repair_polygon_soup(points, polygons);
  if (!PMP::orient_polygon_soup(points, polygons))
    throw InputError(fmt::format("{}: the surface is not a manifold; repair it with palpate-surface", file));
  CgalMesh mesh;
  PMP::polygon_soup_to_polygon_mesh(points, polygons, mesh);
  if (!CGAL::is_closed(mesh) || !CGAL::is_triangle_mesh(mesh))
    throw InputError(
        fmt::format("{}: the surface is open; expected a closed one; close it with palpate-surface", file));
  const TriangleSurface surface = from_cgal(mesh);
  refuse_self_intersection(surface, file);
  return surface;
}

}  // namespace palpate
