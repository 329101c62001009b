#include "meshing/surface/surface_checks.h"

#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/repair_self_intersections.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <fmt/format.h>

#include <boost/iterator/function_output_iterator.hpp>
#include <utility>

#include "meshing/surface/surface_mesh.h"

namespace palpate {

SelfIntersections find_self_intersections(const TriangleSurface& surface) {
  const CgalMesh mesh = to_cgal(surface);
  using Face = CgalMesh::Face_index;
  SelfIntersections found;
  Face first;
  struct Enough {};
  const auto count = [&](const std::pair<Face, Face>& pair) {
    if (found.pairs++ == 0) first = pair.first;
    if (found.pairs == kMostCrossings) throw Enough();
  };
  try {
    CGAL::Polygon_mesh_processing::self_intersections(mesh, boost::make_function_output_iterator(count));
  } catch (const Enough&) {
  }
  if (found.pairs) {
    const auto& [a, b, c] = surface.triangles[first];
    found.place = (1.0 / 3) * (surface.points[a] + surface.points[b] + surface.points[c]);
  }
  return found;
}

bool remove_self_intersections(TriangleSurface& surface) {
  constexpr std::size_t kMostRepaired = 500;
  if (find_self_intersections(surface).pairs > kMostRepaired) return false;
  CgalMesh mesh = to_cgal(surface);
  if (!CGAL::Polygon_mesh_processing::experimental::remove_self_intersections(mesh)) return false;
  if (!CGAL::is_closed(mesh) || !CGAL::is_triangle_mesh(mesh)) return false;
  surface = from_cgal(mesh);
  return true;
}

std::string first_defect(const TriangleSurface& surface) {
  if (surface.triangles.empty()) return "it has no triangles";
  const CgalMesh mesh = to_cgal(surface);
  if (!CGAL::is_closed(mesh)) return "it is open";
  const SelfIntersections crossings = find_self_intersections(surface);
  if (crossings.pairs) {
    return fmt::format("{}{} pairs of its triangles intersect, the first near ({:.6g}, {:.6g}, {:.6g}) mm",
                       crossings.pairs < kMostCrossings ? "" : "at least ", crossings.pairs, crossings.place[0],
                       crossings.place[1], crossings.place[2]);
  }
  if (!CGAL::Polygon_mesh_processing::does_bound_a_volume(mesh))
    return "its shells are not oriented to enclose a volume";
  if (!CGAL::Polygon_mesh_processing::is_outward_oriented(mesh)) return "it is inside out";
  return "";
}

}  // namespace palpate
