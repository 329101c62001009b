#include "meshing/tetrahedra/tissue_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/errors.h"
#include "meshing/surface/isosurface.h"

namespace palpate {
namespace {

constexpr std::size_t kMostPieces = 1000;

std::array<Point, 3> inverse_rows(const std::array<std::array<double, 3>, 3>& axis) {
  const double determinant = dot(axis[0], cross(axis[1], axis[2]));
  return {(1 / determinant) * cross(axis[1], axis[2]), (1 / determinant) * cross(axis[2], axis[0]),
          (1 / determinant) * cross(axis[0], axis[1])};
}

}  // namespace

std::vector<VoxelMask> tissue_masks(const LabelImage& image, const std::vector<Tissue>& tissues, double padding_mm,
                                    const std::string& image_name) {
  if (tissues.size() > kMostTissues)
    throw InputError(
        fmt::format("--labels: {} tissues, but at most {} are meshed together", tissues.size(), kMostTissues));
  LabelSelection all;
  for (const Tissue& tissue : tissues) {
    select_voxels(image, {{tissue.label}, {}}, 0, image_name);  // throws an error that names the absent label
    all.labels.push_back(tissue.label);
  }
  const VoxelMask whole = select_voxels(image, all, padding_mm, image_name);
  // the first voxel of the cropped grid, in voxels of the image
  const auto rows = inverse_rows(image.grid.axis);
  const Point offset = whole.grid.origin - image.grid.origin;
  const std::array<int, 3> first = {static_cast<int>(std::lround(dot(rows[0], offset))),
                                    static_cast<int>(std::lround(dot(rows[1], offset))),
                                    static_cast<int>(std::lround(dot(rows[2], offset)))};
  std::vector<VoxelMask> masks(tissues.size(), whole);
  for (int k = 0; k < whole.grid.size[2]; ++k)
    for (int j = 0; j < whole.grid.size[1]; ++j)
      for (int i = 0; i < whole.grid.size[0]; ++i) {
        const std::size_t voxel = whole.grid.index(i, j, k);
        if (!whole.inside[voxel]) continue;  // voxels beyond the image are not inside either
        const double value = image.values[image.grid.index(i + first[0], j + first[1], k + first[2])];
        for (std::size_t t = 0; t < tissues.size(); ++t) masks[t].inside[voxel] = value == tissues[t].label;
      }
  return masks;
}

TissueMap::TissueMap(const std::vector<VoxelMask>& masks, double smooth_mm)
    : grid_(masks.front().grid), to_index_(inverse_rows(grid_.axis)) {
  for (const VoxelMask& mask : masks) shares_.push_back(smooth_mask(mask, smooth_mm));
}

int TissueMap::largest(const Shares& share) const {
  int best = 0;
  float most = 1;
  for (std::size_t t = 0; t < shares_.size(); ++t) most -= share[t];  // what is left is the background's share
  for (std::size_t t = 0; t < shares_.size(); ++t)
    if (share[t] > most) {
      most = share[t];
      best = static_cast<int>(t) + 1;
    }
  return best;
}

void TissueMap::fill_gap(const Point& place, double radius) {
  std::array<int, 3> low{}, high{};
  for (int d = 0; d < 3; ++d) {
    const double middle = dot(to_index_[d], place - grid_.origin);
    const double reach = 2 * radius * std::sqrt(dot(to_index_[d], to_index_[d]));
    low[d] = std::max(0, static_cast<int>(std::ceil(middle - reach)));
    high[d] = std::min(grid_.size[d] - 1, static_cast<int>(std::floor(middle + reach)));
  }
  for (int k = low[2]; k <= high[2]; ++k)
    for (int j = low[1]; j <= high[1]; ++j)
      for (int i = low[0]; i <= high[0]; ++i) {
        const Point away = grid_.point(i, j, k) - place;
        const double near = std::max(0.0, 1 - dot(away, away) / (4 * radius * radius));
        const std::size_t voxel = grid_.index(i, j, k);
        double sum = 0;
        for (const auto& share : shares_) sum += share[voxel];
        if (sum < 1e-3) continue;  // no tissue is near
        for (auto& share : shares_) share[voxel] *= static_cast<float>(1 + near * near * std::max(0.0, 1 - sum) / sum);
      }
}

int TissueMap::at_voxel(std::size_t voxel) const {
  Shares share;
  for (std::size_t t = 0; t < shares_.size(); ++t) share[t] = shares_[t][voxel];
  return largest(share);
}

int TissueMap::at(const Point& p) const {
  const Point offset = p - grid_.origin;
  std::array<int, 3> cell{};
  std::array<float, 3> part{};
  for (int d = 0; d < 3; ++d) {
    const double index = dot(to_index_[d], offset);
    if (!(index >= 0) || !(index < grid_.size[d] - 1)) return 0;
    cell[d] = static_cast<int>(index);
    part[d] = static_cast<float>(index - cell[d]);
  }
  const std::size_t corner = grid_.index(cell[0], cell[1], cell[2]), row = grid_.size[0],
                    slice = row * static_cast<std::size_t>(grid_.size[1]);
  Shares share;
  for (std::size_t t = 0; t < shares_.size(); ++t) {
    const float* f = shares_[t].data() + corner;
    const auto along = [&](const float* g) { return g[0] + part[0] * (g[1] - g[0]); };
    const auto across = [&](const float* g) { return along(g) + part[1] * (along(g + row) - along(g)); };
    share[t] = across(f) + part[2] * (across(f + slice) - across(f));
  }
  return largest(share);
}

std::vector<TissuePiece> pieces_of(const TissueMap& map, const std::string& image_name) {
  const VoxelGrid& grid = map.grid();
  const auto [nx, ny, nz] = grid.size;
  std::vector<std::uint8_t> tissue(grid.voxels()), seen(grid.voxels());
  for (std::size_t v = 0; v < tissue.size(); ++v) tissue[v] = static_cast<std::uint8_t>(map.at_voxel(v));

  constexpr int kSteps[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<TissuePiece> pieces;
  std::vector<std::array<int, 3>> front;
  const auto flood = [&](std::array<int, 3> seed) {
    TissuePiece piece;
    piece.tissue = tissue[grid.index(seed[0], seed[1], seed[2])];
    front.assign(1, seed);
    seen[grid.index(seed[0], seed[1], seed[2])] = 1;
    while (!front.empty()) {
      const auto [i, j, k] = front.back();
      front.pop_back();
      ++piece.voxels;
      for (const auto& step : kSteps) {
        const int a = i + step[0], b = j + step[1], c = k + step[2];
        if (a < 0 || b < 0 || c < 0 || a >= nx || b >= ny || c >= nz) continue;
        const std::size_t next = grid.index(a, b, c);
        if (tissue[next] != piece.tissue) {
          piece.crossings.push_back({grid.point(i, j, k), grid.point(a, b, c)});
        } else if (!seen[next]) {
          seen[next] = 1;
          front.push_back({a, b, c});
        }
      }
    }
    return piece;
  };
  flood({0, 0, 0});  // the padding connects all that lies outside
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        if (seen[grid.index(i, j, k)]) continue;
        pieces.push_back(flood({i, j, k}));
        if (pieces.size() > kMostPieces)
          throw InputError(
              fmt::format("{}: the tissues fall into more than {} pieces, which looks like noise; expected "
                          "segmented organs; smooth more with --smooth or drop small pieces with --components",
                          image_name, kMostPieces));
      }
  return pieces;
}

}  // namespace palpate
