// PLY: a text header that describes records, then the records as text or bytes.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <sstream>

#include "formats/byte_order_mark.h"
#include "formats/errors.h"
#include "formats/ply_reader.h"

namespace palpate {
namespace {

struct Property {
  std::string name, type, count_type;  // count_type is empty for a scalar
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  enum class Format { text, little, big } format = Format::text;
  std::vector<Element> elements;
  std::size_t bytes = 0;
};

int size_of(const std::string& type) {
  static const std::map<std::string, int> sizes = {{"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1},
                                                   {"short", 2}, {"ushort", 2},  {"int16", 2},  {"uint16", 2},
                                                   {"int", 4},   {"uint", 4},    {"int32", 4},  {"uint32", 4},
                                                   {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};
  const auto found = sizes.find(type);
  return found == sizes.end() ? 0 : found->second;
}

Header read_header(const std::filesystem::path& file, const std::string& bytes) {
  const auto fail = [&](const std::string& line) {
    throw InputError(fmt::format("{}: header line not understood: '{}'", file.string(), line.substr(0, 60)));
  };
  Header header;
  bool format_seen = false;
  const std::size_t first = byte_order_mark(bytes);
  std::size_t start = first;
  while (true) {
    const std::size_t end = bytes.find('\n', start);
    if (end == std::string::npos || start > 65536) {
      throw InputError(fmt::format(
          "{}: expected a PLY header that ends with end_header; the file is cut off or not PLY", file.string()));
    }
    std::string line = bytes.substr(start, end - start);
    if (line.ends_with('\r')) line.pop_back();
    if (start == first && line != "ply") fail(line);
    start = end + 1;
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "end_header") break;
    if (keyword == "format") {
      std::string name;
      words >> name;
      if (name == "ascii")
        header.format = Header::Format::text;
      else if (name == "binary_little_endian")
        header.format = Header::Format::little;
      else if (name == "binary_big_endian")
        header.format = Header::Format::big;
      else
        fail(line);
      format_seen = true;
    } else if (keyword == "element") {
      Element element;
      if (!(words >> element.name >> element.count)) fail(line);
      header.elements.push_back(element);
    } else if (keyword == "property") {
      Property property;
      words >> property.type;
      if (property.type == "list") words >> property.count_type >> property.type;
      words >> property.name;
      const bool known = size_of(property.type) && (property.count_type.empty() || size_of(property.count_type));
      if (!known || property.name.empty() || header.elements.empty()) fail(line);
      header.elements.back().properties.push_back(property);
    }
  }
  if (!format_seen) throw InputError(fmt::format("{}: the PLY header has no format line", file.string()));
  header.bytes = start;
  return header;
}

// One number after another of the records.
class Records {
 public:
  Records(const std::filesystem::path& file, const std::string& bytes, const Header& header)
      : file_(file), bytes_(bytes), format_(header.format), at_(header.bytes) {}

  double number(const std::string& type) {
    if (format_ == Header::Format::text) return text_number();
    const auto size = static_cast<std::size_t>(size_of(type));
    if (bytes_.size() - at_ < size) {
      throw InputError(fmt::format("{}: the file ends at byte {} in the middle of its records; it is cut off",
                                   file_.string(), bytes_.size()));
    }
    std::array<char, 8> raw{};
    std::memcpy(raw.data(), bytes_.data() + at_, size);
    at_ += size;
    if ((format_ == Header::Format::big) == (std::endian::native == std::endian::little)) {
      std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(size));
    }
    const auto as = [&](auto value) {
      std::memcpy(&value, raw.data(), sizeof value);
      return static_cast<double>(value);
    };
    if (type.starts_with("float") || type == "double") return size == 4 ? as(float{}) : as(double{});
    const bool is_unsigned = type.starts_with('u');
    if (size == 1) return is_unsigned ? as(std::uint8_t{}) : as(std::int8_t{});
    if (size == 2) return is_unsigned ? as(std::uint16_t{}) : as(std::int16_t{});
    return is_unsigned ? as(std::uint32_t{}) : as(std::int32_t{});
  }
  // Steps over one number, of which a text may write anything.
  void skip(const std::string& type) {
    if (format_ == Header::Format::text)
      text_word();
    else
      number(type);
  }
  std::size_t at() const { return at_; }
  std::size_t left() const { return bytes_.size() - at_; }

 private:
  std::string text_word() {
    at_ = bytes_.find_first_not_of(" \t\r\n", at_);
    if (at_ == std::string::npos) {
      at_ = bytes_.size();
      throw InputError(fmt::format("{}: the file ends in the middle of its records; it is cut off", file_.string()));
    }
    const std::size_t begin = at_;
    at_ = std::min(bytes_.find_first_of(" \t\r\n", at_), bytes_.size());
    return bytes_.substr(begin, std::min<std::size_t>(at_ - begin, 60));
  }

  double text_number() {
    const std::string word = text_word();
    char* stop = nullptr;
    const double value = std::strtod(word.c_str(), &stop);
    if (*stop != '\0' || word.empty()) {
      throw InputError(
          fmt::format("{}: byte {}: expected a number, found '{}'", file_.string(), at_ - word.size(), word));
    }
    return value;
  }

  const std::filesystem::path& file_;
  const std::string& bytes_;
  Header::Format format_;
  std::size_t at_;
};

// The least bytes one record can have.
std::uint64_t least_bytes(const Element& element, bool text) {
  std::uint64_t bytes = 0;
  for (const Property& p : element.properties) {
    bytes += text ? 2 : static_cast<std::uint64_t>(size_of(p.count_type.empty() ? p.type : p.count_type));
  }
  return std::max<std::uint64_t>(bytes, 1);
}

}  // namespace

void add_polygon(const std::filesystem::path& file, const std::string& where, const std::vector<std::int64_t>& corners,
                 std::size_t points, std::vector<std::array<std::int32_t, 3>>& triangles) {
  if (corners.size() < 3) {
    throw InputError(
        fmt::format("{}: {}: expected a face of at least 3 points, found {}", file.string(), where, corners.size()));
  }
  for (const std::int64_t c : corners) {
    if (c < 0 || static_cast<std::size_t>(c) >= points) {
      throw InputError(
          fmt::format("{}: {}: expected point indices below {}, found {}", file.string(), where, points, c));
    }
  }
  for (std::size_t c = 1; c + 1 < corners.size(); ++c) {
    triangles.push_back({static_cast<std::int32_t>(corners[0]), static_cast<std::int32_t>(corners[c]),
                         static_cast<std::int32_t>(corners[c + 1])});
  }
}

PlyTriangles read_ply(const std::filesystem::path& file, const std::string& bytes,
                      std::map<std::int32_t, std::string>* not_finite) {
  const Header header = read_header(file, bytes);
  Records records(file, bytes, header);
  PlyTriangles surface;
  std::size_t points = 0;
  for (const Element& element : header.elements) {
    if (element.name == "vertex") points = element.count;
  }
  for (const Element& element : header.elements) {
    if (element.count > (records.left() + 1) / least_bytes(element, header.format == Header::Format::text)) {
      throw InputError(
          fmt::format("{}: {} elements '{}' do not fit the {} bytes left in the file; it is cut off or damaged",
                      file.string(), element.count, element.name, records.left()));
    }
    for (std::uint64_t r = 0; r < element.count; ++r) {
      const std::string where = fmt::format("{} {} (byte {})", element.name, r, records.at());
      std::array<double, 3> point{NAN, NAN, NAN};
      std::vector<std::int64_t> corners;
      for (const Property& property : element.properties) {
        if (property.count_type.empty()) {
          const bool is_coordinate = property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z';
          if (is_coordinate)
            point[property.name[0] - 'x'] = records.number(property.type);
          else
            records.skip(property.type);
          continue;
        }
        const double count = records.number(property.count_type);
        if (!(count >= 0) || count > static_cast<double>(records.left())) {
          throw InputError(fmt::format("{}: {}: a list of {} does not fit the file", file.string(), where, count));
        }
        const bool is_face = property.name == "vertex_indices" || property.name == "vertex_index";
        for (std::uint64_t c = 0; c < static_cast<std::uint64_t>(count); ++c) {
          if (!is_face) {
            records.skip(property.type);
            continue;
          }
          const double value = records.number(property.type);
          corners.push_back(std::abs(value) < 4e18 ? static_cast<std::int64_t>(value) : -1);
        }
      }
      if (element.name == "vertex") {
        for (const double c : point) {
          if (std::isfinite(c)) continue;
          const std::string sentence =
              fmt::format("{}: {}: expected finite x, y and z, found {}", file.string(), where, c);
          if (!not_finite) throw InputError(sentence);
          not_finite->emplace(static_cast<std::int32_t>(surface.points.size()), sentence);
        }
        surface.points.push_back(point);
      } else if (element.name == "face") {
        add_polygon(file, where, corners, points, surface.triangles);
      }
    }
  }
  return surface;
}

}  // namespace palpate
