// The lines of a CSV file of numbers, for all readers of such files.
#pragma once

#include <array>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

namespace palpate {

class CsvLines {
 public:
  // what, for the refusal: "a tool's path". Errors: InputError where the file cannot be read, or is UTF-16.
  CsvLines(const std::filesystem::path& file, const std::string& what);

  // The next line that holds something. Empty lines and those that begin with '#' are passed over; a byte order mark, which
  // spreadsheets write, and a carriage return at the end are taken away. False: there is none.
  bool next();
  const std::string& text() const { return text_; }
  int number() const { return number_; }  // of the line in the file, from 1

  // Whether the line may hold the columns' names: it is the file's first, has a cell, and none of its cells begins as a number does. So
  // a first row with a fault is no heading.
  bool may_be_heading() const;

  // "FILE:LINE: expected ..., found ...". found: by default the line.
  [[noreturn]] void refuse(const std::string& expected) const { refuse(expected, text_); }
  [[noreturn]] void refuse(const std::string& expected, const std::string& found) const;

 private:
  std::filesystem::path file_;
  std::ifstream stream_;
  std::string text_;
  int number_ = 0, lines_ = 0;  // lines_: that next() has returned
};

// The finite numbers of a line, separated by commas; nothing where there are other ones, more or fewer.
bool read_csv_numbers(const std::string& line, double* numbers, std::size_t count);
template <std::size_t kCount>
std::optional<std::array<double, kCount>> csv_numbers(const std::string& line) {
  std::array<double, kCount> numbers{};
  if (!read_csv_numbers(line, numbers.data(), kCount)) return std::nullopt;
  return numbers;
}

}  // namespace palpate
