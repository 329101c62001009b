// Reads OFF, OBJ and STL. formats/ply_reader.h reads PLY, read_vtp.cpp reads VTP.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>

#include "formats/errors.h"
#include "formats/program.h"
#include "meshing/image/file_bytes.h"
#include "meshing/surface/read_surface_parts.h"
#include "meshing/surface/surface_file.h"

namespace palpate {

std::string read_whole(const std::filesystem::path& file) {
  std::string bytes(file_bytes(file), '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (in.gcount() != static_cast<std::streamsize>(bytes.size())) {
    throw InputError(fmt::format("{}: cannot be read", file.string()));
  }
  return bytes;
}

TextLines::TextLines(const std::filesystem::path& file, const std::string& text, std::size_t start)
    : file_(file), text_(text), next_(start) {
  number_ = static_cast<std::size_t>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(start), '\n'));
}

bool TextLines::advance() {
  while (next_ < text_.size()) {
    const std::size_t end = std::min(text_.find('\n', next_), text_.size());
    line_ = std::string_view(text_).substr(next_, end - next_);
    next_ = end + 1;
    ++number_;
    line_ = line_.substr(0, line_.find('#'));
    if (line_.find_first_not_of(" \t\r") != std::string_view::npos) return true;
  }
  line_ = {};
  return false;
}

void TextLines::expect(const std::string& what) {
  if (!advance()) {
    throw InputError(
        fmt::format("{}: the file ends after line {}, expected {}; it is cut off", file_.string(), number_, what));
  }
}

std::string_view TextLines::word() {
  const std::size_t first = line_.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  const std::size_t end = std::min(line_.find_first_of(" \t\r", first), line_.size());
  const std::string_view found = line_.substr(first, end - first);
  line_ = line_.substr(end);
  return found;
}

void TextLines::fail(const std::string& expected, std::string_view found) const {
  if (found.empty() && next_ >= text_.size()) {
    throw InputError(
        fmt::format("{}: the file ends in line {}, expected {}; it is cut off", file_.string(), number_, expected));
  }
  throw InputError(
      fmt::format("{}: line {}: expected {}, found '{}'", file_.string(), number_, expected, found.substr(0, 40)));
}

double TextLines::coordinate() {
  std::string_view text = word();
  double value = 0;
  const std::string_view digits = text.starts_with('+') ? text.substr(1) : text;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value)) {
    fail("a finite coordinate", text);
  }
  return value;
}

std::int64_t TextLines::integer(const std::string& what) {
  const std::string_view text = word();
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) fail(what, text);
  return value;
}

