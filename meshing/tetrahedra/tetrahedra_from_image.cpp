#include "meshing/tetrahedra/tetrahedra_from_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <set>

#include "formats/errors.h"
#include "formats/program.h"
#include "meshing/image/label_image.h"
#include "meshing/image/voxel_mask.h"
#include "meshing/surface/isosurface.h"
#include "meshing/surface/surface_report.h"
#include "meshing/tetrahedra/boundary_of_mesh.h"
#include "meshing/tetrahedra/move_to_volumes.h"
#include "meshing/tetrahedra/tetrahedra_from_tissues.h"

namespace palpate {
namespace {

void drop_small_pieces(VoxelMask& mask, const Tissue& tissue, const LabelImageOptions& o,
                       const std::string& image_name) {
  const PieceChanges changes =
      filter_pieces(mask, parse_piece_filter(o.components), /*fill_cavities=*/false, image_name);
  if (changes.dropped > 0)
    warn(fmt::format("{}: dropped {} of {} pieces, {:.4g} mm3 in all (--components {}; all keeps them)", tissue.name,
                     changes.dropped, changes.pieces, changes.dropped_mm3, o.components));
}

// Fills the holes that the tissues enclose. Each layer of voxels goes to the tissue next to it, until no hole is
// left.
void fill_cavities(std::vector<VoxelMask>& masks, const std::string& image_name) {
  VoxelMask all = masks.front();
  for (const VoxelMask& mask : masks)
    for (std::size_t v = 0; v < all.inside.size(); ++v) all.inside[v] |= mask.inside[v];
  const std::vector<std::uint8_t> before = all.inside;
  const PieceChanges changes = filter_pieces(all, parse_piece_filter("all"), /*fill_cavities=*/true, image_name);
  if (changes.filled == 0) return;
  constexpr double kFew = 1e-3;  // of the volume
  const double volume = static_cast<double>(std::count(before.begin(), before.end(), 1)) * all.grid.voxel_volume();
  (changes.filled_mm3 > kFew * volume ? warn : note)(fmt::format(
      "filled {} cavities, {:.4g} mm3 in all (--cavities keep keeps them)", changes.filled, changes.filled_mm3));
  std::vector<std::size_t> left;
  for (std::size_t v = 0; v < before.size(); ++v)
    if (all.inside[v] && !before[v]) left.push_back(v);
  const auto row = static_cast<std::ptrdiff_t>(all.grid.size[0]), slice = row * all.grid.size[1];
  while (!left.empty()) {
    std::vector<std::pair<std::size_t, std::size_t>> given;  // voxel, tissue
    for (const std::size_t v : left)
      for (std::size_t t = 0; t < masks.size(); ++t) {
        bool beside = false;
        for (const std::ptrdiff_t step : {std::ptrdiff_t{1}, row, slice})
          beside |= masks[t].inside[v + step] ||
                    masks[t].inside[v - step];  // the padding keeps v + step and v - step inside the grid
        if (!beside) continue;
        given.emplace_back(v, t);
        break;
      }
    if (given.empty()) break;
    for (const auto& [v, t] : given) masks[t].inside[v] = 1;
    std::erase_if(left, [&](std::size_t v) {
      return std::any_of(masks.begin(), masks.end(), [&](const VoxelMask& mask) { return mask.inside[v]; });
    });
  }
}

double twelfth_of_size(const std::vector<double>& volumes) {
  return std::cbrt(std::accumulate(volumes.begin(), volumes.end(), 0.0)) / 12;
}

// A tissue smaller than four edges gets shorter ones, so that its triangles show its shape; none shorter than a voxel.
LabelMeshOptions mesh_sizes(const LabelImageOptions& o, const FillOptions& fill, const std::vector<double>& volumes,
                            double voxel_mm) {
  constexpr double kEdgesAcross = 4, kEdgesOverDistance = 8;
  LabelMeshOptions sizes;
  sizes.time_limit = fill.time_limit;
  const double edge = o.edge_mm > 0 ? o.edge_mm : twelfth_of_size(volumes);
  for (std::size_t t = 0; t < volumes.size(); ++t) {
    sizes.edges.push_back(std::min(edge, std::max(voxel_mm, std::cbrt(volumes[t]) / kEdgesAcross)));
    sizes.facet_distances.push_back(o.facet_distance > 0 ? o.facet_distance : sizes.edges[t] / kEdgesOverDistance);
  }
  return sizes;
}

void shorten(LabelMeshOptions& sizes, std::size_t tissue, double factor) {
  sizes.edges[tissue] *= factor, sizes.facet_distances[tissue] *= factor;
}

void shorten_all(LabelMeshOptions& sizes, double factor) {
  for (std::size_t t = 0; t < sizes.edges.size(); ++t) shorten(sizes, t, factor);
}

double longest_edge(const LabelMeshOptions& sizes) {
  return *std::max_element(sizes.edges.begin(), sizes.edges.end());
}

// The map and its pieces.
struct SmoothTissues {
  TissueMap map;
  std::vector<TissuePiece> pieces;
  std::vector<double> volumes;  // [tissues] mm^3
};

SmoothTissues smooth_tissues(const std::vector<VoxelMask>& masks, double smooth, const std::string& image_name) {
  SmoothTissues result{TissueMap(masks, smooth), {}, std::vector<double>(masks.size(), 0.0)};
  result.pieces = pieces_of(result.map, image_name);
  for (const TissuePiece& piece : result.pieces)
    if (piece.tissue > 0)
      result.volumes[piece.tissue - 1] += static_cast<double>(piece.voxels) * masks.front().grid.voxel_volume();
  return result;
}

// Smoothing shrinks thin and small tissues. Unless the user chose its width, it is made smaller until no tissue loses more
// than a twentieth, or the width hides no voxel's steps any more.
SmoothTissues smooth_as_tissues_allow(const std::vector<VoxelMask>& masks, const std::vector<double>& voxels_mm3,
                                      const LabelImageOptions& o, double voxel_mm, const std::string& image_name) {
  constexpr double kMostLost = 0.05, kLeastVoxels = 0.4;
  double smooth = o.smooth_mm.value_or(1.5 * voxel_mm);
  for (;;) {
    SmoothTissues result = smooth_tissues(masks, smooth, image_name);
    std::size_t worst = 0;
    for (std::size_t t = 1; t < masks.size(); ++t)
      if (result.volumes[t] / voxels_mm3[t] < result.volumes[worst] / voxels_mm3[worst]) worst = t;
    const double lost = 1 - result.volumes[worst] / voxels_mm3[worst], next = 0.6 * smooth;
    if (o.smooth_mm || lost <= kMostLost || next < kLeastVoxels * voxel_mm) return result;
    note(fmt::format("smoothing by {:.3g} mm takes {:.1f} % of \"{}\"; trying {:.3g} mm", smooth, 100 * lost,
                     o.tissues[worst].name, next));
    smooth = next;
  }
}

// A place where tissues nearly touch, and how wide the gap is filled there: as wide as the shortest edge of these tissues.
struct Gap {
  Point place;
  double width;  // mm
};

// At the triangles of cavities. The image has none, or they are filled: such a cavity is a gap between tissues, too narrow for the
// triangles.
std::vector<Gap> gaps_at_cavities(const VolumeBoundary& boundary, const LabelMeshOptions& sizes) {
  std::vector<Gap> gaps;
  for (const auto& patch : boundary.patches)
    if (patch.ahead == VolumeBoundary::kCavity)
      for (const auto& [a, b, c] : patch.triangles)
        gaps.push_back(
            {(1.0 / 3) * (boundary.points[a] + boundary.points[b] + boundary.points[c]), sizes.edges[patch.behind]});
  return gaps;
}

std::vector<Gap> gaps_at_edges(const VolumeBoundary& boundary, const LabelMeshOptions& sizes) {
  const NonManifoldEdges edges = non_manifold_edges(boundary);
  std::vector<Gap> gaps;
  for (std::size_t e = 0; e < edges.places.size(); ++e) {
    double width = longest_edge(sizes);
    for (const std::int32_t region : edges.regions[e]) width = std::min(width, sizes.edges[region]);
    gaps.push_back({edges.places[e], width});
  }
  return gaps;
}

// Mesh_3 gives each tissue a good surface, but where two parts nearly touch, the outer surface of all tissues may not be
// a manifold. A smaller edge moves every vertex. Where that does not help, the gap there is filled, and so is a gap that became a
// cavity; one that is still there after three attempts stays.
VolumeBoundary manifold_surfaces(TissueMap& map, const std::vector<Tissue>& tissues,
                                 const std::vector<TissuePiece>& pieces, bool keep_cavities,
                                 LabelMeshOptions& options) {
  constexpr int kPlain = 2, kForCavities = 3, kAttempts = 8;
  const double edge = longest_edge(options);
  std::vector<Gap> bad;
  for (int attempt = 1; attempt <= kAttempts; ++attempt) {
    VolumeBoundary result = boundary_of(tetrahedra_from_tissues(map, tissues, pieces, options));
    bad = gaps_at_edges(result, options);
    const std::vector<Gap> cavities = keep_cavities ? std::vector<Gap>{} : gaps_at_cavities(result, options);
    if (bad.empty() && (cavities.empty() || attempt > kForCavities)) return result;
    const Point& first = bad.empty() ? cavities[0].place : bad[0].place;
    std::string change;
    if (attempt >= kPlain || bad.empty()) {
      std::vector<Gap> gaps = bad;
      gaps.insert(gaps.end(), cavities.begin(), cavities.end());
      double widest = 0;
      for (const Gap& gap : gaps) {
        map.fill_gap(gap.place, gap.width / 2);
        widest = std::max(widest, gap.width);
      }
      change = fmt::format("filling the gaps there, up to {:.3g} mm around, and ", widest);
    }
    shorten_all(options, 0.96);
    note(fmt::format("{} on the outer surface, the first at ({:.5g}, {:.5g}, {:.5g}) mm; {}trying edges of {:.4g} mm",
                     bad.empty() ? "a gap that became a cavity" : fmt::format("{} non-manifold edges", bad.size()),
                     first[0], first[1], first[2], change, longest_edge(options)));
  }
  const Point& place = bad[0].place;
  throw VerificationError(fmt::format(
      "the outer surface has {} edges with more than two triangles after {} attempts with smaller edges and "
      "filled gaps, one at ({:.5g}, {:.5g}, {:.5g}) mm; correct the labels there, or try --edge-mm {:.2g}",
      bad.size(), kAttempts, place[0], place[1], place[2], edge / 2));
}

constexpr double kKept = 0.02;  // of a tissue's volume may be missing or too much

std::vector<double> shares_missing(const VolumeBoundary& boundary, const std::vector<double>& voxels_mm3) {
  std::vector<double> missing = enclosed_volumes(boundary);
  for (std::size_t t = 0; t < missing.size(); ++t) missing[t] = 1 - missing[t] / voxels_mm3[t];
  return missing;
}

// The surfaces of the tissues with the volumes of their voxels.
struct TissueSurfaces {
  VolumeBoundary boundary;
  std::vector<double> meshed_mm3;  // before they were moved
  VolumeMove move;
};

// Chords of a curved border lie inside of it, and smoothing shrinks what is convex, so that meshes of organs are too small. The
// surfaces are moved to the volumes of the voxels. Tissues for which that move is too long get shorter edges.
TissueSurfaces surfaces_of_volume(SmoothTissues& smooth, const LabelImageOptions& o,
                                  const std::vector<double>& voxels_mm3, LabelMeshOptions& sizes, double voxel_mm) {
  const std::vector<Tissue>& tissues = o.tissues;
  constexpr int kAttempts = 4;
  constexpr double kShorter = 0.75;
  for (int attempt = 1;; ++attempt) {
    TissueSurfaces result{manifold_surfaces(smooth.map, tissues, smooth.pieces, o.keep_cavities, sizes), {}, {}};
    result.meshed_mm3 = enclosed_volumes(result.boundary);
    result.move = move_to_volumes(result.boundary, voxels_mm3);
    const std::vector<double> missing = shares_missing(result.boundary, voxels_mm3);
    bool shorter = false;
    for (std::size_t t = 0; t < tissues.size() && attempt < kAttempts; ++t) {
      if (std::abs(missing[t]) <= kKept || kShorter * sizes.edges[t] < voxel_mm) continue;
      shorten(sizes, t, kShorter);
      shorter = true;
      note(
          fmt::format("\"{}\": its mesh of {:.4g} mm3 cannot be moved to the {:.4g} mm3 of its voxels; trying edges of "
                      "{:.3g} mm there",
                      tissues[t].name, result.meshed_mm3[t], voxels_mm3[t], sizes.edges[t]));
    }
    if (!shorter) return result;
  }
}

void compare_volumes(const MeshReport& report, const LabelImageOptions& o) {
  for (std::size_t t = 0; t < o.tissues.size(); ++t) {
    const auto& v = report.tissue_volumes[t];
    const Tissue& tissue = o.tissues[t];
    if (v.meshed < 0.5 * v.voxels)
      throw InputError(
          fmt::format("tissue \"{}\" (label {}): its mesh holds {:.4g} mm3 of its voxels' {:.4g} mm3; make triangles "
                      "smaller with --edge-mm, or --smooth less",
                      tissue.name, tissue.label, v.meshed, v.voxels));
    const double change = report.region_volume_of_surface[t] / v.voxels - 1;
    if (std::abs(change) > kKept)
      warn(fmt::format(
          "tissue \"{}\" (label {}): its mesh holds {:.4g} mm3, {:+.1f} % of its voxels' {:.4g} mm3, more than {:g} "
          "% off; smoothing changed {:+.1f} %, triangles and filled gaps {:+.1f} %; try {}",
          tissue.name, tissue.label, report.region_volume_of_surface[t], 100 * change, v.voxels, 100 * kKept,
          100 * (v.smoothed / v.voxels - 1), 100 * (v.meshed - v.smoothed) / v.voxels,
          v.smoothed < (1 - kKept) * v.voxels ? "to --smooth less" : fmt::format("--edge-mm {:.2g}", 0.6 * v.edge)));
  }
}

// The surface of one tissue, towards its neighbours and the outside.
TriangleSurface surface_of(const VolumeBoundary& boundary, std::int32_t tissue) {
  TriangleSurface surface{boundary.points, {}};
  for (const auto& patch : boundary.patches)
    if (patch.behind == tissue || patch.ahead == tissue)
      surface.triangles.insert(surface.triangles.end(), patch.triangles.begin(), patch.triangles.end());
  return surface;
}

void tell_lost_tips(const VolumeBoundary& boundary, const std::vector<VoxelMask>& masks,
                    const std::vector<double>& voxels_mm3, const LabelImageOptions& o) {
  for (std::size_t t = 0; t < masks.size(); ++t) {
    const VoxelGrid& grid = masks[t].grid;
    const TriangleSurface voxels = isosurface(grid, {masks[t].inside.begin(), masks[t].inside.end()}).surface;
    const std::string lost =
        lost_tip_warning(measure_distance(voxels, surface_of(boundary, static_cast<std::int32_t>(t))), voxels_mm3[t],
                         std::cbrt(grid.voxel_volume()), "a smaller --edge-mm or --smooth keeps it");
    if (!lost.empty()) warn(fmt::format("tissue \"{}\" (label {}): {}", o.tissues[t].name, o.tissues[t].label, lost));
  }
}

}  // namespace

std::vector<Tissue> parse_tissues(const std::vector<std::string>& texts) {
  std::vector<Tissue> tissues;
  std::set<double> labels;
  std::set<std::string> names;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::string number = text.substr(0, equals);
    Tissue tissue;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), tissue.label);
    tissue.name = equals == std::string::npos ? "label " + number : text.substr(equals + 1);
    if (error != std::errc() || end != number.data() + number.size() || !std::isfinite(tissue.label) ||
        tissue.name.empty())
      throw InputError(
          fmt::format("--labels: expected VALUE=NAME,VALUE=NAME (255=liver,127=kidney), found \"{}\"", text));
    if (!labels.insert(tissue.label).second || !names.insert(tissue.name).second)
      throw InputError(fmt::format("--labels: \"{}\" repeats a value or a name; every tissue needs its own", text));
    tissues.push_back(tissue);
  }
  return tissues;
}

