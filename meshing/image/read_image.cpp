// Chooses the reader for the name of an image, and checks what was read.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "formats/errors.h"
#include "meshing/image/image_header.h"
#include "meshing/image/label_image.h"
#include "meshing/image/label_names.h"

namespace palpate {
namespace {

bool ends_with_any(const std::string& name, std::initializer_list<const char*> endings) {
  const std::string text = lower_case(name);
  return std::any_of(endings.begin(), endings.end(), [&](const char* end) { return text.ends_with(end); });
}

// A DICOM file, whatever its name: "DICM" behind 128 bytes; a folder with such a file.
bool is_dicom(const std::filesystem::path& name) {
  std::error_code ignored;
  if (std::filesystem::is_directory(name, ignored)) {
    const std::filesystem::directory_iterator files(name, ignored), end;
    return !ignored &&
           std::any_of(files, end, [](const auto& file) { return file.is_regular_file() && is_dicom(file); });
  }
  std::array<char, 132> begin{};
  std::ifstream stream(name, std::ios::binary);
  return stream.read(begin.data(), begin.size()) && std::string_view(begin.data() + 128, 4) == "DICM";
}

}  // namespace

bool is_image_name(const std::string& input) {
  std::error_code error;
  return std::filesystem::is_directory(input, error) ||
         ends_with_any(input,
                       {".inr", ".inr.gz", ".nrrd", ".nhdr", ".nii", ".nii.gz", ".hdr", ".mha", ".mhd", ".png"}) ||
         is_dicom(input);
}

namespace {

// No scan lies outside these limits. Far from the origin, double precision cannot tell neighbouring voxels apart.
constexpr double kFarthest = 1e9, kSmallestVoxel = 1e-9;  // mm

void check_grid(const std::string& name, const VoxelGrid& grid) {
  for (int d = 0; d < 3; ++d) {
    const auto& step = grid.axis[d];
    const double size = std::hypot(step[0], step[1], step[2]);
    if (!(size >= kSmallestVoxel && size <= kLargestVoxel))
      throw InputError(
          fmt::format("{}: expected voxels of 1e-9 to 1e6 mm, found {:.3g} mm; correct the header", name, size));
    if (!(std::abs(grid.origin[d]) <= kFarthest))
      throw InputError(fmt::format("{}: expected an origin within 1e9 mm, found {:.3g} mm; correct the header", name,
                                   grid.origin[d]));
  }
  const std::array<double, 3> spacing = grid.spacing();
  if (!(grid.voxel_volume() > 1e-6 * spacing[0] * spacing[1] * spacing[2]))
    throw InputError(fmt::format("{}: expected directions that span space, found a voxel of volume {} mm3", name,
                                 grid.voxel_volume()));
}

}  // namespace

LabelImage read_label_image(const std::string& name) {
  const ImageHeader header = [&] {
    if (ends_with_any(name, {".inr", ".inr.gz"})) return read_inr_header(name);
    if (ends_with_any(name, {".nrrd", ".nhdr"})) return read_nrrd_header(name);
    if (ends_with_any(name, {".mha", ".mhd"})) return read_meta_header(name);
    if (ends_with_any(name, {".nii", ".nii.gz", ".hdr"})) return read_nifti_header(name);
    if (is_dicom(name))
      throw InputError(fmt::format(
          "{}: expected an image in NRRD, NIfTI, MetaImage or INR, found DICOM; open it in 3D Slicer (module "
          "Segmentations), export the segmentation as a labelmap, and save that as .nrrd or .nii.gz",
          name));
    throw InputError(fmt::format(
        "{}: expected an image in one file (.inr .inr.gz .nrrd .nhdr .nii .nii.gz .mha .mhd), found {}; save "
        "slices as one NRRD or NIfTI, which has their voxel size and axes",
        name, std::filesystem::is_directory(name) ? "a folder" : "another ending"));
  }();
  check_grid(name, header.grid);
  return {header.grid, read_voxels(header.voxels, header.grid.size), read_label_names(name)};
}

}  // namespace palpate
