// Selects the voxels of the organ in a label image, crops the image to them, drops small pieces and fills cavities.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "meshing/image/label_image.h"

namespace palpate {

// States for each voxel of a box whether it belongs to the organ. No voxel on a side of the box belongs to it.
struct VoxelMask {
  VoxelGrid grid;
  std::vector<std::uint8_t> inside;  // [voxels] 0 or 1
  bool touched_border = false;       // the organ reaches the border of the image and may be cut off there
};

struct LabelSelection {
  std::vector<double> labels;       // selects voxels with any of these values
  std::optional<double> threshold;  // selects voxels with at least this value
};

// Crops the selection to its box, then pads the box on every side by padding_mm (rounded up to voxels) and one voxel
// more. For a surface padding_mm = 0 is enough, because the smoothed mask is below one half outside the box. Without
// labels and threshold the image must hold one single value besides 0. Errors: InputError with the list of the values in
// the image when one of the labels is not in it, or no voxel reaches the threshold.
VoxelMask select_voxels(const LabelImage& image, const LabelSelection& selection, double padding_mm,
                        const std::string& image_name);

// Which pieces to keep: all; the n largest; those of at least a volume (mm^3); those of at least a share of the
// largest piece.
struct PieceFilter {
  enum class Kind { all, largest, volume, share } kind = Kind::share;
  double number = 0.01;
};
// Reads "all", "largest", "3", "2.5mm3", "1.2cm3" or "1%". Errors: InputError for any other text.
PieceFilter parse_piece_filter(const std::string& text);
// Returns for each volume whether the filter keeps it, in the order of the volumes.
std::vector<bool> kept_pieces(const PieceFilter& filter, const std::vector<double>& volumes);

// The connected pieces of the organ and of the background. Voxels of the organ are neighbours when they share a face;
// voxels of the background also when they share an edge. isosurface separates pieces by the same rule. Background
// piece 0 is the outside of the organ.
struct Pieces {
  std::vector<std::int32_t> of_voxel;             // [voxels] organ: its piece; background: -1 - its piece
  std::vector<std::uint64_t> inside, background;  // [pieces] number of voxels
};
Pieces connected_pieces(const VoxelMask& mask);

// What filter_pieces dropped and filled, for the report.
struct PieceChanges {
  std::uint64_t pieces = 0, dropped = 0, cavities = 0, filled = 0;
  double dropped_mm3 = 0, largest_dropped_mm3 = 0, filled_mm3 = 0, largest_filled_mm3 = 0;
};
// Drops the pieces that the filter refuses. Fills the cavities if fill_cavities is true. Errors: InputError when no
// piece or more than 1,000 pieces (noise) are left.
PieceChanges filter_pieces(VoxelMask& mask, const PieceFilter& filter, bool fill_cavities,
                           const std::string& image_name);

std::uint64_t count_inside(const VoxelMask& mask);

}  // namespace palpate