namespace {

// "OFF", after the letters for what else each point has: texture coordinates, a colour, a normal. All of it follows x y z.
bool is_off_header(std::string_view word) {
  for (const std::string_view letters : {"ST", "C", "N"})
    if (word.starts_with(letters)) word.remove_prefix(letters.size());
  return word == "OFF";
}

TriangleSurface read_off(const std::filesystem::path& file, const std::string& text) {
  TextLines lines(file, text);
  lines.expect("OFF");
  const std::string_view word = lines.word();
  if (!is_off_header(word)) lines.fail("OFF", word);
  if (lines.at_end()) lines.expect("the numbers of points and faces");
  const std::int64_t points = lines.integer("the number of points"), faces = lines.integer("the number of faces");
  // a point takes at least 6 bytes ("0 0 0\n"), a face at least 8 ("3 0 0 0\n")
  if (points < 0 || faces < 0 || points > static_cast<std::int64_t>(text.size() / 5) ||
      faces > static_cast<std::int64_t>(text.size() / 5)) {
    throw InputError(fmt::format("{}: {} points and {} faces do not fit a file of {} bytes; it is cut off or damaged",
                                 file.string(), points, faces, text.size()));
  }
  TriangleSurface surface;
  for (std::int64_t p = 0; p < points; ++p) {
    lines.expect(fmt::format("{} points", points));
    const double x = lines.coordinate(), y = lines.coordinate(), z = lines.coordinate();
    surface.points.push_back({x, y, z});
  }
  std::vector<std::int64_t> corners;
  for (std::int64_t f = 0; f < faces; ++f) {
    lines.expect(fmt::format("{} faces", faces));
    const std::int64_t count = lines.integer("the number of a face's points");
    if (count < 3 || count > points) lines.fail("a face of at least 3 points", std::to_string(count));
    corners.clear();
    for (std::int64_t c = 0; c < count; ++c) corners.push_back(lines.integer("a point index"));
    add_polygon(file, fmt::format("line {}", lines.number()), corners, surface.points.size(), surface.triangles);
  }
  return surface;
}

TriangleSurface read_obj(const std::filesystem::path& file, const std::string& text) {
  TextLines lines(file, text);
  TriangleSurface surface;
  std::vector<std::int64_t> corners;
  while (lines.advance()) {
    const std::string_view word = lines.word();
    if (word == "v") {
      const double x = lines.coordinate(), y = lines.coordinate(), z = lines.coordinate();
      surface.points.push_back({x, y, z});
    } else if (word == "f") {
      corners.clear();
      for (std::string_view corner = lines.word(); !corner.empty(); corner = lines.word()) {
        std::int64_t index =
            0;  // "7", "7/1", "7//3" or "7/1/3"; counts from 1; negative: backwards from the last point
        const auto [end, error] = std::from_chars(corner.data(), corner.data() + corner.size(), index);
        if (error != std::errc() || (end != corner.data() + corner.size() && *end != '/') || index == 0) {
          lines.fail("a point index of at least 1", corner);
        }
        corners.push_back(index > 0 ? index - 1 : static_cast<std::int64_t>(surface.points.size()) + index);
      }
      add_polygon(file, fmt::format("line {} (from 0)", lines.number()), corners, surface.points.size(),
                  surface.triangles);
    }
  }
  return surface;
}

TriangleSurface read_binary_stl(const std::filesystem::path& file, const std::string& bytes) {
  TriangleSurface surface;
  const std::size_t count = (bytes.size() - 84) / 50;
  for (std::size_t t = 0; t < count; ++t) {
    const auto first = static_cast<std::int32_t>(surface.points.size());
    for (std::size_t corner = 0; corner < 3; ++corner) {
      float xyz[3];
      std::memcpy(xyz, bytes.data() + 84 + 50 * t + 12 + 12 * corner, sizeof xyz);
      for (const float c : xyz) {
        if (!std::isfinite(c)) {
          throw InputError(fmt::format("{}: triangle {} (byte {}): expected finite coordinates, found {}",
                                       file.string(), t, 84 + 50 * t, c));
        }
      }
      surface.points.push_back({xyz[0], xyz[1], xyz[2]});
    }
    surface.triangles.push_back({first, first + 1, first + 2});
  }
  return surface;
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return lower;
}

// The first word of a line of a text STL, in lower case; "end solid", in two words, counts as "endsolid".
std::string stl_keyword(TextLines& lines) {
  std::string word = lower_case(lines.word());
  if (word == "end") word += lower_case(lines.word());
  return word;
}

TriangleSurface read_text_stl(const std::filesystem::path& file, const std::string& text) {
  TextLines lines(file, text);
  TriangleSurface surface;
  bool ended = false;
  std::size_t corners = 0;
  while (lines.advance()) {
    const std::string word = stl_keyword(lines);
    if (word == "vertex") {
      const double x = lines.coordinate(), y = lines.coordinate(), z = lines.coordinate();
      surface.points.push_back({x, y, z});
      ++corners;
    } else if (word == "endfacet") {
      if (corners != 3) lines.fail("three vertices in a facet", std::to_string(corners));
      const auto last = static_cast<std::int32_t>(surface.points.size());
      surface.triangles.push_back({last - 3, last - 2, last - 1});
      corners = 0;
    } else if (word == "endsolid") {
      ended = true;
    } else if (word == "solid") {  // the rest of the line is a name, which may have blanks
      ended = false;
    } else if (word != "facet" && word != "outer" && word != "endloop") {
      lines.fail("facet, vertex, endfacet or endsolid", word);
    }
  }
  if (corners) {
    throw InputError(
        fmt::format("{}: the file ends at line {} within a facet; it is cut off", file.string(), lines.number()));
  }
  if (!ended) {
    warn(fmt::format("{}: the file ends at line {} without endsolid; read its {} facets, which are whole",
                     file.string(), lines.number(), surface.triangles.size()));
  }
  return surface;
}

// An STL file is binary if its size fits the count in byte 80. Its first bytes do not decide, because binary files
// may also begin with "solid".
TriangleSurface read_stl(const std::filesystem::path& file, const std::string& bytes) {
  std::uint32_t count = 0;
  if (bytes.size() >= 84) std::memcpy(&count, bytes.data() + 80, 4);
  const std::uint64_t needed = 84 + 50 * std::uint64_t{count};
  if (bytes.size() >= 84 && bytes.size() == needed) return read_binary_stl(file, bytes);
  const std::string head = lower_case(std::string_view(bytes).substr(0, 4096));
  const std::size_t first = std::min(head.find_first_not_of(" \t\r\n"), head.size());
  if (head.compare(first, 5, "solid") == 0 && head.find("facet") != std::string::npos)
    return read_text_stl(file, bytes);
  throw InputError(
      fmt::format("{}: expected a binary STL of {} triangles in {} bytes, or a text one, found {} bytes; it is cut "
                  "off or damaged",
                  file.string(), count, needed, bytes.size()));
}

// Some programs, 3D Slicer among them, state the directions of the axes in a comment.
bool says_ras(const std::string& bytes) {
  return bytes.substr(0, 1024).find("SPACE=RAS") != std::string::npos;
}

}  // namespace

TriangleSurface read_surface(const std::filesystem::path& file, double millimetres_per_unit) {
  const std::string ending = lower_case(file.extension().string());
  const std::string bytes = read_whole(file);
  TriangleSurface surface;
  if (ending == ".off")
    surface = read_off(file, bytes);
  else if (ending == ".obj")
    surface = read_obj(file, bytes);
  else if (ending == ".stl")
    surface = read_stl(file, bytes);
  else if (ending == ".ply") {
    PlyTriangles ply = read_ply(file, bytes);
    surface = {std::move(ply.points), std::move(ply.triangles)};
  } else if (ending == ".vtp")
    surface = read_vtp(file, bytes);
  else {
    throw InputError(
        fmt::format("{}: expected a surface (.off .obj .ply .stl .vtp) or an image (.inr .inr.gz .nrrd .nhdr .nii "
                    ".nii.gz .mha .mhd, PNG slices)",
                    file.string()));
  }
  if (surface.triangles.empty()) throw InputError(fmt::format("{}: the surface has no triangles", file.string()));
  if (says_ras(bytes)) {
    note(fmt::format("{}: the file says SPACE=RAS; x and y are turned to LPS", file.string()));
    for (Point& p : surface.points) p = {-p[0], -p[1], p[2]};
  }
  for (Point& p : surface.points) p = millimetres_per_unit * p;
  return surface;
}

}  // namespace palpate
