#include "meshing/surface/repair_surface.h"

#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/errors.h"
#include "meshing/surface/extract_surface.h"
#include "meshing/surface/surface_checks.h"
#include "meshing/surface/surface_mesh.h"
#include "meshing/surface/triangle_soup.h"

namespace palpate {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;

constexpr double kLargest = 1e9;  // mm; the squares of much larger lengths overflow

std::string at(const Point& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g}) mm", p[0], p[1], p[2]);
}

// Adds a sentence if the count is above 0.
class Repairs {
 public:
  explicit Repairs(std::vector<std::string>& sentences) : sentences_(sentences) {}
  void add(std::size_t count, const std::string& what) {
    if (count) sentences_.push_back(fmt::format("{} {}", count, what));
  }

 private:
  std::vector<std::string>& sentences_;
};

void refuse_open(const TriangleSurface& soup, const std::string& name) {
  const EdgeCensus census = count_edges(soup);
  if (census.free) {
    throw InputError(
        fmt::format("{}: expected a closed surface, found {} open loop{} with {} free edges, the first near {}; "
                    "palpate-surface --wrap closes them",
                    name, census.loops, census.loops == 1 ? "" : "s", census.free, at(census.free_place)));
  }
}

// Splits points where the surface touches itself, because CGAL's mesh cannot hold them. Then collapses flat
// triangles.
TriangleSurface to_manifold(const TriangleSurface& soup, const std::string& name, Repairs& repairs) {
  std::vector<CgalKernel::Point_3> points;
  for (const auto& [x, y, z] : soup.points) points.emplace_back(x, y, z);
  std::vector<std::vector<std::size_t>> triangles;
  for (const auto& [a, b, c] : soup.triangles) {
    triangles.push_back({static_cast<std::size_t>(a), static_cast<std::size_t>(b), static_cast<std::size_t>(c)});
  }
  pmp::orient_polygon_soup(points, triangles);
  CgalMesh mesh;
  pmp::polygon_soup_to_polygon_mesh(points, triangles, mesh);
  const std::size_t before = mesh.number_of_faces();
  const bool all_removed = pmp::remove_degenerate_faces(mesh);
  repairs.add(before - std::min<std::size_t>(before, mesh.number_of_faces()), "flat triangles collapsed");
  if (!all_removed || !CGAL::is_closed(mesh)) {
    throw InputError(
        fmt::format("{}: expected a closed manifold, found triangles that cannot be joined to one; "
                    "palpate-surface --wrap makes one of them",
                    name));
  }
  return from_cgal(mesh);
}

// Returns for each shell how many other shells enclose it.
std::vector<int> nesting_depths(const std::vector<TriangleSurface>& shells) {
  std::vector<int> depth(shells.size());
  for (std::size_t outer = 0; outer < shells.size(); ++outer) {
    const Box box = bounding_box(shells[outer]);
    std::vector<std::size_t> candidates;
    for (std::size_t s = 0; s < shells.size(); ++s) {
      const Point& p = shells[s].points.front();
      const bool within = s != outer && p[0] > box.low[0] && p[1] > box.low[1] && p[2] > box.low[2] &&
                          p[0] < box.high[0] && p[1] < box.high[1] && p[2] < box.high[2];
      if (within) candidates.push_back(s);
    }
    if (candidates.empty()) continue;
    const CgalMesh mesh = to_cgal(shells[outer]);
    const CGAL::Side_of_triangle_mesh<CgalMesh, CgalKernel> side(mesh);
    for (const std::size_t s : candidates) {
      const auto& [x, y, z] = shells[s].points.front();
      depth[s] += side({x, y, z}) == CGAL::ON_BOUNDED_SIDE;
    }
  }
  return depth;
}

void turn_inside_out(TriangleSurface& shell) {
  for (Triangle& t : shell.triangles) std::swap(t[1], t[2]);
}

