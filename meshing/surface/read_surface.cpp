// Reads OFF, OBJ and STL. formats/ply_reader.h reads PLY.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <numeric>

#include "formats/byte_order_mark.h"
#include "formats/errors.h"
#include "formats/ply_reader.h"
#include "formats/program.h"
#include "meshing/image/file_bytes.h"
#include "meshing/image/text_header.h"
#include "meshing/surface/surface_file.h"
#include "meshing/surface/triangle_soup.h"

namespace palpate {
namespace {

std::string read_whole(const std::filesystem::path& file) {
  std::string bytes(file_bytes(file), '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (in.gcount() != static_cast<std::streamsize>(bytes.size())) {
    throw InputError(fmt::format("{}: cannot be read", file.string()));
  }
  return bytes;
}

// Where the words of one line go on in the next: nowhere, behind a line that ends with a backslash, or anywhere.
enum class Continued { nowhere, at_backslash, anywhere };

// Goes through the lines of a text and counts them. Skips a byte order mark, blank lines and everything behind a '#'. Errors:
// InputError that names the line.
class TextLines {
 public:
  TextLines(const std::filesystem::path& file, const std::string& text, Continued continued = Continued::nowhere);
  bool advance();                        // goes to the next line; false at the end
  void expect(const std::string& what);  // goes to the next line, or fails because the file ends
  std::string_view word();               // next word of the line, or of those that continue it; empty at the end
  Point point();                         // the next three words as coordinates; keeps why where one is nan or infinite
  std::int64_t integer(const std::string& what);
  bool at_end() const { return line_.find_first_not_of(" \t\r") == std::string_view::npos; }
  std::size_t number() const { return number_; }
  [[noreturn]] void fail(const std::string& expected, std::string_view found) const {
    throw InputError(sentence(expected, found));
  }
  // Why the latest point is not in space; empty where it is.
  const std::string& why_not_finite() const { return why_not_finite_; }

 private:
  double coordinate();
  std::string sentence(const std::string& expected, std::string_view found) const;

