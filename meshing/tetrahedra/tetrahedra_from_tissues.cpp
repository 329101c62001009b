#include "meshing/tetrahedra/tetrahedra_from_tissues.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/refine_mesh_3.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

// Mesh_3 works in coordinates around this centre, so that an image far from the origin loses no digits.
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

// The length wanted at a place of the border between two tissues, or inside of one: the smaller of theirs.
struct LengthOfTissue {
  using FT = double;
  using Point_3 = Kernel::Point_3;
  using Index = Domain::Index;

  double operator()(const Point_3&, int, const Index& index) const {
    if (const auto* inside = boost::get<Domain::Subdomain_index>(&index)) return of(*inside);
    const auto& sides = boost::get<Domain::Surface_patch_index>(index);
    return std::min(of(sides.first), of(sides.second));
  }
  double of(int tissue) const {
    return tissue == 0 ? *std::max_element(lengths.begin(), lengths.end()) : lengths[tissue - 1];
  }

  std::vector<double> lengths;  // [tissues]
};

Criteria criteria_of(const LabelMeshOptions& o) {
  const LengthOfTissue edges{o.edges}, distances{o.facet_distances};
  return Criteria(options::facet_angle = 30, options::facet_size = edges, options::facet_distance = distances);
}

// Chooses crossings about an edge apart all over the piece as first points of Mesh_3. A small piece gets a few in any
// case, because Mesh_3 would miss a piece without a first point.
std::vector<std::array<Point, 2>> spread_out(const TissuePiece& piece, double edge) {
  constexpr std::size_t kFewest = 6, kMost = 40;
  std::vector<std::array<Point, 2>> chosen;
  std::vector<double> nearest(piece.crossings.size(), std::numeric_limits<double>::max());
  std::size_t next = 0;
  while (chosen.size() < std::min(kMost, piece.crossings.size())) {  // take the crossing farthest from those chosen
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
                  const LengthOfTissue& edges) {
  const auto intersect = domain.construct_intersection_object();
  Triangulation& triangulation = complex.triangulation();
  for (const TissuePiece& piece : pieces)
    for (const auto& [inside, outside] : spread_out(piece, edges.of(piece.tissue))) {
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
  const double least = *std::min_element(o.facet_distances.begin(), o.facet_distances.end());
  const auto tissue_at = [&](const Kernel::Point_3& p) { return map.at(centre + Point{p.x(), p.y(), p.z()}); };
  // Mesh_3 finds the border to a hundredth of the least distance that triangles may have from it.
  const Domain domain(options::function = tissue_at,
                      options::bounding_object = Kernel::Sphere_3(CGAL::ORIGIN, 1.01 * radius * radius),
                      options::relative_error_bound = std::min(1e-3, 0.01 * least / radius));
  Complex complex;
  insert_seeds(complex, domain, pieces, centre, LengthOfTissue{o.edges});
  CGAL::refine_mesh_3(complex, domain, criteria_of(o), options::no_perturb(), options::no_exude());
  return to_bytes(collect(complex, centre));
}

}  // namespace

TetrahedralMesh tetrahedra_from_tissues(const TissueMap& map, const std::vector<Tissue>& tissues,
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
                      tissues[t].name, tissues[t].label, o.edges[t]));
  }
  return mesh;
}

}  // namespace palpate
