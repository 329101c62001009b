// Reads a segmented image of any supported format: the label of each voxel and where the voxel lies, in LPS
// millimetres.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace palpate {

// The centre of voxel (i, j, k) is origin + i axis[0] + j axis[1] + k axis[2], in mm, in LPS coordinates.
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
  std::vector<float> values;             // [voxels], x fastest
  std::map<float, std::string> names{};  // of labels, where read_label_names finds them
};

// Reads INR (.inr, .inr.gz), NRRD (.nrrd, .nhdr), NIfTI (.nii, .nii.gz, .hdr) or MetaImage (.mha, .mhd). INR stores no
// directions: its axes are taken as LPS. Errors: InputError when the input is not a complete, valid image. The
// function compares the stated size with the file before it takes memory.
LabelImage read_label_image(const std::string& name);

// Returns whether the name means an image: one that read_label_image reads, or slices (a folder, PNG), which it refuses.
bool is_image_name(const std::string& input);

// Lists the values of the image with their names and numbers of voxels, for messages: "0 (25413011 voxels), 255 liver
// (3133434 voxels)". Values ascend. Of more than limit values (grey values: segmentation tools write fewer labels), lists
// the 12 smallest, then "...".
std::string describe_values(const LabelImage& image, std::size_t limit = 256);

}  // namespace palpate
