// INR, the format of CGAL's images. Its only documentation is the readers: CGAL/ImageIO/inr_impl.h.
#include <fmt/format.h>

#include <map>

#include "formats/errors.h"
#include "formats/program.h"
#include "meshing/image/file_bytes.h"
#include "meshing/image/image_header.h"

namespace palpate {
namespace {

VoxelNumber number_type(const TextHeader& header) {
  const std::vector<std::string> pixel = words_of(header.at("pixsize"));
  const double bits = header_number(header.file, "pixsize", pixel.empty() ? "" : pixel[0]);
  const std::string type = lower_case(header.at("type"));
  static const std::map<std::pair<std::string, double>, VoxelNumber> known = {
      {{"signed fixed", 8}, VoxelNumber::int8},   {{"unsigned fixed", 8}, VoxelNumber::uint8},
      {{"signed fixed", 16}, VoxelNumber::int16}, {{"unsigned fixed", 16}, VoxelNumber::uint16},
      {{"signed fixed", 32}, VoxelNumber::int32}, {{"unsigned fixed", 32}, VoxelNumber::uint32},
      {{"signed fixed", 64}, VoxelNumber::int64}, {{"unsigned fixed", 64}, VoxelNumber::uint64},
      {{"float", 32}, VoxelNumber::float32},      {{"float", 64}, VoxelNumber::float64}};
  const auto found = known.find({type, bits});
  if (found == known.end()) {
    throw InputError(fmt::format(
        "{}: TYPE, PIXSIZE: expected signed fixed or unsigned fixed of 8, 16, 32 or 64 bits, or float of 32 "
        "or 64 bits, found '{}' of {} bits",
        header.file.string(), header.at("type"), bits));
  }
  return found->second;
}

bool is_big_endian(const TextHeader& header) {
  const std::string cpu = lower_case(header.at("cpu"));
  if (cpu == "sun" || cpu == "sgi") return true;
  if (cpu == "decm" || cpu == "alpha" || cpu == "pc") return false;
  throw InputError(fmt::format("{}: CPU: expected decm, alpha, pc, sun or sgi, found '{}'", header.file.string(), cpu));
}

}  // namespace

ImageHeader read_inr_header(const std::filesystem::path& file) {
  const std::string head = read_head(file, kLongestHeader);
  if (!head.starts_with("#INRIMAGE-4#{")) {
    throw InputError(fmt::format("{}: expected an INR image, which begins with #INRIMAGE-4#{{", file.string()));
  }
  const TextHeader header = read_text_header(
      file, head, '=', [](const std::string& line) { return line.starts_with("##}"); }, "##}");
  if (header.number("vdim", 1) != 1) {
    throw InputError(
        fmt::format("{}: VDIM: expected one value per voxel, found {}", file.string(), header.number("vdim")));
  }
  for (const char* turn : {"rx", "ry", "rz"}) {
    if (header.number(turn, 0) == 0) continue;
    warn(
        fmt::format("{}: the header turns the image by RX, RY and RZ, which are not read; its axes are taken as left, "
                    "posterior, superior",
                    file.string()));
    break;
  }
  ImageHeader image;
  image.grid.size = three_sizes(file, {header.number("xdim"), header.number("ydim"), header.number("zdim")});
  const std::array<double, 3> spacing = {header.number("vx"), header.number("vy"), header.number("vz")};
  check_spacing(file, spacing);
  for (int axis = 0; axis < 3; ++axis) image.grid.axis[axis][axis] = spacing[axis];
  image.grid.origin = {header.number("tx", 0), header.number("ty", 0), header.number("tz", 0)};
  image.voxels = {.header = file, .data = file, .number = number_type(header), .big_endian = is_big_endian(header)};
  if (is_gzip(file)) {
    image.voxels.compressed = true;
    image.voxels.skipped = header.bytes;
  } else {
    image.voxels.first = header.bytes;
  }
  return image;
}

}  // namespace palpate
