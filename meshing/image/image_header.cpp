#include "meshing/image/image_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <vector>

#include "formats/errors.h"
#include "meshing/image/file_bytes.h"

namespace palpate {
namespace {

using std::filesystem::path;

constexpr std::size_t kLongestHeader = 1 << 20;  // 3D Slicer writes about 1 kB for each segment

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::vector<std::string> words(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> all;
  for (std::string word; in >> word;) all.push_back(word);
  return all;
}

double number(const path& file, const std::string& field, const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw InputError(fmt::format("{}: header field '{}': expected a number, found '{}'", file.string(), field, text));
  }
  return value;
}

// The fields of a text header.
struct TextHeader {
  std::map<std::string, std::string> fields;  // keys in lower case
  std::size_t bytes = 0;                      // length of the header
  bool complete = false;

  const std::string& at(const path& file, const std::string& name) const {
    const auto found = fields.find(name);
    if (found == fields.end()) {
      throw InputError(fmt::format("{}: the header has no field '{}'; the file is not what its name says, or damaged",
                                   file.string(), name));
    }
    return found->second;
  }
  std::string get(const std::string& name, const std::string& otherwise) const {
    const auto found = fields.find(name);
    return found == fields.end() ? otherwise : found->second;
  }
};

// Reads lines of the form "name SEPARATOR value" up to the line for which is_last returns true. Refuses a field that
// is given twice, because some libraries use the first value and others the last.
template <class IsLast>
TextHeader read_text_header(const path& file, const std::string& head, char separator, const IsLast& is_last) {
  TextHeader header;
  std::size_t start = 0;
  while (start < head.size()) {
    const std::size_t end = head.find('\n', start);
    if (end == std::string::npos) break;
    const std::string line = head.substr(start, end - start);
    start = end + 1;
    const auto at = line.find(separator);
    if (at != std::string::npos && !line.starts_with('#')) {
      const std::string name = lower(trimmed(line.substr(0, at)));
      if (!header.fields.emplace(name, trimmed(line.substr(at + 1))).second) {
        throw InputError(fmt::format("{}: header field '{}' is given twice; remove one", file.string(), name));
      }
    }
    if (is_last(line)) {
      header.bytes = start;
      header.complete = true;
      break;
    }
  }
  return header;
}

void expect_complete(const path& file, const TextHeader& header, const char* end) {
  if (header.complete) return;
  throw InputError(
      fmt::format("{}: expected a header that ends with {}, found none in its first {} bytes; the file is cut "
                  "off or not what its name says",
                  file.string(), end, kLongestHeader));
}

void expect_bytes(const path& file, std::uint64_t needed, std::uint64_t found) {
  if (found >= needed) return;
  throw InputError(
      fmt::format("{}: the header asks for {} bytes of voxels, the file has {}; it is cut off, or its header is "
                  "wrong",
                  file.string(), needed, found));
}

// Reads the numbers of a size field. Accepts three, or more than three when each further number is 1.
std::array<double, 3> three_sizes(const path& file, const std::string& field, const std::vector<std::string>& texts) {
  std::array<double, 3> size{1, 1, 1};
  for (std::size_t axis = 0; axis < texts.size(); ++axis) {
    const double n = number(file, field, texts[axis]);
    if (axis < 3)
      size[axis] = n;
    else if (n != 1) {
      throw InputError(
          fmt::format("{}: expected one three-dimensional scalar image, found {} values along axis {}; extract "
                      "one",
                      file.string(), n, axis + 1));
    }
  }
  if (texts.size() < 3) {
    throw InputError(fmt::format("{}: expected three dimensions, found {}", file.string(), texts.size()));
  }
  return size;
}

template <class T>
T read_at(const std::string& bytes, std::size_t offset, bool swap) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes.data() + offset, sizeof(T));
  if (swap) std::reverse(raw.begin(), raw.end());
  T value;
  std::memcpy(&value, raw.data(), sizeof(T));
  return value;
}

// Returns the path of the data file that a header names: relative to the folder of the header unless the name is
// absolute.
path beside(const path& header, const std::string& name) {
  const path data(name);
  return data.is_absolute() ? data : header.parent_path() / data;
}

}  // namespace

std::uint64_t checked_image_bytes(const path& file, const std::array<double, 3>& size, std::uint64_t bytes_per_voxel) {
  std::uint64_t bytes = bytes_per_voxel;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(size[axis] >= 1 && size[axis] <= 2147483647.0) || size[axis] != std::floor(size[axis]) ||
        __builtin_mul_overflow(bytes, static_cast<std::uint64_t>(size[axis]), &bytes)) {
      throw InputError(
          fmt::format("{}: expected image dimensions of at least 1 whose product fits a file, found {} x {} x {}",
                      file.string(), size[0], size[1], size[2]));
    }
  }
  return bytes;
}