  const std::filesystem::path& file_;
  const std::string& text_;
  const Continued continued_;
  std::string_view line_;
  std::string why_not_finite_;
  bool goes_on_ = false;  // the line ends with a backslash
  std::size_t next_ = 0, number_ = 0;
};

// A surface as a file states it. not_finite: points with a coordinate that is nan or infinite, and why; nobody may use them.
struct StatedSurface {
  TriangleSurface surface;
  std::map<std::int32_t, std::string> not_finite;
};

TextLines::TextLines(const std::filesystem::path& file, const std::string& text, Continued continued)
    : file_(file), text_(text), continued_(continued), next_(byte_order_mark(text)) {}

bool TextLines::advance() {
  while (next_ < text_.size()) {
    const std::size_t end = std::min(text_.find('\n', next_), text_.size());
    line_ = std::string_view(text_).substr(next_, end - next_);
    next_ = end + 1;
    ++number_;
    line_ = line_.substr(0, line_.find('#'));
    const std::size_t last = line_.find_last_not_of(" \t\r");
    goes_on_ = continued_ == Continued::at_backslash && last != std::string_view::npos && line_[last] == '\\';
    if (goes_on_) line_ = line_.substr(0, last);
    if (last != std::string_view::npos) return true;
  }
  line_ = {};
  goes_on_ = false;
  return false;
}

void TextLines::expect(const std::string& what) {
  if (!advance()) {
    throw InputError(
        fmt::format("{}: the file ends after line {}, expected {}; it is cut off", file_.string(), number_, what));
  }
}

std::string_view TextLines::word() {
  std::size_t first = line_.find_first_not_of(" \t\r");
  while (first == std::string_view::npos) {
    if (!goes_on_ && continued_ != Continued::anywhere) return {};
    if (!advance()) return {};
    first = line_.find_first_not_of(" \t\r");
  }
  const std::size_t end = std::min(line_.find_first_of(" \t\r", first), line_.size());
  const std::string_view found = line_.substr(first, end - first);
  line_ = line_.substr(end);
  return found;
}

std::string TextLines::sentence(const std::string& expected, std::string_view found) const {
  if (found.empty() && next_ >= text_.size())
    return fmt::format("{}: the file ends in line {}, expected {}; it is cut off", file_.string(), number_, expected);
  return fmt::format("{}: line {}: expected {}, found '{}'", file_.string(), number_, expected, found.substr(0, 40));
}

// A number, with or without a plus sign. Returns whether the whole word is one.
template <class Number>
bool parse(std::string_view text, Number& value) {
  const std::string_view digits = text.starts_with('+') && !text.starts_with("+-") ? text.substr(1) : text;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  return error == std::errc() && end == digits.data() + digits.size();
}

double TextLines::coordinate() {
  const std::string_view text = word();
  double value = 0;
  if (!parse(text, value)) fail("a finite coordinate", text);
  if (!std::isfinite(value) && why_not_finite_.empty()) why_not_finite_ = sentence("a finite coordinate", text);
  return value;
}

Point TextLines::point() {
  why_not_finite_.clear();
  const double x = coordinate(), y = coordinate(), z = coordinate();
  return {x, y, z};
}

std::int64_t TextLines::integer(const std::string& what) {
  const std::string_view text = word();
  std::int64_t value = 0;
  if (!parse(text, value)) fail(what, text);
  return value;
}

void add_point(const TextLines& lines, const Point& point, StatedSurface& stated) {
  if (!lines.why_not_finite().empty())
    stated.not_finite.emplace(static_cast<std::int32_t>(stated.surface.points.size()), lines.why_not_finite());
  stated.surface.points.push_back(point);
}

// "OFF", after the letters for what else each point has: texture coordinates, a colour, a normal. All of it follows x y z.
bool is_off_header(std::string_view word) {
  for (const std::string_view letters : {"ST", "C", "N"})
    if (word.starts_with(letters)) word.remove_prefix(letters.size());
  return word == "OFF";
}

StatedSurface read_off(const std::filesystem::path& file, const std::string& text) {
  TextLines lines(file, text, Continued::anywhere);
  lines.expect("OFF");
  const std::string_view word = lines.word();
  if (!is_off_header(word)) lines.fail("OFF", word);
  const std::int64_t points = lines.integer("the number of points"), faces = lines.integer("the number of faces");
  // a point takes at least 6 bytes ("0 0 0\n"), a face at least 8 ("3 0 0 0\n")
  if (points < 0 || faces < 0 || points > static_cast<std::int64_t>(text.size() / 5) ||
      faces > static_cast<std::int64_t>(text.size() / 5)) {
    throw InputError(fmt::format("{}: {} points and {} faces do not fit a file of {} bytes; it is cut off or damaged",
                                 file.string(), points, faces, text.size()));
  }
  StatedSurface stated;
  for (std::int64_t p = 0; p < points; ++p) {
    lines.expect(fmt::format("{} points", points));
    add_point(lines, lines.point(), stated);
  }
  std::vector<std::int64_t> corners;
  for (std::int64_t f = 0; f < faces; ++f) {
    lines.expect(fmt::format("{} faces", faces));
    const std::size_t begin = lines.number();
    const std::int64_t count = lines.integer("the number of a face's points");
    if (count < 3 || count > points) lines.fail("a face of at least 3 points", std::to_string(count));
    corners.clear();
    for (std::int64_t c = 0; c < count; ++c) corners.push_back(lines.integer("a point index"));
    // Behind the points stands a colour. Behind those of a face on two lines it may be the next face, of a face cut short.
    if (lines.number() != begin && !lines.at_end())
      lines.fail(fmt::format("the end of the face that begins in line {}", begin), lines.word());
    add_polygon(file, fmt::format("line {}", lines.number()), corners, stated.surface.points.size(),
                stated.surface.triangles);
  }
  return stated;
}

StatedSurface read_obj(const std::filesystem::path& file, const std::string& text) {
  TextLines lines(file, text, Continued::at_backslash);
  StatedSurface stated;
  TriangleSurface& surface = stated.surface;
  std::vector<std::int64_t> corners;
  while (lines.advance()) {
    const std::string_view word = lines.word();
    if (word == "v") {
      add_point(lines, lines.point(), stated);
    } else if (word == "f") {
      corners.clear();
      for (std::string_view corner = lines.word(); !corner.empty(); corner = lines.word()) {
        std::int64_t index =
            0;  // "7", "7/1", "7//3" or "7/1/3"; counts from 1; negative: backwards from the last point
        if (!parse(corner.substr(0, corner.find('/')), index) || index == 0)
          lines.fail("a point index of at least 1", corner);
        corners.push_back(index > 0 ? index - 1 : static_cast<std::int64_t>(surface.points.size()) + index);
      }
      add_polygon(file, fmt::format("line {} (from 0)", lines.number()), corners, surface.points.size(),
                  surface.triangles);
    }
    while (!lines.word().empty()) continue;  // of lines that this one continues in
  }
  return stated;
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

// The first word of a line of a text STL, in lower case; "end solid", in two words, counts as "endsolid".
std::string stl_keyword(TextLines& lines) {
  std::string word = lower_case(std::string(lines.word()));
  if (word == "end") word += lower_case(std::string(lines.word()));
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
      surface.points.push_back(lines.point());
      if (!lines.why_not_finite().empty()) throw InputError(lines.why_not_finite());
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

// Merges points with the same coordinates: an STL file repeats each point for each of its triangles.
void share_points(const std::filesystem::path& file, TriangleSurface& surface) {
  std::vector<std::int32_t> order(surface.points.size());
  std::iota(order.begin(), order.end(), 0);
  const auto& points = surface.points;
  std::sort(order.begin(), order.end(),
            [&](std::int32_t a, std::int32_t b) { return points[a] != points[b] ? points[a] < points[b] : a < b; });
  std::vector<std::int32_t> first(order.size());  // of the points at the same place
  for (std::size_t i = 0; i < order.size(); ++i)
    first[order[i]] = i > 0 && points[order[i]] == points[order[i - 1]] ? first[order[i - 1]] : order[i];
  for (Triangle& triangle : surface.triangles)
    for (std::int32_t& corner : triangle) corner = first[corner];
  if (const std::size_t merged = drop_isolated_points(surface))
    note(fmt::format("{}: {} points that the triangles share were merged; an STL file repeats them", file.string(),
                     merged));
}

// An STL file is binary if its size fits the count in byte 80. Its first bytes do not decide, because binary files
// may also begin with "solid".
TriangleSurface read_stl(const std::filesystem::path& file, const std::string& bytes) {
  std::uint32_t count = 0;
  if (bytes.size() >= 84) std::memcpy(&count, bytes.data() + 80, 4);
  const std::uint64_t needed = 84 + 50 * std::uint64_t{count};
  TriangleSurface surface;
  if (bytes.size() >= 84 && bytes.size() == needed) {
    surface = read_binary_stl(file, bytes);
    share_points(file, surface);
    return surface;
  }
  const std::string head = lower_case(bytes.substr(byte_order_mark(bytes), 4096));
  const std::size_t first = std::min(head.find_first_not_of(" \t\r\n"), head.size());
  if (head.compare(first, 5, "solid") == 0 && head.find("facet") != std::string::npos) {
    surface = read_text_stl(file, bytes);
    share_points(file, surface);
    return surface;
  }
  throw InputError(
      fmt::format("{}: expected a binary STL of {} triangles in {} bytes, or a text one, found {} bytes; it is cut "
                  "off or damaged",
                  file.string(), count, needed, bytes.size()));
}

// Some programs, 3D Slicer among them, state the directions of the axes in a comment.
bool says_ras(const std::string& bytes) {
  return bytes.substr(0, 1024).find("SPACE=RAS") != std::string::npos;
}

// Drops the points with coordinates that are not finite. Errors: InputError where a triangle uses one.
TriangleSurface finite(const std::filesystem::path& file, StatedSurface stated) {
  if (stated.not_finite.empty()) return std::move(stated.surface);
  for (const Triangle& triangle : stated.surface.triangles)
    for (const std::int32_t corner : triangle)
      if (const auto found = stated.not_finite.find(corner); found != stated.not_finite.end())
        throw InputError(found->second);
  note(fmt::format("{}: {} points without finite coordinates, which no triangle uses, were dropped", file.string(),
                   stated.not_finite.size()));
  drop_isolated_points(stated.surface);
  return std::move(stated.surface);
}

}  // namespace

TriangleSurface read_surface(const std::filesystem::path& file, double millimetres_per_unit) {
  const std::string ending = lower_case(file.extension().string());
  const std::string bytes = read_whole(file);
  StatedSurface stated;
  if (ending == ".off")
    stated = read_off(file, bytes);
  else if (ending == ".obj")
    stated = read_obj(file, bytes);
  else if (ending == ".stl")
    stated.surface = read_stl(file, bytes);
  else if (ending == ".ply") {
    PlyTriangles ply = read_ply(file, bytes, &stated.not_finite);
    stated.surface = {std::move(ply.points), std::move(ply.triangles)};
  } else {
    throw InputError(
        fmt::format("{}: expected a surface (.off .obj .ply .stl) or an image (.inr .inr.gz .nrrd .nhdr .nii "
                    ".nii.gz .mha .mhd)",
                    file.string()));
  }
  TriangleSurface surface = finite(file, std::move(stated));
  if (surface.triangles.empty()) throw InputError(fmt::format("{}: the surface has no triangles", file.string()));
  if (says_ras(bytes)) {
    note(fmt::format("{}: the file says SPACE=RAS; x and y are turned to LPS", file.string()));
    for (Point& p : surface.points) p = {-p[0], -p[1], p[2]};
  }
  for (Point& p : surface.points) p = millimetres_per_unit * p;
  return surface;
}

}  // namespace palpate
