// Functions that the readers of surface files share. Callers use read_surface (surface_file.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "formats/ply_reader.h"
#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Returns all bytes of the file. Errors: InputError.
std::string read_whole(const std::filesystem::path& file);

// Goes through the lines of a text and counts them. Skips blank lines and everything behind a '#'. Errors: InputError
// that names the line.
class TextLines {
 public:
  TextLines(const std::filesystem::path& file, const std::string& text, std::size_t start = 0);
  bool advance();                        // goes to the next line; false at the end
  void expect(const std::string& what);  // goes to the next line, or fails because the file ends
  std::string_view word();               // next word of the line; empty at the end of the line
  double coordinate();                   // next word as a finite number
  std::int64_t integer(const std::string& what);
  bool at_end() const { return line_.find_first_not_of(" \t\r") == std::string_view::npos; }
  std::size_t number() const { return number_; }
  [[noreturn]] void fail(const std::string& expected, std::string_view found) const;

 private:
  const std::filesystem::path& file_;
  const std::string& text_;
  std::string_view line_;
  std::size_t next_ = 0, number_ = 0;
};

TriangleSurface read_vtp(const std::filesystem::path& file, const std::string& bytes);

}  // namespace palpate
