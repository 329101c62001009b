#include "meshing/image/read_nifti.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include "formats/errors.h"
#include "formats/program.h"
#include "meshing/image/file_bytes.h"
#include "meshing/image/image_header.h"

namespace palpate {
namespace {

class Fields {
 public:
  explicit Fields(std::string head) : head_(std::move(head)) {
    std::int32_t size = 0;
    std::memcpy(&size, head_.data(), 4);
    swap_ = size != 348;
  }
  template <class T>
  T at(std::size_t offset) const {
    return swapped<T>(head_.data() + offset);
  }
  template <class T>
  T swapped(const char* bytes) const {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes, sizeof(T));
    if (swap_) std::reverse(raw.begin(), raw.end());
    T value;
    std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }

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

VoxelGrid grid_of(const std::filesystem::path& file, const Fields& fields) {
  VoxelGrid grid;
  for (std::size_t d = 0; d < 3; ++d) grid.size[d] = fields.at<std::int16_t>(42 + 2 * d);
  if (fields.at<std::int16_t>(254) > 0) {
    apply_sform(fields, grid);
  } else if (fields.at<std::int16_t>(252) > 0) {
    apply_qform(fields, grid);
  } else {
    warn(fmt::format("{}: the header gives no orientation; its axes are taken as right, anterior, superior",
                     file.string()));
    for (std::size_t axis = 0; axis < 3; ++axis) grid.axis[axis][axis] = fields.at<float>(80 + 4 * axis);
  }
  const double scale = millimetres_of(fields.at<std::int8_t>(123));
  for (int i = 0; i < 3; ++i) {
    const double turned = i < 2 ? -scale : scale;  // RAS -> LPS
    for (auto& axis : grid.axis) axis[i] *= turned;
    grid.origin[i] *= turned;
    if (!std::isfinite(grid.origin[i]))
      throw InputError(fmt::format("{}: the origin is not a finite point", file.string()));
  }
  check_spacing(file, grid.spacing());
  if (!(grid.voxel_volume() > 1e-6 * grid.spacing()[0] * grid.spacing()[1] * grid.spacing()[2])) {
    throw InputError(fmt::format("{}: expected directions that span space, found a voxel of volume {} mm3",
                                 file.string(), grid.voxel_volume()));
  }
  return grid;
}

template <class T>
void decode(const Fields& fields, const std::string& bytes, std::vector<float>& values) {
  for (std::size_t v = 0; v < values.size(); ++v) {
    values[v] = static_cast<float>(fields.swapped<T>(bytes.data() + v * sizeof(T)));
  }
}

}  // namespace

LabelImage read_nifti(const std::filesystem::path& file) {
  check_nifti_header(file);
  const Fields fields(read_head(file, 352));
  LabelImage image;
  image.grid = grid_of(file, fields);
  image.values.resize(image.grid.voxels());

  // check_nifti_header has made sure that the file holds all voxels
  const bool together = fields.at<char>(345) == '+';  // magic "n+1"; with "ni1" the voxels lie in a second file
  std::filesystem::path data = file;
  if (!together) {
    data.replace_extension(".img");
    if (!std::filesystem::exists(data)) data += ".gz";
  }
  const auto width = static_cast<std::size_t>(fields.at<std::int16_t>(72) / 8);
  const double offset = fields.at<float>(108);
  std::string bytes(image.values.size() * width, '\0');
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> in(gzopen(data.c_str(), "rb"), gzclose);
  if (!in || gzseek(in.get(), static_cast<z_off_t>(together ? std::max(offset, 352.0) : offset), SEEK_SET) < 0) {
    throw InputError(fmt::format("{}: cannot be read", data.string()));
  }
  for (std::size_t done = 0; done < bytes.size();) {
    const auto part = static_cast<unsigned>(std::min<std::size_t>(bytes.size() - done, 1u << 30));
    const int count = gzread(in.get(), bytes.data() + done, part);
    if (count <= 0) throw InputError(fmt::format("{}: cannot be read to its end", data.string()));
    done += static_cast<std::size_t>(count);
  }

  const int type = fields.at<std::int16_t>(70);
  const auto expect_width = [&](std::size_t bytes_per_voxel) {
    if (width != bytes_per_voxel) {
      throw InputError(fmt::format("{}: bitpix is {} for datatype {}, expected {}", file.string(), 8 * width, type,
                                   8 * bytes_per_voxel));
    }
  };
  const auto decode_as = [&](auto example) {
    expect_width(sizeof example);
    decode<decltype(example)>(fields, bytes, image.values);
  };
  switch (type) {
    case 2:
      decode_as(std::uint8_t{});
      break;
    case 4:
      decode_as(std::int16_t{});
      break;
    case 8:
      decode_as(std::int32_t{});
      break;
    case 16:
      decode_as(float{});
      break;
    case 64:
      decode_as(double{});
      break;
    case 256:
      decode_as(std::int8_t{});
      break;
    case 512:
      decode_as(std::uint16_t{});
      break;
    case 768:
      decode_as(std::uint32_t{});
      break;
    case 1024:
      decode_as(std::int64_t{});
      break;
    case 1280:
      decode_as(std::uint64_t{});
      break;
    default:
      throw InputError(fmt::format("{}: datatype: expected one number per voxel, found type {}", file.string(), type));
  }
  const float slope = fields.at<float>(112), intercept = fields.at<float>(116);
  if (std::isfinite(slope) && std::isfinite(intercept) && slope != 0 && (slope != 1 || intercept != 0)) {
    for (float& v : image.values) v = slope * v + intercept;
  }
  return image;
}

}  // namespace palpate
