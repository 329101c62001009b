// Label image -> the tissue at any point in space. The borders of the tissues are smoother than the voxels.
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
  double label = 0;  // its value in the image
  std::string name;
};

// Returns one mask for each tissue. All masks have the same grid, which holds every tissue and is padded by
// padding_mm and at least one voxel. Errors: InputError when a label is absent (lists those present) or when there
// are more than kMostTissues.
std::vector<VoxelMask> tissue_masks(const LabelImage& image, const std::vector<Tissue>& tissues, double padding_mm,
                                    const std::string& image_name);

// The constructor smooths the mask of every tissue with the same Gaussian. A point belongs to the tissue with the
// largest value there, or to none if the background's value is largest. So neighbours share their border exactly,
// without gap or overlap.
class TissueMap {
 public:
  // All masks must have the same grid. Cost: smooth_mask for each tissue; keeps four bytes for each voxel and tissue.
  TissueMap(const std::vector<VoxelMask>& masks, double smooth_mm);

  // Returns t + 1 for tissue t and 0 for none. p in mm, LPS.
  int at(const Point& p) const;
  int at_voxel(std::size_t voxel) const;

  // Gives what is near the place to the tissues there: the background's share falls to zero at the place and is unchanged
  // beyond twice the radius (mm); the tissues get it in proportion to their shares.
  void fill_gap(const Point& place, double radius);

  const VoxelGrid& grid() const { return grid_; }
  std::size_t tissues() const { return shares_.size(); }

 private:
  using Shares = std::array<float, kMostTissues>;
  int largest(const Shares& share) const;
  VoxelGrid grid_;
  std::array<Point, 3> to_index_{};         // rows of the inverse of the matrix of the grid's axes
  std::vector<std::vector<float>> shares_;  // [tissue][voxel], 0 .. 1
};

// A connected set of voxels of one tissue, or of enclosed voxels of no tissue. crossings: pairs of neighbouring voxel
// centres on the two sides of its border, the first one inside the piece.
struct TissuePiece {
  int tissue = 0;  // as TissueMap::at returns it
  std::size_t voxels = 0;
  std::vector<std::array<Point, 2>> crossings;
};
// Errors: InputError when there are more than 1,000 pieces (noise).
std::vector<TissuePiece> pieces_of(const TissueMap& map, const std::string& image_name);

}  // namespace palpate
