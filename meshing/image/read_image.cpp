// Chooses the reader for the name of an image, joins PNG slices to a volume, and checks what was read.
#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "formats/errors.h"
#include "meshing/image/image_header.h"
#include "meshing/image/label_image.h"
#include "meshing/image/label_names.h"
#include "meshing/image/read_png.h"

namespace palpate {
namespace {

using std::filesystem::path;

bool ends_with_any(const std::string& name, std::initializer_list<const char*> endings) {
  const std::string text = lower_case(name);
  return std::any_of(endings.begin(), endings.end(), [&](const char* end) { return text.ends_with(end); });
}

// Compares runs of digits as numbers, so that "slice2" comes before "slice10".
bool natural_less(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      const auto number = [&](const std::string& text, std::size_t& at) {
        while (at < text.size() && text[at] == '0') ++at;
        const std::size_t first = at;
        while (at < text.size() && is_digit(text[at])) ++at;
        return text.substr(first, at - first);
      };
      const std::string m = number(a, i), n = number(b, j);
      if (m != n) return m.size() != n.size() ? m.size() < n.size() : m < n;
    } else if (a[i] != b[j]) {
      return a[i] < b[j];
    } else {
      ++i, ++j;
    }
  }
  return a.size() - i < b.size() - j;
}

// Returns the files of the slices in order.
std::vector<path> png_slices(const std::vector<std::string>& inputs) {
  std::vector<path> slices;
  for (const std::string& input : inputs) {
    if (std::filesystem::is_directory(input)) {
      for (const auto& entry : std::filesystem::directory_iterator(input)) {
        if (ends_with_any(entry.path().string(), {".png"})) slices.push_back(entry.path());
      }
    } else if (!std::filesystem::exists(input) && input.find_first_of("*?[") != std::string::npos) {
      glob_t found{};
      if (glob(input.c_str(), 0, nullptr, &found) == 0)
        slices.insert(slices.end(), found.gl_pathv, found.gl_pathv + found.gl_pathc);
      globfree(&found);
    } else {
      slices.emplace_back(input);
    }
  }
  if (slices.empty()) throw InputError(fmt::format("{}: expected PNG slices, found none", inputs.front()));
  std::sort(slices.begin(), slices.end(),
            [](const path& a, const path& b) { return natural_less(a.string(), b.string()); });
  return slices;
}

LabelImage read_png_stack(const std::vector<std::string>& inputs, const std::array<double, 3>& spacing) {
  const std::vector<path> slices = png_slices(inputs);
  LabelImage image;
  for (std::size_t k = 0; k < slices.size(); ++k) {
    const LabelImage slice = read_png_slice(slices[k]);
    if (k == 0) {
      image.grid.size = {slice.grid.size[0], slice.grid.size[1], static_cast<int>(slices.size())};
    } else if (slice.grid.size[0] != image.grid.size[0] || slice.grid.size[1] != image.grid.size[1]) {
      throw InputError(fmt::format("{}: expected {} x {} pixels as in {}, found {} x {}", slices[k].string(),
                                   image.grid.size[0], image.grid.size[1], slices[0].string(), slice.grid.size[0],
                                   slice.grid.size[1]));
    }
    image.values.insert(image.values.end(), slice.values.begin(), slice.values.end());
  }
  image.grid.axis = {{{spacing[0], 0, 0}, {0, spacing[1], 0}, {0, 0, spacing[2]}}};
  return image;
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

LabelImage read_volume(const std::string& name) {
  const ImageHeader header = [&] {
    if (ends_with_any(name, {".inr", ".inr.gz"})) return read_inr_header(name);
    if (ends_with_any(name, {".nrrd", ".nhdr"})) return read_nrrd_header(name);
    if (ends_with_any(name, {".mha", ".mhd"})) return read_meta_header(name);
    if (ends_with_any(name, {".nii", ".nii.gz", ".hdr"})) return read_nifti_header(name);
    throw InputError(
        fmt::format("{}: expected an image (.inr .inr.gz .nrrd .nhdr .nii .nii.gz .mha .mhd, PNG slices)", name));
  }();
  check_grid(name, header.grid);
  return {header.grid, read_voxels(header.voxels, header.grid.size)};
}

}  // namespace

LabelImage read_label_image(const std::vector<std::string>& inputs,
                            const std::optional<std::array<double, 3>>& spacing) {
  const std::string& name = inputs.front();
  const bool slices = std::filesystem::is_directory(name) || ends_with_any(name, {".png"});
  if (slices && !spacing)
    throw InputError(fmt::format("{}: PNG slices carry no voxel size; give --spacing x,y,z in mm", name));
  if (!slices && inputs.size() > 1)
    throw InputError(fmt::format("{}: several inputs are read as PNG slices only", inputs[1]));
  if (!slices && spacing)
    throw InputError(fmt::format("{}: --spacing is for PNG slices; this image has its own", name));
  LabelImage image;
  if (slices) {
    check_spacing(name, *spacing);
    image = read_png_stack(inputs, *spacing);
    check_grid(name, image.grid);
  } else {
    image = read_volume(name);
  }
  image.names = read_label_names(inputs.front());
  return image;
}

}  // namespace palpate
