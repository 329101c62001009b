#include "meshing/tetrahedra/tetrahedra_from_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "formats/errors.h"
#include "formats/program.h"
#include "meshing/image/label_image.h"
#include "meshing/image/voxel_mask.h"
#include "meshing/tetrahedra/boundary_of_mesh.h"
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
  warn(fmt::format("filled {} cavities, {:.4g} mm3 in all (--cavities keep keeps them)", changes.filled,
                   changes.filled_mm3));
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

double twelfth_of_size(const std::vector<VoxelMask>& masks) {
  double volume = 0;
  for (const VoxelMask& mask : masks) volume += static_cast<double>(count_inside(mask)) * mask.grid.voxel_volume();
  return std::cbrt(volume) / 12;
}

struct Attempt {
  TetrahedralMesh mesh;
  VolumeBoundary boundary;
};

// Mesh_3 gives each tissue a good surface, but where two parts nearly touch, the outer surface of all tissues may not be
// a manifold. A smaller edge moves every vertex. Where that does not help, the gap there is filled.
Attempt manifold_mesh(TissueMap& map, const std::vector<Tissue>& tissues, const std::vector<TissuePiece>& pieces,
                      LabelMeshOptions& options) {
  constexpr int kPlain = 2, kAttempts = 8;
  const double edge = options.edge;
  std::vector<Point> bad;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    Attempt result;
    result.mesh = tetrahedra_from_tissues(map, tissues, pieces, options);
    result.boundary = boundary_of(result.mesh);
    bad = non_manifold_edges(result.boundary).places;
    if (bad.empty()) return result;
    std::string change;
    if (attempt + 1 >= kPlain) {
      for (const Point& place : bad) map.fill_gap(place, edge / 2);
      change = fmt::format("filling the gaps there, up to {:.3g} mm around, and ", edge);
    }
    options.edge *= 0.96;
    note(fmt::format(
        "{} non-manifold edges on the outer surface, the first at ({:.5g}, {:.5g}, {:.5g}) mm; {}trying edges of "
        "{:.4g} mm",
        bad.size(), bad[0][0], bad[0][1], bad[0][2], change, options.edge));
  }
  throw VerificationError(fmt::format(
      "the outer surface has {} edges with more than two triangles after {} attempts with smaller edges and "
      "filled gaps, one at ({:.5g}, {:.5g}, {:.5g}) mm; correct the labels there, or try --edge-mm {:.2g}",
      bad.size(), kAttempts, bad[0][0], bad[0][1], bad[0][2], edge / 2));
}

void compare_volumes(const MeshReport& report, const std::vector<double>& voxels_mm3, const LabelImageOptions& o) {
  for (std::size_t t = 0; t < o.tissues.size(); ++t) {
    const double share = report.region_volume_of_surface[t] / voxels_mm3[t];
    if (share < 0.5)
      throw InputError(
          fmt::format("tissue \"{}\" (label {}): its mesh holds {:.4g} mm3 of its voxels' {:.4g} mm3; make triangles "
                      "smaller with --edge-mm, or --smooth less",
                      o.tissues[t].name, o.tissues[t].label, report.region_volume_of_surface[t], voxels_mm3[t]));
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

MeshReport tetrahedra_from_image(const std::vector<std::string>& inputs, const LabelImageOptions& options,
                                 const FillOptions& fill) {
  const std::string& name = inputs.front();
  const LabelImage image = read_label_image(inputs, options.spacing);
  const double smooth = options.smooth_mm.value_or(1.5 * std::cbrt(image.grid.voxel_volume()));
  std::vector<VoxelMask> masks = tissue_masks(image, options.tissues, 3 * smooth, name);
  for (std::size_t t = 0; t < masks.size(); ++t) drop_small_pieces(masks[t], options.tissues[t], options, name);
  if (!options.keep_cavities) fill_cavities(masks, name);
  std::vector<double> voxels_mm3;
  for (const VoxelMask& mask : masks)
    voxels_mm3.push_back(static_cast<double>(count_inside(mask)) * mask.grid.voxel_volume());

  LabelMeshOptions mesh_options;
  mesh_options.edge = options.edge_mm > 0 ? options.edge_mm : twelfth_of_size(masks);
  mesh_options.facet_distance = options.facet_distance > 0 ? options.facet_distance : mesh_options.edge / 8;
  mesh_options.time_limit = fill.time_limit;
  const bool by_mesh_3 = options.fill == LabelImageOptions::Fill::mesh_3;
  if (by_mesh_3) mesh_options.interior = fill.size > 0 ? fill.size : mesh_options.edge;
  TissueMap map(masks, smooth);
  const std::vector<TissuePiece> pieces = pieces_of(map, name);
  note(fmt::format("meshing {} tissues in {} pieces with triangles of {:.4g} mm", options.tissues.size(), pieces.size(),
                   mesh_options.edge));
  Attempt attempt = manifold_mesh(map, options.tissues, pieces, mesh_options);

  MeshReport report;
  if (by_mesh_3) {
    report.mesh = std::move(attempt.mesh);
    for (const auto& patch : attempt.boundary.patches)
      report.mesh.patches.push_back({patch_name(attempt.boundary, patch), patch.triangles});
    report.improvement = improve_worst_elements(report.mesh, fill.goal);
  } else {
    attempt.boundary = without_unused_points(attempt.boundary);
    try {
      report.mesh = fill_with_tetrahedra(attempt.boundary, fill, &report.improvement);
    } catch (const OperationError& failed) {
      throw OperationError(
          fmt::format("{}: no tetrahedra were found between surfaces with edges of {:.3g} mm: {}; try "
                      "--edge-mm {:.3g}, or --fill mesh_3",
                      name, mesh_options.edge, failed.what(), 0.9 * mesh_options.edge));
    }
  }
  for (const auto& patch : attempt.boundary.patches) report.surface_triangles += patch.triangles.size();
  report.kept_triangles = verify_boundary_kept(attempt.boundary, report.mesh);
  report.region_volume_of_surface = enclosed_volumes(attempt.boundary);
  report.region_volume_of_voxels = voxels_mm3;
  compare_volumes(report, voxels_mm3, options);
  return report;
}

}  // namespace palpate