// Turns outer shells outward and inner shells inward, as cavities, where the input makes clear that they are
// cavities.
std::vector<TriangleSurface> orient_shells(std::vector<TriangleSurface> shells, bool turned_triangles,
                                           const std::string& cavities, const std::string& name, Repairs& repairs,
                                           std::vector<std::string>& sentences) {
  const std::vector<int> depth = nesting_depths(shells);
  std::size_t nested = 0, agreeing = 0, reversed = 0;
  std::size_t example = shells.size();
  for (std::size_t s = 0; s < shells.size(); ++s) {
    const bool outward = enclosed_volume(shells[s]) > 0;
    nested += depth[s] > 0;
    if (depth[s] > 0 && example == shells.size()) example = s;
    agreeing += outward == (depth[s] % 2 == 0);
    reversed += outward != (depth[s] % 2 == 0);
  }
  // The orientation is clear if all shells point as solids and cavities alternate, or if all shells point the
  // opposite way.
  const bool clear = !turned_triangles && (reversed == 0 || agreeing == 0);
  if (nested && !clear && cavities.empty()) {
    throw InputError(fmt::format(
        "{}: {} shell{} inside another {} oriented so that it may be a cavity or a part of its own, the "
        "first near {}; say --cavities keep or --cavities fill, or give each part its own file",
        name, nested, nested == 1 ? "" : "s", nested == 1 ? "is" : "are", at(bounding_box(shells[example]).centre())));
  }
  std::size_t turned = 0, filled = 0;
  double filled_mm3 = 0;
  std::vector<TriangleSurface> kept;
  for (std::size_t s = 0; s < shells.size(); ++s) {
    const double volume = enclosed_volume(shells[s]);
    if (cavities == "fill" && depth[s] > 0) {
      ++filled;
      if (depth[s] == 1) filled_mm3 += std::abs(volume);
      continue;
    }
    if ((volume > 0) != (depth[s] % 2 == 0)) {
      turn_inside_out(shells[s]);
      ++turned;
    }
    kept.push_back(std::move(shells[s]));
  }
  repairs.add(turned, "shells turned, which were inside out");
  if (filled)
    sentences.push_back(fmt::format("{} inner shells filled, {:.4g} mm3 in all (--cavities fill)", filled, filled_mm3));
  return kept;
}

}  // namespace

RepairedSurface repair_surface(TriangleSurface soup, const PieceFilter& filter, const std::string& cavities,
                               const std::string& name) {
  RepairedSurface result;
  Repairs repairs(result.repairs);
  repairs.add(drop_isolated_points(soup), "isolated points dropped");
  const double diagonal = bounding_box(soup).diagonal();
  if (!(diagonal < kLargest))
    throw InputError(
        fmt::format("{}: expected an organ, found a box of {:.3g} mm; correct its points", name, diagonal));
  const double tolerance = 1e-6 * diagonal;
  repairs.add(merge_near_points(soup, tolerance),
              fmt::format("repeated points merged (nearer than {:.2g} mm)", tolerance));
  repairs.add(drop_collapsed_triangles(soup), "triangles of fewer than three points dropped");
  repairs.add(drop_repeated_triangles(soup), "repeated triangles dropped");
  if (soup.triangles.empty()) throw InputError(fmt::format("{}: nothing is left of the surface: it is a point", name));
  repairs.add(drop_fins(soup), "triangles of fins dropped");
  drop_isolated_points(soup);
  refuse_open(soup, name);

  bool orientable = true;
  const std::size_t turned = orient_patches(soup, &orientable);
  if (!orientable) throw InputError(fmt::format("{}: expected a surface with two sides, found a one-sided one", name));
  repairs.add(turned, "triangles turned, which pointed the other way than their neighbours");
  const EdgeCensus census = count_edges(soup);
  const TriangleSurface manifold = [&] {
    try {
      return to_manifold(soup, name, repairs);
    } catch (const InputError&) {
      if (census.crowded == 0) throw;
      throw InputError(fmt::format(
          "{}: {} edges belong to more than two triangles, the first near {}: walls inside or parts that "
          "touch; palpate-surface --wrap unites them; for regions of their own, give each closed part its own file",
          name, census.crowded, at(census.crowded_place)));
    }
  }();

  // drop the shells that the filter refuses
  std::vector<TriangleSurface> shells = split_shells(manifold);
  std::vector<double> volumes;
  for (const TriangleSurface& shell : shells) volumes.push_back(std::abs(enclosed_volume(shell)));
  const std::vector<bool> keep = kept_pieces(filter, volumes);
  std::vector<TriangleSurface> kept;
  for (std::size_t s = 0; s < shells.size(); ++s) {
    if (keep[s])
      kept.push_back(std::move(shells[s]));
    else
      result.dropped_mm3 += volumes[s];
  }
  result.dropped = shells.size() - kept.size();
  repairs.add(result.dropped,
              fmt::format("shells dropped, {:.4g} mm3 in all (--components all keeps them)", result.dropped_mm3));
  if (kept.empty()) throw InputError(fmt::format("{}: --components keeps nothing", name));

  const SelfIntersections crossings = find_self_intersections(join_shells(kept));
  if (crossings.pairs) {
    throw InputError(
        fmt::format("{}: {}{} pairs of triangles intersect, the first near {}; palpate-surface --wrap unites what they "
                    "enclose",
                    name, crossings.pairs < kMostCrossings ? "" : "at least ", crossings.pairs, at(crossings.place)));
  }
  kept = orient_shells(std::move(kept), turned > 0, cavities, name, repairs, result.repairs);
  result.surface = join_shells(kept);
  const std::string defect = first_defect(result.surface);
  if (!defect.empty()) throw InputError(fmt::format("{}: the surface cannot be used: {}", name, defect));
  return result;
}

}  // namespace palpate
