// What a label image holds: each label with its volume, its box and its pieces.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "meshing/image/label_image.h"

namespace palpate {

struct LabelEntry {
  float label = 0;
  std::string name;  // empty where no source has one
  std::uint64_t voxels = 0;
  double volume_mm3 = 0;
  std::array<double, 3> low{}, high{};  // the box of the voxels, with their full width, LPS mm
  std::uint64_t pieces = 0;             // sets of voxels that share faces
  std::uint64_t largest_piece = 0;      // voxels
  bool touches_border = false;          // a voxel lies at the image's border, where the organ may be cut off
};

// The labels other than 0, ascending. Cost: one pass over the image and one byte a voxel. Errors: InputError for an image of
// more than 10,000 different values, which is not a label image.
std::vector<LabelEntry> list_labels(const LabelImage& image, const std::string& image_name);

std::string label_list_text(const std::vector<LabelEntry>& labels);
nlohmann::ordered_json label_list_json(const std::vector<LabelEntry>& labels);

}  // namespace palpate