void check_spacing(const path& file, const std::array<double, 3>& spacing) {
  for (const double s : spacing) {
    if (std::isfinite(s) && s > 0) continue;
    throw InputError(fmt::format("{}: expected voxel sizes above 0, found {} x {} x {}; correct the header",
                                 file.string(), spacing[0], spacing[1], spacing[2]));
  }
}

void check_inr_header(const path& file) {
  const std::string head = read_head(file, kLongestHeader);
  if (!head.starts_with("#INRIMAGE-4#{")) {
    throw InputError(fmt::format("{}: expected an INR image, which begins with #INRIMAGE-4#{{", file.string()));
  }
  const TextHeader header =
      read_text_header(file, head, '=', [](const std::string& line) { return line.starts_with("##}"); });
  expect_complete(file, header, "##}");
  const auto value = [&](const std::string& field) { return number(file, field, header.at(file, field)); };
  const std::vector<std::string> pixel = words(header.at(file, "pixsize"));
  const double bits = number(file, "pixsize", pixel.empty() ? "" : pixel[0]);
  if (bits != 8 && bits != 16 && bits != 32 && bits != 64) {
    throw InputError(fmt::format("{}: PIXSIZE: expected 8, 16, 32 or 64 bits, found {}", file.string(), bits));
  }
  if (header.fields.contains("vdim") && value("vdim") != 1) {
    throw InputError(fmt::format("{}: VDIM: expected one value per voxel, found {}", file.string(), value("vdim")));
  }
  check_spacing(file, {value("vx"), value("vy"), value("vz")});
  const std::uint64_t voxels =
      checked_image_bytes(file, {value("xdim"), value("ydim"), value("zdim")}, static_cast<std::uint64_t>(bits) / 8);
  const std::uint64_t present = is_gzip(file) ? inflated_bytes(file, 0) : file_bytes(file);
  expect_bytes(file, voxels, present - std::min<std::uint64_t>(present, header.bytes));
}

void check_nifti_header(const path& file) {
  const std::string head = read_head(file, 540);
  if (head.size() < 348) {
    throw InputError(fmt::format("{}: expected a NIfTI header of 348 bytes, found {}", file.string(), head.size()));
  }
  const bool swap = read_at<std::int32_t>(head, 0, false) != 348;
  if (swap && read_at<std::int32_t>(head, 0, true) != 348) {
    throw InputError(fmt::format("{}: expected a NIfTI-1 header (its first number is 348), found {}{}", file.string(),
                                 read_at<std::int32_t>(head, 0, false),
                                 read_at<std::int32_t>(head, 0, false) == 540 ? "; convert NIfTI-2 to NIfTI-1" : ""));
  }
  const std::string magic = head.substr(344, 3);
  if (magic != "n+1" && magic != "ni1") {
    throw InputError(fmt::format("{}: expected a NIfTI-1 file (magic n+1 or ni1); Analyze images have no orientation",
                                 file.string()));
  }
  const int dimensions = read_at<std::int16_t>(head, 40, swap);
  if (dimensions < 3 || dimensions > 7) {
    throw InputError(fmt::format("{}: dim[0]: expected 3 dimensions, found {}", file.string(), dimensions));
  }
  std::vector<std::string> sizes;
  for (int d = 1; d <= dimensions; ++d) sizes.push_back(std::to_string(read_at<std::int16_t>(head, 40 + 2 * d, swap)));
  const int bits = read_at<std::int16_t>(head, 72, swap);
  if (bits != 8 && bits != 16 && bits != 32 && bits != 64) {
    throw InputError(
        fmt::format("{}: bitpix: expected 8, 16, 32 or 64 bits of one value, found {}", file.string(), bits));
  }
  std::array<double, 3> spacing{};
  for (int d = 0; d < 3; ++d) spacing[d] = read_at<float>(head, 80 + 4 * d, swap);
  check_spacing(file, spacing);
  const std::uint64_t voxels =
      checked_image_bytes(file, three_sizes(file, "dim", sizes), static_cast<std::uint64_t>(bits) / 8);
  const double offset = read_at<float>(head, 108, swap);
  if (!(offset >= 0 && offset < 1e9)) {
    throw InputError(fmt::format("{}: vox_offset: expected a byte offset, found {}", file.string(), offset));
  }
  path data = file;
  if (magic == "ni1") {  // the voxels lie in a second file
    data.replace_extension(".img");
    if (!std::filesystem::exists(data)) data += ".gz";
  }
  const std::uint64_t present = is_gzip(data) ? inflated_bytes(data, 0) : file_bytes(data);
  const auto before = static_cast<std::uint64_t>(magic == "n+1" ? std::max(offset, 352.0) : offset);
  expect_bytes(file, voxels, present - std::min(present, before));
}

