#include "meshing/tetrahedra/tetrahedra_from_labels.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/exude_mesh_3.h>
#include <CGAL/perturb_mesh_3.h>
#include <CGAL/refine_mesh_3.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <unordered_map>

#include "formats/errors.h"
#include "meshing/tetrahedra/in_child_process.h"
#include "meshing/tetrahedra/mesh_bytes.h"

namespace palpate {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain, CGAL::Default, CGAL::Sequential_tag>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

namespace options = CGAL::parameters;

// Mesh_3's own coordinates: around zero, so that points far from the origin lose no digits.
Point centre_of(const VoxelGrid& grid) {
  return grid.point((grid.size[0] - 1) / 2.0, (grid.size[1] - 1) / 2.0, (grid.size[2] - 1) / 2.0);
}

double radius_of(const VoxelGrid& grid) {
  double radius = 0;
  const Point centre = centre_of(grid);
  for (int corner = 0; corner < 8; ++corner) {
    const Point p = grid.point((corner & 1) * (grid.size[0] - 1.0), (corner >> 1 & 1) * (grid.size[1] - 1.0),
                               (corner >> 2 & 1) * (grid.size[2] - 1.0)) -
                    centre;
    radius = std::max(radius, std::sqrt(dot(p, p)));
  }
  return radius;
}

// Crossings about an edge apart all over the piece; a small one gets at least a few, so that it cannot be missed.
std::vector<std::array<Point, 2>> spread_out(const TissuePiece& piece, double edge) {
  constexpr std::size_t kFewest = 6, kMost = 40;
  std::vector<std::array<Point, 2>> chosen;
  std::vector<double> nearest(piece.crossings.size(), std::numeric_limits<double>::max());
  std::size_t next = 0;
  while (chosen.size() < std::min(kMost, piece.crossings.size())) {  // farthest point first
    chosen.push_back(piece.crossings[next]);
    for (std::size_t c = 0; c < nearest.size(); ++c) {
      const Point away = piece.crossings[c][0] - chosen.back()[0];
      nearest[c] = std::min(nearest[c], dot(away, away));
    }
    next = std::max_element(nearest.begin(), nearest.end()) - nearest.begin();
    if (chosen.size() >= kFewest && nearest[next] < edge * edge) break;
    if (nearest[next] == 0) break;
  }
  return chosen;
}

void insert_seeds(Complex& complex, const Domain& domain, const std::vector<TissuePiece>& pieces, const Point& centre,
                  double edge) {
  const auto intersect = domain.construct_intersection_object();
  Triangulation& triangulation = complex.triangulation();
  for (const TissuePiece& piece : pieces)
    for (const auto& [inside, outside] : spread_out(piece, edge)) {
      const Point a = inside - centre, b = outside - centre;
      const auto hit = intersect(Kernel::Segment_3({a[0], a[1], a[2]}, {b[0], b[1], b[2]}));
      if (std::get<2>(hit) == 0) continue;
      const auto vertex = triangulation.insert(Triangulation::Weighted_point(std::get<0>(hit)));
      if (vertex == Triangulation::Vertex_handle()) continue;
      complex.set_dimension(vertex, 2);
      complex.set_index(vertex, std::get<1>(hit));
    }
}

TetrahedralMesh collect(const Complex& complex, const Point& centre) {
  TetrahedralMesh mesh;
  std::unordered_map<const void*, std::int32_t> number;
  for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell) {
    std::array<std::int32_t, 4> t{};
    for (int i = 0; i < 4; ++i) {
      const auto vertex = cell->vertex(i);
      const auto [found, fresh] = number.emplace(&*vertex, static_cast<std::int32_t>(mesh.nodes.size()));
      if (fresh) mesh.nodes.push_back(centre + Point{vertex->point().x(), vertex->point().y(), vertex->point().z()});
      t[i] = found->second;
    }
    mesh.tetrahedra.push_back(t);
    mesh.region.push_back(complex.subdomain_index(cell) - 1);
  }
  return mesh;
}

std::string mesh_in_cgal(const TissueMap& map, const std::vector<TissuePiece>& pieces, const LabelMeshOptions& o) {
  const Point centre = centre_of(map.grid());
  const double radius = radius_of(map.grid());
  const auto tissue_at = [&](const Kernel::Point_3& p) { return map.at(centre + Point{p.x(), p.y(), p.z()}); };
  // The border is found to a hundredth of the distance that triangles may keep from it.
  const Domain domain(options::function = tissue_at,
                      options::bounding_object = Kernel::Sphere_3(CGAL::ORIGIN, 1.01 * radius * radius),
                      options::relative_error_bound = std::min(1e-3, 0.01 * o.facet_distance / radius));
  const Criteria criteria(options::facet_angle = 30, options::facet_size = o.edge,
                          options::facet_distance = o.facet_distance,
                          options::cell_radius_edge_ratio = o.interior > 0 ? 2 : 0, options::cell_size = o.interior);
  Complex complex;
  insert_seeds(complex, domain, pieces, centre, o.edge);
  CGAL::refine_mesh_3(complex, domain, criteria, options::no_perturb(), options::no_exude());
  if (o.interior > 0) {
    CGAL::perturb_mesh_3(complex, domain, options::sliver_bound = 15);
    CGAL::exude_mesh_3(complex, options::sliver_bound = 15);
  }
  return to_bytes(collect(complex, centre));
}

