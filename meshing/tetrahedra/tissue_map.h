// Label image -> which tissue lies at any point in space, with borders smoother than voxels.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "meshing/image/label_image.h"
#include "meshing/image/voxel_mask.h"
#include "meshing/surface/triangle_surface.h"

namespace palpate {

inline constexpr std::size_t kMostTissues = 16;

struct Tissue {
  double label = 0;  // value in the image
  std::string name;
};

// One mask per tissue, all on the grid that holds every tissue, padded by padding_mm and at least a voxel.
// Errors: InputError when a label is absent (lists those present), and above kMostTissues.
std::vector<VoxelMask> tissue_masks(const LabelImage& image, const std::vector<Tissue>& tissues, double padding_mm,
                                    const std::string& image_name);

// Every tissue's mask is smoothed by the same Gaussian and a point belongs to the tissue with the largest share, or to
// none where the background's is largest: neighbours share their border exactly, without gap or overlap.
class TissueMap {
 public:
  // masks: on one grid. Cost: smooth_mask for each, four bytes a voxel and tissue kept.
  TissueMap(const std::vector<VoxelMask>& masks, double smooth_mm);

  // 0: none; t + 1: tissue t. p in mm, LPS.
  int at(const Point& p) const;
  int at_voxel(std::size_t voxel) const;

  const VoxelGrid& grid() const { return grid_; }
  std::size_t tissues() const { return shares_.size(); }

 private:
  using Shares = std::array<float, kMostTissues>;
  int largest(const Shares& share) const;
  VoxelGrid grid_;
  std::array<Point, 3> to_index_{};         // rows of the inverse of the grid's axes
  std::vector<std::vector<float>> shares_;  // [tissue][voxel], 0 .. 1
};

// A connected set of voxels of one tissue (or an enclosed one of none), and pairs of neighbouring voxel centres between
// which its border runs, the first one inside.
struct TissuePiece {
  int tissue = 0;  // as TissueMap::at
  std::size_t voxels = 0;
  std::vector<std::array<Point, 2>> crossings;
};
// Errors: InputError above 1,000 pieces (noise).
std::vector<TissuePiece> pieces_of(const TissueMap& map, const std::string& image_name);

}  // namespace palpate
