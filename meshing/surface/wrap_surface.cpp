#include "meshing/surface/wrap_surface.h"

#include <CGAL/alpha_wrap_3.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "formats/errors.h"
#include "meshing/surface/extract_surface.h"
#include "meshing/surface/surface_mesh.h"
#include "meshing/surface/triangle_soup.h"

namespace palpate {
namespace {

constexpr std::size_t kMostPoints = 400'000;
constexpr int kMostSeconds = 12;      // of processor time; palpate-surface takes at most 20 in all
constexpr double kMostArea = 50'000;  // of the triangles, over the square of the ball's radius

struct TooMuchWork {};

// Stops CGAL's loop, whose length grows with the inverse square of the ball's radius.
struct Limit : CGAL::Alpha_wraps_3::internal::Wrapping_default_visitor {
  std::size_t points = 0, gates = 0;
  std::clock_t begun = std::clock();
  template <class Wrapper, class Gate>
  void before_facet_treatment(const Wrapper&, const Gate&) {
    if (++gates % 256 == 0 && std::clock() - begun > kMostSeconds * CLOCKS_PER_SEC) throw TooMuchWork();
  }
  template <class Wrapper, class Vertex>
  void after_Steiner_point_insertion(const Wrapper&, const Vertex&) {
    if (++points > kMostPoints) throw TooMuchWork();
  }
};

TriangleSurface wrap_in_cgal(const TriangleSurface& soup, double ball_mm, double offset_mm) {
  std::vector<CgalKernel::Point_3> points;
  for (const auto& [x, y, z] : soup.points) points.emplace_back(x, y, z);
  CgalMesh mesh;
  CGAL::alpha_wrap_3(points, soup.triangles, ball_mm, offset_mm, mesh, CGAL::parameters::default_values(),
                     CGAL::parameters::visitor(Limit()));
  return from_cgal(mesh);
}

}  // namespace

WrappedSurface wrap_surface(TriangleSurface soup, const PieceFilter& filter, double ball_mm, double offset_share,
                            const std::string& name) {
  WrappedSurface result;
  const auto tell = [&](std::size_t count, const std::string& what) {
    if (count) result.changes.push_back(fmt::format("{} {}", count, what));
  };
  drop_isolated_points(soup);
  const double diagonal = bounding_box(soup).diagonal();
  if (!(diagonal > 0 && diagonal < 1e9))
    throw InputError(
        fmt::format("{}: expected an organ, found a box of {:.3g} mm; correct its points", name, diagonal));
  merge_near_points(soup, 1e-6 * diagonal);
  drop_collapsed_triangles(soup);
  tell(drop_repeated_triangles(soup), "repeated triangles dropped");
  tell(drop_fins(soup), "triangles of fins dropped");
  if (soup.triangles.empty()) throw InputError(fmt::format("{}: nothing is left of the surface: it is a point", name));
  drop_isolated_points(soup);
  result.input = soup;

  const Caps caps = cap_free_edges(soup);
  if (caps.loops)
    result.changes.push_back(
        fmt::format("{} open loops closed by caps, the widest {:.3g} mm across, near ({:.6g}, "
                    "{:.6g}, {:.6g}) mm",
                    caps.loops, caps.widest, caps.place[0], caps.place[1], caps.place[2]));
  TriangleSurface turned = soup;
  bool orientable = true;
  orient_patches(turned, &orientable);
  for (const TriangleSurface& shell : split_shells(turned)) result.input_mm3 += std::abs(enclosed_volume(shell));

  result.ball_mm = ball_mm > 0 ? ball_mm : diagonal / 60;
  result.offset_mm = offset_share * result.ball_mm;
  try {
    if (area(soup) > kMostArea * result.ball_mm * result.ball_mm) throw TooMuchWork();
    result.surface = wrap_in_cgal(soup, result.ball_mm, result.offset_mm);
  } catch (const TooMuchWork&) {
    throw InputError(
        fmt::format("{}: wrapping {:.3g} mm2 of triangles with a ball of {:.3g} mm takes more than {} s or {} points; "
                    "give a larger ball with --wrap-mm, such as {:.2g}, or fewer triangles",
                    name, area(soup), result.ball_mm, kMostSeconds, kMostPoints,
                    std::max(2 * result.ball_mm, 2 * std::sqrt(area(soup) / kMostArea))));
  }

  std::vector<TriangleSurface> shells = split_shells(result.surface), kept;
  std::vector<double> volumes;  // without the offset, to first order
  for (const TriangleSurface& shell : shells)
    volumes.push_back(std::max(0.0, enclosed_volume(shell) - result.offset_mm * area(shell)));
  const std::vector<bool> keep = kept_pieces(filter, volumes);
  double kept_mm3 = 0, dropped_mm3 = 0;
  for (std::size_t s = 0; s < shells.size(); ++s) {
    (keep[s] ? kept_mm3 : dropped_mm3) += volumes[s];
    if (keep[s]) kept.push_back(std::move(shells[s]));
  }
  tell(shells.size() - kept.size(),
       fmt::format("shells dropped, {:.4g} mm3 in all (--components all keeps them)", dropped_mm3));
  result.surface = join_shells(kept);
  if (std::abs(kept_mm3 / result.input_mm3 - 1) > 0.01)
    result.changes.push_back(
        fmt::format("the wrap holds {:.4g} mm3, the parts of the input sum to {:.4g} mm3: parts overlap, or "
                    "cavities and gaps were filled",
                    kept_mm3, result.input_mm3));
  // A sheet has both its sides on the wrap: the volume is the offset times the area, and nothing is left of it.
  if (!(kept_mm3 > 0.5 * result.offset_mm * area(result.surface)))
    throw InputError(
        fmt::format("{}: expected triangles around an organ, found sheets that enclose nothing (a ball of {:.3g} mm "
                    "enters between them); close the surface where it was made, or give a larger ball with --wrap-mm",
                    name, result.ball_mm));
  return result;
}

}  // namespace palpate
