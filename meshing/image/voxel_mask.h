// Label image -> the voxels of the organ: selected, cropped, padded, small pieces and cavities dealt with.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "meshing/image/label_image.h"

namespace palpate {

// One bit of truth per voxel of a box that has at least one empty voxel on every side.
struct VoxelMask {
  VoxelGrid grid;
  std::vector<std::uint8_t> inside;  // [voxels] 0 or 1
  bool touched_border = false;       // of the image: the organ may be cut off there
};

struct LabelSelection {
  std::vector<double> labels;       // any of these values
  std::optional<double> threshold;  // or everything at or above it
};

// The selected voxels, cropped to their box and padded by padding_mm, rounded up, and a voxel on every side. For a
// surface 0 is enough: a Gaussian leaves less than a half outside the box. Without labels and threshold the image must
// hold a single value beside 0. Errors: InputError when nothing is selected (lists the values present).
VoxelMask select_voxels(const LabelImage& image, const LabelSelection& selection, double padding_mm,
                        const std::string& image_name);

// Which pieces to keep: all; the largest n; those of at least a volume (mm^3); those of at least a share of the
// largest.
struct PieceFilter {
  enum class Kind { all, largest, volume, share } kind = Kind::share;
  double number = 0.01;
};
// "all", "largest", "3", "2.5mm3", "1.2cm3", "1%". Errors: InputError for anything else.
PieceFilter parse_piece_filter(const std::string& text);
// Which of the volumes pass, by position.
std::vector<bool> kept_pieces(const PieceFilter& filter, const std::vector<double>& volumes);

// Pieces of the mask, connected through faces; background pieces through faces and edges: as the isosurface separates
// them. Piece 0 of the background is the outside.
struct Pieces {
  std::vector<std::int32_t> of_voxel;             // [voxels] inside: 0 .. ; outside: -1 - background piece
  std::vector<std::uint64_t> inside, background;  // voxels of each
};
Pieces connected_pieces(const VoxelMask& mask);

// What was dropped or filled, for the report.
struct PieceChanges {
  std::uint64_t pieces = 0, dropped = 0, cavities = 0, filled = 0;
  double dropped_mm3 = 0, largest_dropped_mm3 = 0, filled_mm3 = 0, largest_filled_mm3 = 0;
};
// Drops the pieces the filter refuses and, where asked, fills cavities. Errors: InputError when more than 1,000 pieces
// would be kept (noise).
PieceChanges filter_pieces(VoxelMask& mask, const PieceFilter& filter, bool fill_cavities,
                           const std::string& image_name);

std::uint64_t count_inside(const VoxelMask& mask);

}  // namespace palpate