MeshReport tetrahedra_from_image(const std::string& name, const LabelImageOptions& options, const FillOptions& fill) {
  const LabelImage image = read_label_image(name);
  const double voxel_mm = std::cbrt(image.grid.voxel_volume());
  std::vector<VoxelMask> masks =
      tissue_masks(image, options.tissues, 3 * options.smooth_mm.value_or(1.5 * voxel_mm), name);
  for (std::size_t t = 0; t < masks.size(); ++t) drop_small_pieces(masks[t], options.tissues[t], options, name);
  if (!options.keep_cavities) fill_cavities(masks, name);
  std::vector<double> voxels_mm3;
  for (const VoxelMask& mask : masks)
    voxels_mm3.push_back(static_cast<double>(count_inside(mask)) * mask.grid.voxel_volume());

  LabelMeshOptions sizes = mesh_sizes(options, fill, voxels_mm3, voxel_mm);
  SmoothTissues smooth = smooth_as_tissues_allow(masks, voxels_mm3, options, voxel_mm, name);
  note(fmt::format("meshing {} tissues in {} pieces with triangles of {:.4g} mm", options.tissues.size(),
                   smooth.pieces.size(), longest_edge(sizes)));
  MeshReport report;
  TissueSurfaces surfaces;
  constexpr int kFills = 3;
  for (int attempt = 1;; ++attempt) {
    surfaces = surfaces_of_volume(smooth, options, voxels_mm3, sizes, voxel_mm);
    try {
      surfaces.boundary = without_unused_points(surfaces.boundary);
      report.mesh = fill_with_tetrahedra(surfaces.boundary, fill, &report.improvement);
      break;
    } catch (const OperationError& failed) {
      if (attempt == kFills)
        throw OperationError(
            fmt::format("{}: no tetrahedra were found between surfaces with edges of {:.3g} mm: {}; try "
                        "--edge-mm {:.3g}",
                        name, longest_edge(sizes), failed.what(), 0.9 * longest_edge(sizes)));
      shorten_all(sizes, 0.9);
      note(fmt::format("no tetrahedra were found between these surfaces; trying edges of {:.4g} mm",
                       longest_edge(sizes)));
    }
  }
  const VolumeBoundary& boundary = surfaces.boundary;
  for (const auto& patch : boundary.patches) report.surface_triangles += patch.triangles.size();
  report.kept_triangles = verify_boundary_kept(boundary, report.mesh);
  report.region_volume_of_surface = enclosed_volumes(boundary);
  for (std::size_t t = 0; t < voxels_mm3.size(); ++t)
    report.tissue_volumes.push_back(
        {voxels_mm3[t], smooth.volumes[t], surfaces.meshed_mm3[t], surfaces.move.distance[t], sizes.edges[t]});
  compare_volumes(report, options);
  tell_lost_tips(boundary, masks, voxels_mm3, options);
  return report;
}

}  // namespace palpate
