// Chooses the reader for the name of an image, and checks what was read.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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

}  // namespace

bool is_image_name(const std::string& input) {
  std::error_code error;
  return std::filesystem::is_directory(input, error) ||
         ends_with_any(input, {".inr", ".inr.gz", ".nrrd", ".nhdr", ".nii", ".nii.gz", ".hdr", ".mha", ".mhd", ".png"});
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
    throw InputError(fmt::format(
        "{}: expected an image in one file (.inr .inr.gz .nrrd .nhdr .nii .nii.gz .mha .mhd), found {}; save "
        "slices as one NRRD or NIfTI, which has their voxel size and axes",
        name, std::filesystem::is_directory(name) ? "a folder" : "another ending"));
  }();
  check_grid(name, header.grid);
  return {header.grid, read_voxels(header.voxels, header.grid.size), read_label_names(name)};
}

}  // namespace palpate
