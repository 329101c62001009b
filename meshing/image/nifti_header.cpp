// NIfTI-1. Source: nifti1.h.
#include <fmt/format.h>

#include <cmath>
#include <map>

#include "formats/errors.h"
#include "meshing/image/file_bytes.h"
#include "meshing/image/image_header.h"

namespace palpate {
namespace {

class Fields {
 public:
  // Errors: InputError unless this is the header of a NIfTI-1 image.
  explicit Fields(const std::filesystem::path& file) : head_(read_head(file, 352)) {
    const std::string name = file.string();
    if (head_.size() < 348)
      throw InputError(fmt::format("{}: expected a NIfTI header of 348 bytes, found {}", name, head_.size()));
    const auto first = number_at<std::int32_t>(head_, 0, false);
    swap_ = first != 348;
    if (swap_ && number_at<std::int32_t>(head_, 0, true) != 348) {
      const bool version_2 = first == 540 || number_at<std::int32_t>(head_, 0, true) == 540;
      throw InputError(fmt::format("{}: expected a NIfTI-1 header (its first number is 348), found {}{}", name, first,
                                   version_2 ? "; convert NIfTI-2 to NIfTI-1" : ""));
    }
    const std::string magic = head_.substr(344, 3);
    if (magic != "n+1" && magic != "ni1") {
      throw InputError(
          fmt::format("{}: expected a NIfTI-1 file (magic n+1 or ni1); Analyze images have no orientation", name));
    }
  }
  template <class T>
  T at(std::size_t offset) const {
    return number_at<T>(head_, offset, swap_);
  }
  bool swap() const { return swap_; }

 private:
  std::string head_;
  bool swap_ = false;
};

double millimetres_of(int xyzt_units) {
  switch (xyzt_units & 7) {
    case 1:
      return 1000;
    case 3:
      return 1e-3;
    default:
      return 1;  // code 2 is mm; code 0 states no unit
  }
}

// The axes are the columns of the rotation of the unit quaternion (a, b, c, d), a >= 0, each times its voxel size.
// qfac = -1 reverses the third axis. Source: nifti1.h, method 2.
void apply_qform(const Fields& fields, VoxelGrid& grid) {
  const double b = fields.at<float>(256), c = fields.at<float>(260), d = fields.at<float>(264);
  const double a = std::sqrt(std::max(0.0, 1 - b * b - c * c - d * d));
  const double qfac = fields.at<float>(76) < 0 ? -1 : 1;
  const std::array<std::array<double, 3>, 3> columns = {
      {{a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)},
       {2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)},
       {2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c}}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double step = fields.at<float>(80 + 4 * axis) * (axis == 2 ? qfac : 1);
    for (std::size_t i = 0; i < 3; ++i) grid.axis[axis][i] = step * columns[axis][i];
    grid.origin[axis] = fields.at<float>(268 + 4 * axis);
  }
}

void apply_sform(const Fields& fields, VoxelGrid& grid) {
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis) grid.axis[axis][row] = fields.at<float>(280 + 16 * row + 4 * axis);
    grid.origin[row] = fields.at<float>(280 + 16 * row + 12);
  }
}

// The voxel sizes count only where the sform, which states the axes with their lengths, is not used.
VoxelGrid grid_of(const std::filesystem::path& file, const Fields& fields) {
  VoxelGrid grid;
  const int dimensions = fields.at<std::int16_t>(40);
  if (dimensions < 3 || dimensions > 7)
    throw InputError(fmt::format("{}: dim[0]: expected 3 dimensions, found {}", file.string(), dimensions));
  std::vector<double> sizes;
  for (std::size_t d = 1; d <= static_cast<std::size_t>(dimensions); ++d)
    sizes.push_back(fields.at<std::int16_t>(40 + 2 * d));
  grid.size = three_sizes(file, sizes);
  if (fields.at<std::int16_t>(254) <= 0)
    check_spacing(file, {fields.at<float>(80), fields.at<float>(84), fields.at<float>(88)});
  if (fields.at<std::int16_t>(254) > 0) {
    apply_sform(fields, grid);
  } else if (fields.at<std::int16_t>(252) > 0) {
    apply_qform(fields, grid);
  } else {
    warn_of_no_orientation(file, "right, anterior, superior");
    for (std::size_t axis = 0; axis < 3; ++axis) grid.axis[axis][axis] = fields.at<float>(80 + 4 * axis);
  }
  const double scale = millimetres_of(fields.at<std::int8_t>(123));
  for (int i = 0; i < 3; ++i) {
    const double turned = i < 2 ? -scale : scale;  // RAS -> LPS
    for (auto& axis : grid.axis) axis[i] *= turned;
    grid.origin[i] *= turned;
  }
  return grid;
}

VoxelNumber number_type(const std::filesystem::path& file, const Fields& fields) {
  static const std::map<int, VoxelNumber> known = {
      {2, VoxelNumber::uint8},    {4, VoxelNumber::int16},    {8, VoxelNumber::int32},    {16, VoxelNumber::float32},
      {64, VoxelNumber::float64}, {256, VoxelNumber::int8},   {512, VoxelNumber::uint16}, {768, VoxelNumber::uint32},
      {1024, VoxelNumber::int64}, {1280, VoxelNumber::uint64}};
  const int type = fields.at<std::int16_t>(70), bits = fields.at<std::int16_t>(72);
  const auto found = known.find(type);
  if (found == known.end()) {
    throw InputError(fmt::format("{}: datatype: expected one number per voxel, found type {}", file.string(), type));
  }
  if (const std::uint64_t expected = 8 * bytes_of(found->second);
      bits < 0 || static_cast<std::uint64_t>(bits) != expected) {
    throw InputError(fmt::format("{}: bitpix is {} for datatype {}, expected {}", file.string(), bits, type, expected));
  }
  return found->second;
}

}  // namespace

ImageHeader read_nifti_header(const std::filesystem::path& file) {
  const Fields fields(file);
  ImageHeader image;
  image.grid = grid_of(file, fields);
  StoredVoxels& stored = image.voxels;
  stored = {.header = file, .data = file, .number = number_type(file, fields)};
  // number_at has swapped the bytes of a header in the other order than this machine's
  stored.big_endian = fields.swap() != (std::endian::native == std::endian::big);
  const bool together = fields.at<char>(345) == '+';  // magic "n+1"; with "ni1" the voxels lie in a second file
  if (!together) {
    stored.data.replace_extension(".img");
    if (!std::filesystem::exists(stored.data)) stored.data += ".gz";
  }
  const double offset = fields.at<float>(108);
  if (!(offset >= 0 && offset < 1e9)) {
    throw InputError(fmt::format("{}: vox_offset: expected a byte offset, found {}", file.string(), offset));
  }
  file_bytes(stored.data);
  const bool compressed = is_gzip(stored.data);
  if (compressed) stored.compressed = true;
  (compressed ? stored.skipped : stored.first) =
      static_cast<std::uint64_t>(together ? std::max(offset, 352.0) : offset);
  const float slope = fields.at<float>(112), intercept = fields.at<float>(116);
  if (std::isfinite(slope) && std::isfinite(intercept) && slope != 0) {
    stored.slope = slope;
    stored.intercept = intercept;
  }
  return image;
}

}  // namespace palpate
