// Chooses the reader for the name of an image. Also reads INR, through CGAL's ImageIO, and joins PNG slices to a
// volume.
#define CGAL_USE_ZLIB 1  // without it ImageIO cannot read .inr.gz
#include <CGAL/ImageIO.h>
#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>

#include "formats/errors.h"
#include "meshing/image/image_header.h"
#include "meshing/image/label_image.h"
#include "meshing/image/label_names.h"
#include "meshing/image/read_image_itk.h"
#include "meshing/image/read_nifti.h"

namespace palpate {
namespace {

using std::filesystem::path;

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool ends_with_any(const std::string& name, std::initializer_list<const char*> endings) {
  const std::string text = lower(name);
  return std::any_of(endings.begin(), endings.end(), [&](const char* end) { return text.ends_with(end); });
}

template <class T>
void copy_values(const _image& raw, std::vector<float>& values) {
  const T* first = static_cast<const T*>(raw.data);
  std::copy_n(first, values.size(), values.begin());
}

LabelImage read_inr(const path& file) {
  check_inr_header(file);
  const std::unique_ptr<_image, void (*)(_image*)> raw(_readImage(file.c_str()), _freeImage);
  if (!raw) throw InputError(fmt::format("{}: the INR header lacks XDIM .. VZ, TYPE, PIXSIZE or CPU", file.string()));
  LabelImage image;
  image.grid.size = {static_cast<int>(raw->xdim), static_cast<int>(raw->ydim), static_cast<int>(raw->zdim)};
  image.grid.axis = {{{raw->vx, 0, 0}, {0, raw->vy, 0}, {0, 0, raw->vz}}};
  image.grid.origin = {raw->tx, raw->ty, raw->tz};
  image.values.resize(image.grid.voxels());
  const bool is_signed = raw->sign == SGN_SIGNED;
  if (raw->wordKind == WK_FLOAT && raw->wdim == 4)
    copy_values<float>(*raw, image.values);
  else if (raw->wordKind == WK_FLOAT && raw->wdim == 8)
    copy_values<double>(*raw, image.values);
  else if (raw->wordKind == WK_FLOAT)
    throw InputError(fmt::format("{}: a float of {} bytes", file.string(), raw->wdim));
  else if (raw->wdim == 1)
    is_signed ? copy_values<std::int8_t>(*raw, image.values) : copy_values<std::uint8_t>(*raw, image.values);
  else if (raw->wdim == 2)
    is_signed ? copy_values<std::int16_t>(*raw, image.values) : copy_values<std::uint16_t>(*raw, image.values);
  else if (raw->wdim == 4)
    is_signed ? copy_values<std::int32_t>(*raw, image.values) : copy_values<std::uint32_t>(*raw, image.values);
  else
    is_signed ? copy_values<std::int64_t>(*raw, image.values) : copy_values<std::uint64_t>(*raw, image.values);
  return image;
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
    check_png_header(slices[k]);
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

LabelImage read_any(const std::vector<std::string>& inputs, const std::optional<std::array<double, 3>>& spacing) {
  const std::string& name = inputs.front();
  if (std::filesystem::is_directory(name) || ends_with_any(name, {".png"})) {
    if (!spacing) throw InputError(fmt::format("{}: PNG slices carry no voxel size; give --spacing x,y,z in mm", name));
    check_spacing(name, *spacing);
    return read_png_stack(inputs, *spacing);
  }
  if (inputs.size() > 1) throw InputError(fmt::format("{}: several inputs are read as PNG slices only", inputs[1]));
  if (spacing) throw InputError(fmt::format("{}: --spacing is for PNG slices; this image has its own", name));
  if (ends_with_any(name, {".inr", ".inr.gz"})) return read_inr(name);
  if (ends_with_any(name, {".nrrd", ".nhdr"})) return read_nrrd(name);
  if (ends_with_any(name, {".mha", ".mhd"})) return read_meta(name);
  if (ends_with_any(name, {".nii", ".nii.gz", ".hdr"})) return read_nifti(name);
  throw InputError(
      fmt::format("{}: expected an image (.inr .inr.gz .nrrd .nhdr .nii .nii.gz .mha .mhd, PNG slices)", name));
}

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
}

}  // namespace

LabelImage read_label_image(const std::vector<std::string>& inputs,
                            const std::optional<std::array<double, 3>>& spacing) {
  LabelImage image = read_any(inputs, spacing);
  check_grid(inputs.front(), image.grid);
  image.names = read_label_names(inputs.front());
  return image;
}

}  // namespace palpate
