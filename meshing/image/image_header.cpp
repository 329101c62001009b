#include "meshing/image/image_header.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <map>

#include "formats/errors.h"
#include "formats/program.h"
#include "meshing/image/file_bytes.h"

namespace palpate {

using std::filesystem::path;

std::array<int, 3> three_sizes(const path& file, const std::vector<double>& sizes) {
  if (sizes.size() < 3) {
    throw InputError(fmt::format("{}: expected three dimensions, found {}", file.string(), sizes.size()));
  }
  for (std::size_t axis = 3; axis < sizes.size(); ++axis) {
    if (sizes[axis] == 1) continue;
    throw InputError(
        fmt::format("{}: expected one three-dimensional scalar image, found {} values along axis {}; extract one",
                    file.string(), sizes[axis], axis + 1));
  }
  std::uint64_t bytes = sizeof(double);
  for (int axis = 0; axis < 3; ++axis) {
    if (!(sizes[axis] >= 1 && sizes[axis] <= 2147483647.0) || sizes[axis] != std::floor(sizes[axis]) ||
        __builtin_mul_overflow(bytes, static_cast<std::uint64_t>(sizes[axis]), &bytes)) {
      throw InputError(
          fmt::format("{}: expected image dimensions of at least 1 whose product fits a file, found {} x {} x {}",
                      file.string(), sizes[0], sizes[1], sizes[2]));
    }
  }
  return {static_cast<int>(sizes[0]), static_cast<int>(sizes[1]), static_cast<int>(sizes[2])};
}

void check_spacing(const path& file, const std::array<double, 3>& spacing) {
  for (const double s : spacing) {
    if (std::isfinite(s) && s > 0) continue;
    throw InputError(fmt::format("{}: expected voxel sizes above 0, found {} x {} x {}; correct the header",
                                 file.string(), spacing[0], spacing[1], spacing[2]));
  }
}

std::array<double, 3> first_three(const path& file, const std::string& field, const std::vector<double>& numbers) {
  if (numbers.size() < 3) {
    throw InputError(fmt::format("{}: header field '{}': expected three numbers or more, found {}; correct the header",
                                 file.string(), field, numbers.size()));
  }
  return {numbers[0], numbers[1], numbers[2]};
}

std::string head_of(const path& file) {
  file_bytes(file);
  std::ifstream in(file, std::ios::binary);
  std::string head(kLongestHeader, '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  return head;
}

void warn_of_no_orientation(const path& file, const char* taken) {
  warn(fmt::format("{}: the header gives no orientation; its axes are taken as {}", file.string(), taken));
}

double millimetres_of_unit(const path& file, const std::string& field, const std::string& unit) {
  static const std::map<std::string, double> known = {
      {"", 1},           {"?", 1},           {"???", 1},        {"unknown", 1},   {"mm", 1},        {"millimeter", 1},
      {"millimetre", 1}, {"millimeters", 1}, {"cm", 10},        {"m", 1000},      {"meter", 1000},  {"metre", 1000},
      {"um", 1e-3},      {"\u00b5m", 1e-3},  {"\u03bcm", 1e-3}, {"micron", 1e-3}, {"microns", 1e-3}};
  const auto found = known.find(lower_case(trimmed(unit)));
  if (found == known.end()) {
    throw InputError(fmt::format("{}: header field '{}': expected mm, cm, m or um, found '{}'; correct the header",
                                 file.string(), field, unit));
  }
  return found->second;
}

path beside(const path& header, const std::string& name) {
  const path data(name);
  return data.is_absolute() ? data : header.parent_path() / data;
}

}  // namespace palpate