struct Face {
  Triangle key;  // sorted
  Triangle outward;
  std::int32_t region;
};

std::vector<Face> faces_of(const TetrahedralMesh& mesh) {
  constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  std::vector<Face> faces;
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e)
    for (const auto& f : kFaces) {
      const auto& t = mesh.tetrahedra[e];
      const Triangle outward = {t[f[0]], t[f[1]], t[f[2]]};
      Triangle key = outward;
      std::sort(key.begin(), key.end());
      faces.push_back({key, outward, mesh.region[e]});
    }
  std::stable_sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.key < b.key; });
  return faces;
}

// Of the triangles around empty space, connected shells that enclose a negative volume are cavities.
void find_cavities(VolumeBoundary& boundary) {
  TriangleSurface skin{boundary.points, {}};
  for (const auto& patch : boundary.patches)
    if (patch.ahead < 0) skin.triangles.insert(skin.triangles.end(), patch.triangles.begin(), patch.triangles.end());
  std::int32_t shells = 0;
  const auto shell_of = shell_of_triangle(skin, &shells);
  std::vector<double> volume(shells, 0.0);
  const Point origin = boundary.points.front();
  for (std::size_t t = 0; t < shell_of.size(); ++t) {
    const auto& [a, b, c] = skin.triangles[t];
    volume[shell_of[t]] += dot(skin.points[a] - origin, cross(skin.points[b] - origin, skin.points[c] - origin));
  }
  std::size_t next = 0;
  std::vector<VolumeBoundary::Patch> cavities;
  for (auto& patch : boundary.patches) {
    if (patch.ahead >= 0) continue;
    VolumeBoundary::Patch outside{patch.behind, VolumeBoundary::kOutside, {}},
        cavity{patch.behind, VolumeBoundary::kCavity, {}};
    for (const Triangle& t : patch.triangles) (volume[shell_of[next++]] < 0 ? cavity : outside).triangles.push_back(t);
    patch = outside;
    if (!cavity.triangles.empty()) cavities.push_back(cavity);
  }
  boundary.patches.insert(boundary.patches.end(), cavities.begin(), cavities.end());
  std::erase_if(boundary.patches, [](const auto& patch) { return patch.triangles.empty(); });
}

}  // namespace

VolumeBoundary boundary_of(const TetrahedralMesh& mesh) {
  VolumeBoundary boundary;
  boundary.region_names = mesh.region_names;
  std::map<std::pair<std::int32_t, std::int32_t>, std::vector<Triangle>> triangles;  // by behind, ahead
  const std::vector<Face> faces = faces_of(mesh);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const bool paired = f + 1 < faces.size() && faces[f + 1].key == faces[f].key;
    const Face& mine = faces[f];
    if (!paired) {
      triangles[{mine.region, VolumeBoundary::kOutside}].push_back(mine.outward);
      continue;
    }
    const Face& other = faces[++f];
    if (mine.region < other.region) triangles[{mine.region, other.region}].push_back(mine.outward);
    if (other.region < mine.region) triangles[{other.region, mine.region}].push_back(other.outward);
  }
  boundary.points = mesh.nodes;
  for (const auto& [sides, of_patch] : triangles) boundary.patches.push_back({sides.first, sides.second, of_patch});
  find_cavities(boundary);
  return boundary;
}

VolumeBoundary without_unused_points(const VolumeBoundary& boundary) {
  VolumeBoundary compact = boundary;
  compact.points.clear();
  std::vector<std::int32_t> number(boundary.points.size(), -1);
  for (auto& patch : compact.patches)
    for (Triangle& t : patch.triangles)
      for (std::int32_t& v : t) {
        if (number[v] < 0) {
          number[v] = static_cast<std::int32_t>(compact.points.size());
          compact.points.push_back(boundary.points[v]);
        }
        v = number[v];
      }
  return compact;
}

NonManifoldEdges non_manifold_edges(const VolumeBoundary& boundary) {
  std::map<std::pair<std::int32_t, std::int32_t>, int> triangles_at;
  for (const auto& patch : boundary.patches)
    if (patch.ahead < 0)
      for (const Triangle& t : patch.triangles)
        for (int i = 0; i < 3; ++i) ++triangles_at[std::minmax(t[i], t[(i + 1) % 3])];
  NonManifoldEdges edges;
  for (const auto& [edge, count] : triangles_at)
    if (count != 2 && edges.count++ == 0)
      edges.place = 0.5 * (boundary.points[edge.first] + boundary.points[edge.second]);
  return edges;
}

TetrahedralMesh mesh_tissues(const TissueMap& map, const std::vector<Tissue>& tissues,
                             const std::vector<TissuePiece>& pieces, const LabelMeshOptions& o) {
  TetrahedralMesh mesh =
      from_bytes(run_in_child("CGAL Mesh_3", o.time_limit, [&] { return mesh_in_cgal(map, pieces, o); }));
  std::vector<std::size_t> elements(tissues.size(), 0);
  for (const std::int32_t region : mesh.region) ++elements[region];
  for (std::size_t t = 0; t < tissues.size(); ++t) {
    mesh.region_names.push_back(tissues[t].name);
    if (elements[t] == 0)
      throw InputError(
          fmt::format("tissue \"{}\" (label {}) is too small or thin for triangles of {:g} mm and vanished; make "
                      "them smaller with --edge-mm or leave the label out",
                      tissues[t].name, tissues[t].label, o.edge));
  }
  return mesh;
}

}  // namespace palpate
