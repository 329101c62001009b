// MetaImage. Source: the documentation of MetaIO, itk.org/Wiki/MetaIO/Documentation. CompressedDataSize is not used: a
// compressed stream says itself where it ends.
#include <fmt/format.h>

#include <cmath>
#include <map>

#include "formats/errors.h"
#include "formats/program.h"
#include "meshing/image/file_bytes.h"
#include "meshing/image/image_header.h"

namespace palpate {
namespace {

// The value of the first of the names that the header has.
std::string first_of(const TextHeader& header, std::initializer_list<const char*> names, const std::string& otherwise) {
  for (const char* name : names)
    if (header.has(name)) return header.at(name);
  return otherwise;
}

bool is_true(const std::string& text) {
  return lower_case(text).starts_with('t') || text == "1";
}

VoxelNumber number_type(const TextHeader& header) {
  static const std::map<std::string, VoxelNumber> known = {
      {"met_char", VoxelNumber::int8},       {"met_uchar", VoxelNumber::uint8},
      {"met_short", VoxelNumber::int16},     {"met_ushort", VoxelNumber::uint16},
      {"met_int", VoxelNumber::int32},       {"met_uint", VoxelNumber::uint32},
      {"met_long", VoxelNumber::int32},      {"met_ulong", VoxelNumber::uint32},
      {"met_long_long", VoxelNumber::int64}, {"met_ulong_long", VoxelNumber::uint64},
      {"met_float", VoxelNumber::float32},   {"met_double", VoxelNumber::float64}};
  const auto found = known.find(lower_case(header.at("elementtype")));
  if (found == known.end()) {
    throw InputError(fmt::format("{}: ElementType: expected a scalar MetaImage type, found '{}'", header.file.string(),
                                 header.at("elementtype")));
  }
  return found->second;
}

StoredVoxels stored_voxels(const TextHeader& header, std::uint64_t voxels) {
  StoredVoxels stored{.header = header.file, .data = header.file, .first = header.bytes, .number = number_type(header)};
  stored.big_endian = is_true(first_of(header, {"binarydatabyteordermsb", "elementbyteordermsb"}, "false"));
  const std::string& name = header.at("elementdatafile");
  if (name.starts_with("LIST") || name.find('%') != std::string::npos) {
    throw InputError(fmt::format("{}: a MetaImage split over several data files is not read; join it into one",
                                 header.file.string()));
  }
  const bool local = lower_case(name) == "local";
  if (!local) {
    stored.data = beside(header.file, name);
    stored.first = 0;
  }
  const double skipped = header.number("headersize", 0);
  if (!(skipped >= -1 && skipped < 1e12))
    throw InputError(fmt::format("{}: HeaderSize: expected a count of bytes, found {}", header.file.string(), skipped));
  if (is_true(header.get("compresseddata", "false"))) {
    stored.compressed = true;
  } else if (!is_true(header.get("binarydata", "true"))) {
    throw InputError(fmt::format("{}: BinaryData: expected True, found '{}'; save its voxels as bytes",
                                 header.file.string(), header.at("binarydata")));
  } else if (skipped < 0) {  // the voxels are the last bytes of the file
    const std::uint64_t size = file_bytes(stored.data);
    stored.first = size - std::min(size, voxels * bytes_of(stored.number));
  }
  if (skipped > 0) stored.first = std::max(stored.first, static_cast<std::uint64_t>(skipped));
  return stored;
}

}  // namespace

ImageHeader read_meta_header(const std::filesystem::path& file) {
  std::string head = head_of(file);
  if (!head.ends_with('\n')) head += '\n';
  const TextHeader header = read_text_header(
      file, head, '=', [](const std::string& line) { return lower_case(trimmed(line)).starts_with("elementdatafile"); },
      "ElementDataFile");
  const std::vector<double> sizes = header.numbers("dimsize");
  if (header.number("ndims") != static_cast<double>(sizes.size())) {
    throw InputError(
        fmt::format("{}: NDims is {}, but DimSize has {} numbers", file.string(), header.at("ndims"), sizes.size()));
  }
  if (header.number("elementnumberofchannels", 1) != 1) {
    throw InputError(fmt::format("{}: expected one value per voxel, found {}; extract one", file.string(),
                                 header.at("elementnumberofchannels")));
  }
  ImageHeader image;
  image.grid.size = three_sizes(file, sizes);

  std::array<double, 3> spacing{1, 1, 1};
  if (header.has("elementspacing") || header.has("elementsize")) {
    const char* const field = header.has("elementspacing") ? "elementspacing" : "elementsize";
    spacing = first_three(file, field, header.numbers(field));
  } else {
    warn(fmt::format("{}: the header gives no ElementSpacing; its voxels are taken as 1 mm", file.string()));
  }
  check_spacing(file, spacing);
  const double unit = millimetres_of_unit(file, "distanceunits", header.get("distanceunits", ""));

  // One row for each axis, with as many numbers as the image has dimensions.
  std::string matrix_field;
  for (const char* name : {"orientation", "rotation", "transformmatrix"})
    if (header.has(name)) matrix_field = name;
  std::vector<double> matrix;
  if (matrix_field.empty())
    warn_of_no_orientation(file, "left, posterior, superior");
  else
    matrix = header.numbers(matrix_field);
  if (!matrix.empty() && matrix.size() != sizes.size() * sizes.size()) {
    throw InputError(fmt::format("{}: header field '{}': expected {} numbers, found {}; correct the header",
                                 file.string(), matrix_field, sizes.size() * sizes.size(), matrix.size()));
  }
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t c = 0; c < 3; ++c) {
      const double direction = matrix.empty() ? (a == c ? 1.0 : 0.0) : matrix[a * sizes.size() + c];
      image.grid.axis[a][c] = unit * spacing[a] * direction;
    }
  for (const char* name : {"origin", "position", "offset"})
    if (header.has(name)) image.grid.origin = first_three(file, name, header.numbers(name));
  for (double& c : image.grid.origin) c *= unit;
  image.voxels = stored_voxels(header, image.grid.voxels());
  return image;
}

}  // namespace palpate
