// What a new organ is made from - a label image, a surface or a mesh - and what is measured of it.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace palpate {

struct OrganRequest {
  std::string name;                            // of the folder and the tissue: letters, digits, -
  std::filesystem::path folder;                // in which the organ's folder is written
  std::filesystem::path image, surface, mesh;  // exactly one
  std::string label;                           // of an image: "1", "2,7" or a name that the image has
  std::optional<std::string> unit, frame;      // of a surface or a mesh; default: mm, LPS
};

// Lengths in mm, in the axes of the source; an image's are LPS.
struct OrganSource {
  enum class Kind { image, surface, mesh } kind = Kind::image;
  std::filesystem::path file;  // absolute
  std::string unit = "mm";     // of the file's numbers
  std::string frame = "LPS";

  std::vector<double> labels;             // of an image
  std::string labels_text;                // "1 (spleen)"
  std::uint64_t pieces = 1;               // of the labels; the organ is the largest
  double dropped_mm3 = 0;                 // volume of the other pieces
  bool touches_border = false;            // of the image
  double voxel_mm = 0;                    // of an image: the mean of the voxel's sides
  std::vector<std::string> region_names;  // of a mesh

  double volume_mm3 = 0, area_mm2 = 0, thickness_mm = 0;
  std::string thickness_text;                        // what thickness_mm says
  std::array<double, 3> low{}, high{};               // the box
  std::vector<std::array<double, 3>> border_points;  // on the surface, about evenly
};

// Reads and measures. Errors: InputError for a label that the image does not have, with the list of its labels; for several
// labels where none is asked for; for files that cannot be read.
OrganSource measure_source(const OrganRequest& request);

}  // namespace palpate
