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
  std::string name;                            // of the folder and the tissue: letters, digits, - and _
  std::filesystem::path folder;                // in which the organ's folder is written
  std::filesystem::path image, surface, mesh;  // exactly one
  std::string label;                           // of an image: "1", "2,7" or a name that the image has
  std::string labels;  // of an image, for several organs: "5=liver 2=right-kidney"; instead of label
  std::optional<std::string> unit, frame;  // of a surface or a mesh; default: mm, LPS
};

// Lengths in mm, in the axes of the source; an image's are LPS.
struct OrganSource {
  enum class Kind { image, surface, mesh } kind = Kind::image;
  std::filesystem::path file;  // absolute
  std::string unit = "mm";     // of the file's numbers
  std::string frame = "LPS";

  std::vector<double> labels;             // of an image
  std::string labels_text;                // "1 (spleen)"
  std::uint64_t pieces = 1;               // of the labels or the surface; the organ is the largest
  double dropped_mm3 = 0;                 // volume of the other pieces
  bool touches_border = false;            // of the image
  double voxel_mm = 0;                    // of an image: the mean of the voxel's sides
  std::vector<std::string> region_names;  // of a mesh

  double volume_mm3 = 0, area_mm2 = 0, thickness_mm = 0;
  std::string thickness_text;                        // what thickness_mm says
  std::array<double, 3> low{}, high{};               // the box
  std::vector<std::array<double, 3>> border_points;  // on the surface, about evenly
};

// One of several organs: "2=right-kidney" or "kidney_right=right-kidney".
struct NamedLabel {
  std::string label, name;
};

// Reads "5=liver 2=right-kidney", with blanks or commas between. Errors: InputError for another text, for a name with other
// characters than letters, digits, - and _, and for a label or a name that is given twice.
std::vector<NamedLabel> parse_named_labels(const std::string& text);

// Whether a name is one for a folder and a tissue: letters, digits, - and _, at most 64, a letter or digit first.
bool is_plain_name(const std::string& name);

// The organs of one image.
struct OrganGroup {
  std::vector<OrganSource> organs;           // in the order of the labels
  std::vector<std::vector<double>> contact;  // [organ][organ] mm^2 of voxel faces between the two
};
// Reads the image once. Errors: as measure_source.
OrganGroup measure_group(const OrganRequest& request, const std::vector<NamedLabel>& labels);

// What is taken for granted, and what is out of the way: a unit or a frame that was not given, a size that hardly any organ has. A
// sentence each. Errors: InputError for an organ of .001 cm^3 or less or above 10 m, and for one below 1 cm or above 1 m whose unit was not given.
std::vector<std::string> doubts(const OrganRequest& request, const OrganSource& source);

// Reads and measures. Errors: InputError for a label that the image does not have, with the list of its labels; for several
// labels where none is asked for; for files that cannot be read.
OrganSource measure_source(const OrganRequest& request);

}  // namespace palpate
