// A segmented image of any supported format -> its voxels and where they lie in LPS millimetres.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace palpate {

// Where voxels lie: the centre of voxel (i, j, k) is origin + i axis[0] + j axis[1] + k axis[2], in mm, LPS.
struct VoxelGrid {
  std::array<int, 3> size{};
  std::array<std::array<double, 3>, 3> axis{};
  std::array<double, 3> origin{};

  std::size_t voxels() const { return static_cast<std::size_t>(size[0]) * size[1] * size[2]; }
  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * size[1] + j) * static_cast<std::size_t>(size[0]) + i;
  }
  std::array<double, 3> point(double i, double j, double k) const;
  std::array<double, 3> spacing() const;  // mm, lengths of the axes
  double voxel_volume() const;            // mm^3, positive
  bool left_handed() const;
};

struct LabelImage {
  VoxelGrid grid;
  std::vector<float> values;  // [voxels], x fastest
};

// Reads INR(.gz), NRRD/NHDR, NIfTI(.gz), MetaImage (mha/mhd), one PNG per slice: a folder, a glob ("slices/*.png"), or
// the list itself. Slices are ordered by the numbers in their names. spacing (mm) is needed for PNG and refused
// elsewhere. INR stores no orientation: its axes are taken as LPS. Errors: InputError for anything that is not a whole,
// sane image; sizes are checked against the file before memory is taken.
LabelImage read_label_image(const std::vector<std::string>& inputs,
                            const std::optional<std::array<double, 3>>& spacing);

// True when the name of a file, folder or glob is one that read_label_image knows.
bool is_image_name(const std::string& input);

// The distinct values of the image with their number of voxels, for messages: "0 (25413011 voxels), 255 (3133434)".
// More than limit values are cut off with "...".
std::string describe_values(const LabelImage& image, std::size_t limit = 12);

}  // namespace palpate
