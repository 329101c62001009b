// NRRD. Source: "Definition of NRRD File Format", teem.sourceforge.net/nrrd/format.html.
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <optional>
#include <string_view>
#include <utility>

#include "formats/byte_order_mark.h"
#include "formats/errors.h"
#include "meshing/image/file_bytes.h"
#include "meshing/image/image_header.h"

namespace palpate {
namespace {

using std::filesystem::path;
using Vector = std::vector<double>;

VoxelNumber number_type(const TextHeader& header) {
  static constexpr std::pair<VoxelNumber, std::string_view> known[] = {
      {VoxelNumber::int8, ",signed char,int8,int8_t,"},
      {VoxelNumber::uint8, ",uchar,unsigned char,uint8,uint8_t,"},
      {VoxelNumber::int16, ",short,short int,signed short,signed short int,int16,int16_t,"},
      {VoxelNumber::uint16, ",ushort,unsigned short,unsigned short int,uint16,uint16_t,"},
      {VoxelNumber::int32, ",int,signed int,int32,int32_t,"},
      {VoxelNumber::uint32, ",uint,unsigned int,uint32,uint32_t,"},
      {VoxelNumber::int64, ",longlong,long long,long long int,signed long long,signed long long int,int64,int64_t,"},
      {VoxelNumber::uint64, ",ulonglong,unsigned long long,unsigned long long int,uint64,uint64_t,"},
      {VoxelNumber::float32, ",float,"},
      {VoxelNumber::float64, ",double,"}};
  const std::string name = fmt::format(",{},", lower_case(header.at("type")));
  for (const auto& [number, names] : known)
    if (names.find(name) != std::string_view::npos) return number;
  throw InputError(
      fmt::format("{}: type: expected a NRRD number type, found '{}'", header.file.string(), header.at("type")));
}

// "(2,0,0) none (0, 3, 0)" -> one entry for each axis; none for one that is no direction in space.
std::vector<std::optional<Vector>> vectors_of(const TextHeader& header, const std::string& field) {
  const std::string& text = header.at(field);
  std::vector<std::optional<Vector>> vectors;
  for (std::size_t at = text.find_first_not_of(" \t"); at != std::string::npos;) {
    const bool in_brackets = text[at] == '(';
    const std::size_t end = std::min(in_brackets ? text.find(')', at) : text.find_first_of(" \t", at), text.size());
    if (in_brackets) {
      std::string inside = text.substr(at + 1, end - at - 1);
      std::replace(inside.begin(), inside.end(), ',', ' ');
      Vector& vector = vectors.emplace_back().emplace();
      for (const std::string& word : words_of(inside)) vector.push_back(header_number(header.file, field, word));
    } else if (text.substr(at, end - at) == "none") {
      vectors.emplace_back();
    } else {
      throw InputError(fmt::format("{}: header field '{}': expected (x,y,z) or none, found '{}'; correct the header",
                                   header.file.string(), field, text.substr(at, end - at)));
    }
    at = text.find_first_not_of(" \t", std::min(end + 1, text.size()));
  }
  return vectors;
}

// "mm" "cm" -> mm, cm
std::vector<std::string> quoted_words(const std::string& text) {
  std::vector<std::string> words;
  for (std::size_t at = text.find('"'); at != std::string::npos; at = text.find('"', at + 1)) {
    const std::size_t end = std::min(text.find('"', at + 1), text.size());
    words.push_back(text.substr(at + 1, end - at - 1));
    if ((at = end) == text.size()) break;
  }
  return words;
}

// "layer 0: organ = 1; layer 1: lesion = 1", as 3D Slicer names the segments of a layered segmentation.
std::string segments_of_layers(const TextHeader& header) {
  std::string text;
  const auto note = [&](const std::string& key) {
    const auto found = header.notes.find(key);
    return found == header.notes.end() ? std::string("?") : found->second;
  };
  for (int s = 0; header.notes.contains(fmt::format("Segment{}_Layer", s)); ++s) {
    const std::string segment = fmt::format("Segment{}_", s);
    text += fmt::format("{}layer {}: {} = {}", text.empty() ? "" : "; ", note(segment + "Layer"),
                        note(segment + "Name"), note(segment + "LabelValue"));
  }
  return text;
}

[[noreturn]] void refuse_values(const TextHeader& header, double values, std::size_t axis) {
  const std::string segments = segments_of_layers(header);
  if (!segments.empty()) {
    throw InputError(fmt::format(
        "{}: expected one label per voxel, found a segmentation of {} layers, which may overlap ({}); in 3D Slicer's "
        "module Segmentations, section Export, export it as a labelmap, and save that",
        header.file.string(), values, segments));
  }
  throw InputError(
      fmt::format("{}: expected one three-dimensional scalar image, found {} values along axis {}; extract one",
                  header.file.string(), values, axis + 1));
}

// How a named space turns to LPS. known: false for a space that does not say where the patient's left is.
struct Space {
  double x = 1, y = 1;
  bool known = true;
};

Space space_of(const TextHeader& header) {
  std::string name = lower_case(header.get("space", ""));
  if (name.ends_with("-time")) name.resize(name.size() - 5);
  if (name.size() == 4 && name.ends_with('t')) name.resize(3);
  if (name == "left-posterior-superior" || name == "lps") return {1, 1};
  if (name == "right-anterior-superior" || name == "ras") return {-1, -1};
  if (name == "left-anterior-superior" || name == "las") return {1, -1};
  if (name.empty() || name == "scanner-xyz" || name == "3d-right-handed" || name == "3d-left-handed")
    return {1, 1, false};
  throw InputError(fmt::format(
      "{}: header field 'space': expected left-posterior-superior, right-anterior-superior or left-anterior-superior, "
      "found '{}'; correct the header",
      header.file.string(), header.get("space", "")));
}

// The unit of each number of a position.
std::array<double, 3> space_units(const TextHeader& header) {
  const std::vector<std::string> names = quoted_words(header.get("space units", ""));
  std::array<double, 3> units{1, 1, 1};
  for (std::size_t c = 0; c < 3 && c < names.size(); ++c)
    units[c] = millimetres_of_unit(header.file, "space units", names[c]);
  return units;
}

struct Axes {
  std::array<std::size_t, 3> in_space{};  // which of the file's axes they are
  std::vector<double> sizes;
};

// Finds the three axes in space. Refuses another axis, of time or of colours, that has more than one entry.
Axes axes_of(const TextHeader& header, const std::vector<std::optional<Vector>>& directions) {
  Axes axes;
  axes.sizes = header.numbers("sizes");
  if (header.number("dimension") != static_cast<double>(axes.sizes.size())) {
    throw InputError(fmt::format("{}: dimension is {}, but sizes has {} numbers; correct the header",
                                 header.file.string(), header.at("dimension"), axes.sizes.size()));
  }
  if (!directions.empty() && directions.size() != axes.sizes.size()) {
    throw InputError(fmt::format("{}: space directions has {} entries, but sizes has {} numbers; correct the header",
                                 header.file.string(), directions.size(), axes.sizes.size()));
  }
  const std::vector<std::string> kinds = words_of(lower_case(header.get("kinds", "")));
  std::size_t found = 0;
  for (std::size_t axis = 0; axis < axes.sizes.size(); ++axis) {
    bool in_space = found < 3;
    if (!directions.empty()) {
      in_space = in_space && directions[axis] && directions[axis]->size() >= 3;
      if (in_space && directions[axis]->size() > 3)  // the last number is time
        in_space = (*directions[axis])[3] == 0;
    } else if (axis < kinds.size()) {
      in_space = in_space &&
                 (kinds[axis] == "domain" || kinds[axis] == "space" || kinds[axis] == "none" || kinds[axis] == "???");
    }
    if (in_space)
      axes.in_space[found++] = axis;
    else if (axes.sizes[axis] != 1)
      refuse_values(header, axes.sizes[axis], axis);
  }
  if (found < 3) {
    throw InputError(fmt::format("{}: expected three dimensions, found {}", header.file.string(), found));
  }
  return axes;
}

void place_by_directions(const TextHeader& header, const Axes& axes,
                         const std::vector<std::optional<Vector>>& directions, VoxelGrid& grid) {
  const Space space = space_of(header);
  if (!space.known) warn_of_no_orientation(header.file, "left, posterior, superior");
  const std::array<double, 3> units = space_units(header);
  const std::array<double, 3> factor = {space.x * units[0], space.y * units[1], units[2]};
  for (int a = 0; a < 3; ++a)
    for (int c = 0; c < 3; ++c) grid.axis[a][c] = factor[c] * (*directions[axes.in_space[a]])[c];
  if (!header.has("space origin")) return;
  const auto origin = vectors_of(header, "space origin");
  const std::array<double, 3> first =
      first_three(header.file, "space origin", origin.size() == 1 && origin[0] ? *origin[0] : Vector{});
  for (int c = 0; c < 3; ++c) grid.origin[c] = factor[c] * first[c];
}

// Without directions in space: along x, y and z, by spacings and the least position of each axis.
void place_by_spacings(const TextHeader& header, const Axes& axes, VoxelGrid& grid) {
  warn_of_no_orientation(header.file, "left, posterior, superior");
  const std::vector<std::string> units = quoted_words(header.get("units", "")),
                                 spacings = words_of(header.at("spacings"));
  const std::string mins_field = header.has("axismins") ? "axismins" : "axis mins";
  const std::vector<std::string> mins = words_of(header.get(mins_field, "")),
                                 centers = words_of(
                                     lower_case(header.get(header.has("centers") ? "centers" : "centerings", "")));
  std::array<double, 3> size{};
  for (int a = 0; a < 3; ++a) {
    const std::size_t axis = axes.in_space[a];
    if (axis >= spacings.size()) {
      throw InputError(
          fmt::format("{}: header field 'spacings': expected a number for each axis, found {}; correct the "
                      "header",
                      header.file.string(), spacings.size()));
    }
    const double unit = axis < units.size() ? millimetres_of_unit(header.file, "units", units[axis]) : 1;
    size[a] = unit * header_number(header.file, "spacings", spacings[axis]);
    grid.axis[a][a] = size[a];
    const double least = axis < mins.size() ? unit * header_number(header.file, mins_field, mins[axis]) : NAN;
    if (!std::isfinite(least)) continue;
    // the least position is the centre of the first voxel, or its outer face where the axis is one of cells
    grid.origin[a] = least + (axis < centers.size() && centers[axis] == "node" ? 0 : size[a] / 2);
  }
  check_spacing(header.file, size);
}

StoredVoxels stored_voxels(const TextHeader& header) {
  StoredVoxels stored{.header = header.file, .data = header.file, .first = header.bytes, .number = number_type(header)};
  const std::string data = header.get(header.has("data file") ? "data file" : "datafile", "");
  if (data.starts_with("LIST") || data.find('%') != std::string::npos) {
    throw InputError(
        fmt::format("{}: a NRRD split over several data files is not read; join it into one", header.file.string()));
  }
  if (!data.empty()) {
    stored.data = beside(header.file, data);
    stored.first = 0;
  }
  const std::string encoding = lower_case(header.at("encoding"));
  stored.compressed = encoding == "gzip" || encoding == "gz";
  if (!stored.compressed && encoding != "raw") {
    throw InputError(fmt::format("{}: encoding: expected raw or gzip, found '{}'; save it as one of them",
                                 header.file.string(), encoding));
  }
  if (bytes_of(stored.number) > 1) {
    const std::string endian = lower_case(header.at("endian"));
    if (endian != "big" && endian != "little") {
      throw InputError(fmt::format("{}: header field 'endian': expected little or big, found '{}'; correct the header",
                                   header.file.string(), endian));
    }
    stored.big_endian = endian == "big";
  }
  return stored;
}

// Steps over the lines and bytes that the header says to skip. bytes: of all voxels; -1 bytes to skip mean that the voxels
// are the last ones of the file.
void skip(const TextHeader& header, std::uint64_t bytes, StoredVoxels& stored) {
  const auto count = [&](const std::string& name) {
    const std::string joined = name.substr(0, 4) + name.substr(5);
    const double value = header.number(header.has(joined) ? joined : name, 0);
    if (value >= -1 && value < 1e12 && value == std::floor(value)) return value;
    throw InputError(fmt::format("{}: header field '{}': expected a count, found {}; correct the header",
                                 header.file.string(), name, value));
  };
  std::ifstream in(stored.data, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(stored.first));
  std::string line;
  for (double lines = count("line skip"); lines > 0 && std::getline(in, line); --lines) stored.first += line.size() + 1;
  const double skipped = count("byte skip");
  if (skipped < 0 && !stored.compressed) {
    const std::uint64_t size = file_bytes(stored.data);
    stored.first = size - std::min(size, bytes);
  } else if (skipped < 0) {
    throw InputError(
        fmt::format("{}: byte skip is -1, which is for the encoding raw; correct the header", header.file.string()));
  } else {
    (stored.compressed ? stored.skipped : stored.first) += static_cast<std::uint64_t>(skipped);
  }
}

}  // namespace

ImageHeader read_nrrd_header(const path& file) {
  std::string head = head_of(file);
  if (!std::string_view(head).substr(byte_order_mark(head)).starts_with("NRRD000")) {
    throw InputError(fmt::format("{}: expected a NRRD image, which begins with NRRD000", file.string()));
  }
  if (head.find("\ndata file:") != std::string::npos || head.find("\ndatafile:") != std::string::npos)
    head += "\n\n";  // a header beside its data may end with its last field
  const TextHeader header = read_text_header(
      file, head, ':', [](const std::string& line) { return trimmed(line).empty(); }, "an empty line");
  ImageHeader image;
  std::vector<std::optional<Vector>> directions;
  if (header.has("space directions")) directions = vectors_of(header, "space directions");
  const Axes axes = axes_of(header, directions);
  std::vector<double> sizes;
  for (const std::size_t axis : axes.in_space) sizes.push_back(axes.sizes[axis]);
  image.grid.size = three_sizes(file, sizes);
  if (directions.empty())
    place_by_spacings(header, axes, image.grid);
  else
    place_by_directions(header, axes, directions, image.grid);
  image.voxels = stored_voxels(header);
  skip(header, image.grid.voxels() * bytes_of(image.voxels.number), image.voxels);
  return image;
}

}  // namespace palpate
