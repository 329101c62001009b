// Functions that the readers of surface files share. Callers use read_surface (surface_file.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "formats/errors.h"
#include "formats/ply_reader.h"
#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Returns all bytes of the file. Errors: InputError.
std::string read_whole(const std::filesystem::path& file);

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

}  // namespace palpate