void check_nrrd_header(const path& file) {
  file_bytes(file);
  std::ifstream in(file, std::ios::binary);
  std::string head(kLongestHeader, '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  if (!head.starts_with("NRRD000")) {
    throw InputError(fmt::format("{}: expected a NRRD image, which begins with NRRD000", file.string()));
  }
  const bool detached = head.find("\ndata file:") != std::string::npos || head.find("\ndatafile:") != std::string::npos;
  if (detached && !head.ends_with('\n')) head += '\n';
  if (detached) head += '\n';
  const TextHeader header =
      read_text_header(file, head, ':', [](const std::string& line) { return trimmed(line).empty(); });
  expect_complete(file, header, "an empty line");

  static const std::map<std::string, int> bytes_of = {{"signed char", 1},
                                                      {"int8", 1},
                                                      {"int8_t", 1},
                                                      {"uchar", 1},
                                                      {"unsigned char", 1},
                                                      {"uint8", 1},
                                                      {"uint8_t", 1},
                                                      {"short", 2},
                                                      {"short int", 2},
                                                      {"signed short", 2},
                                                      {"signed short int", 2},
                                                      {"int16", 2},
                                                      {"int16_t", 2},
                                                      {"ushort", 2},
                                                      {"unsigned short", 2},
                                                      {"unsigned short int", 2},
                                                      {"uint16", 2},
                                                      {"uint16_t", 2},
                                                      {"int", 4},
                                                      {"signed int", 4},
                                                      {"int32", 4},
                                                      {"int32_t", 4},
                                                      {"uint", 4},
                                                      {"unsigned int", 4},
                                                      {"uint32", 4},
                                                      {"uint32_t", 4},
                                                      {"longlong", 8},
                                                      {"long long", 8},
                                                      {"long long int", 8},
                                                      {"signed long long", 8},
                                                      {"signed long long int", 8},
                                                      {"int64", 8},
                                                      {"int64_t", 8},
                                                      {"ulonglong", 8},
                                                      {"unsigned long long", 8},
                                                      {"unsigned long long int", 8},
                                                      {"uint64", 8},
                                                      {"uint64_t", 8},
                                                      {"float", 4},
                                                      {"double", 8}};
  const std::string type = lower(header.at(file, "type"));
  if (!bytes_of.contains(type)) {
    throw InputError(fmt::format("{}: type: expected a NRRD number type, found '{}'", file.string(), type));
  }
  const std::array<double, 3> size = three_sizes(file, "sizes", words(header.at(file, "sizes")));
  const std::uint64_t voxels = checked_image_bytes(file, size, static_cast<std::uint64_t>(bytes_of.at(type)));
  if (header.fields.contains("spacings")) {
    const std::vector<std::string> texts = words(header.fields.at("spacings"));
    std::array<double, 3> spacing{1, 1, 1};
    for (std::size_t axis = 0; axis < 3 && axis < texts.size(); ++axis) {
      spacing[axis] = number(file, "spacings", texts[axis]);
    }
    check_spacing(file, spacing);
  }
  // When the length of a direction overflows, ITK replaces it by 1 mm without an error. So the size is checked here.
  std::string directions = header.get("space directions", "");
  std::replace_if(
      directions.begin(), directions.end(), [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
  for (const std::string& text : words(directions))
    if (text != "none" && !(std::abs(number(file, "space directions", text)) <= kLargestVoxel))
      throw InputError(
          fmt::format("{}: space directions: expected voxels of at most {:.0e} mm, found {}; correct the header",
                      file.string(), kLargestVoxel, text));

  std::string data_name = header.get("data file", header.get("datafile", ""));
  if (data_name.starts_with("LIST") || data_name.find('%') != std::string::npos) {
    throw InputError(
        fmt::format("{}: a NRRD split over several data files is not read; join it into one", file.string()));
  }
  const path data = data_name.empty() ? file : beside(file, data_name);
  const std::uint64_t first = data_name.empty() ? header.bytes : 0;
  const std::string encoding = lower(header.at(file, "encoding"));
  if (encoding == "raw") {
    const std::uint64_t present = file_bytes(data);
    expect_bytes(file, voxels, present - std::min(present, first));
  } else if (encoding == "gzip" || encoding == "gz") {
    file_bytes(data);
    expect_bytes(file, voxels, inflated_bytes(data, first));
  } else if (encoding == "ascii" || encoding == "text" || encoding == "txt") {
    expect_bytes(file, voxels / static_cast<std::uint64_t>(bytes_of.at(type)),
                 file_bytes(data));  // each voxel takes at least one digit
  } else {
    throw InputError(fmt::format("{}: encoding: expected raw, gzip or ascii, found '{}'", file.string(), encoding));
  }
}

void check_meta_header(const path& file) {
  file_bytes(file);
  std::ifstream in(file, std::ios::binary);
  std::string head(kLongestHeader, '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  if (!head.ends_with('\n')) head += '\n';
  const TextHeader header = read_text_header(
      file, head, '=', [](const std::string& line) { return lower(line).starts_with("elementdatafile"); });
  expect_complete(file, header, "ElementDataFile");
  static const std::map<std::string, int> bytes_of = {{"met_char", 1},       {"met_uchar", 1}, {"met_short", 2},
                                                      {"met_ushort", 2},     {"met_int", 4},   {"met_uint", 4},
                                                      {"met_long", 4},       {"met_ulong", 4}, {"met_long_long", 8},
                                                      {"met_ulong_long", 8}, {"met_float", 4}, {"met_double", 8}};
  const std::string type = lower(header.at(file, "elementtype"));
  if (!bytes_of.contains(type)) {
    throw InputError(fmt::format("{}: ElementType: expected a scalar MetaImage type, found '{}'", file.string(), type));
  }
  const std::vector<std::string> sizes = words(header.at(file, "dimsize"));
  if (number(file, "ndims", header.at(file, "ndims")) != static_cast<double>(sizes.size())) {
    throw InputError(fmt::format("{}: NDims is {}, but DimSize has {} numbers", file.string(), header.at(file, "ndims"),
                                 sizes.size()));
  }
  const std::uint64_t voxels =
      checked_image_bytes(file, three_sizes(file, "dimsize", sizes), static_cast<std::uint64_t>(bytes_of.at(type)));
  const std::string spacing_text = header.get("elementspacing", header.get("elementsize", "1 1 1"));
  std::array<double, 3> spacing{};
  const std::vector<std::string> texts = words(spacing_text);
  for (std::size_t axis = 0; axis < 3 && axis < texts.size(); ++axis) {
    spacing[axis] = number(file, "elementspacing", texts[axis]);
  }
  check_spacing(file, spacing);

  const std::string name = header.at(file, "elementdatafile");
  if (name == "LIST" || name.find('%') != std::string::npos) {
    throw InputError(
        fmt::format("{}: a MetaImage split over several data files is not read; join it into one", file.string()));
  }
  const path data = lower(name) == "local" ? file : beside(file, name);
  const std::uint64_t first = lower(name) == "local" ? header.bytes : 0;
  const std::uint64_t present = file_bytes(data);
  if (lower(header.get("compresseddata", "false")) == "true") {
    expect_bytes(file, voxels, inflated_bytes(data, first));
  } else {
    const double skip = number(file, "headersize", header.get("headersize", "0"));
    if (!(skip >= -1 && skip < 1e12)) throw InputError(fmt::format("{}: HeaderSize: found {}", file.string(), skip));
    const auto before = first + static_cast<std::uint64_t>(std::max(skip, 0.0));
    expect_bytes(file, voxels, present - std::min(present, before));
  }
}

void check_png_header(const path& file) {
  const std::uint64_t bytes = file_bytes(file);
  std::ifstream in(file, std::ios::binary);
  std::string head(33, '\0');
  in.read(head.data(), 33);
  if (in.gcount() != 33 || !head.starts_with("\x89PNG\r\n\x1a\n") || head.compare(12, 4, "IHDR") != 0) {
    throw InputError(fmt::format("{}: expected a PNG image", file.string()));
  }
  const double width = read_at<std::uint32_t>(head, 16, true), height = read_at<std::uint32_t>(head, 20, true);
  const int depth = static_cast<unsigned char>(head[24]);
  const std::uint64_t pixels = checked_image_bytes(file, {width, height, 1}, 1);
  // PNG compresses with deflate, which shrinks data at most 1032 times.
  expect_bytes(file, pixels / 8 * static_cast<std::uint64_t>(std::min(depth, 8)) / 1032, bytes);
  in.seekg(static_cast<std::streamoff>(bytes) - 8);
  std::string end(8, '\0');
  in.read(end.data(), 8);
  if (end.compare(0, 4, "IEND") != 0) throw InputError(fmt::format("{}: the PNG image is cut off", file.string()));
}

}  // namespace palpate
