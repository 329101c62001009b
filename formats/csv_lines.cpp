#include "formats/csv_lines.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "formats/byte_order_mark.h"
#include "formats/errors.h"

namespace palpate {
namespace {

constexpr std::size_t kMostShown = 60;  // characters of a line in a refusal

// With or without quotes.
bool begins_as_number(const char* cell) {
  constexpr const char* kAround = " \t\"";
  cell += std::strspn(cell, kAround);
  char* end = nullptr;
  std::strtod(cell, &end);  // "nan" and "inf" are numbers too
  const char after = end[std::strspn(end, kAround)];
  return (end != cell && (after == ',' || after == '\0')) || (*cell != '\0' && std::strchr("+-.0123456789", *cell));
}

}  // namespace

CsvLines::CsvLines(const std::filesystem::path& file, const std::string& what) : file_(file), stream_(file) {
  if (!std::filesystem::is_regular_file(file) || !stream_)
    throw InputError(fmt::format("{}: expected a CSV file with {}, found none that can be read", file.string(), what));
  std::string mark(3, '\0');
  stream_.read(mark.data(), 3);
  stream_.clear();
  if (mark.starts_with("\xff\xfe") || mark.starts_with("\xfe\xff"))
    throw InputError(fmt::format("{}: expected text in UTF-8, found UTF-16; save it as CSV in UTF-8", file.string()));
  stream_.seekg(static_cast<std::streamoff>(byte_order_mark(mark)));
}

bool CsvLines::next() {
  while (std::getline(stream_, text_)) {
    ++number_;
    if (!text_.empty() && text_.back() == '\r') text_.pop_back();
    const auto first = text_.find_first_not_of(" \t");
    if (first == std::string::npos || text_[first] == '#') continue;
    ++lines_;
    return true;
  }
  return false;
}

bool CsvLines::may_be_heading() const {
  if (lines_ != 1 || text_.find_first_not_of(" \t,\"") == std::string::npos) return false;
  for (const char* cell = text_.c_str(); !begins_as_number(cell); ++cell)
    if (cell = std::strchr(cell, ','); !cell) return true;
  return false;
}

void CsvLines::refuse(const std::string& expected, const std::string& found) const {
  throw InputError(
      fmt::format("{}:{}: expected {}, found \"{}\"", file_.string(), number_, expected, found.substr(0, kMostShown)));
}

bool read_csv_numbers(const std::string& line, double* numbers, std::size_t count) {
  const char* at = line.c_str();
  for (std::size_t i = 0; i < count; ++i) {
    char* end = nullptr;
    numbers[i] = std::strtod(at, &end);
    if (end == at || !std::isfinite(numbers[i])) return false;
    end += std::strspn(end, " \t");
    if (i + 1 == count) return end == line.c_str() + line.size();
    if (*end != ',') return false;
    at = end + 1;
  }
  return false;
}

}  // namespace palpate
