// A CSV file, row by row, for readers: numbers with as many significant digits as asked for, none of them -0; text in quotes where it
// needs them; the flags of a step as a number and, in a cell of their own, as names.
#pragma once

#include <palpate/palpate.h>

#include <concepts>
#include <filesystem>
#include <fstream>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace palpate {

constexpr int kAllDigits = 17;  // as many as each double needs to be read back
struct CsvStyle {
  int digits = kAllDigits;  // significant ones of a number
  double metres_per_unit =
      1;  // of lengths, which are the columns whose names end in _m; the unit takes the place of that m
};

// The number as text, and in JSON: each number of the value, at any depth. digits: significant.
std::string text_of(double number, int digits);
nlohmann::ordered_json rounded(const nlohmann::ordered_json& value, int digits);

// The flags of a step: two cells, the number and the names with a space between them.
struct FlagCells {
  palpate_step_flags flags;
};

class CsvTable {
 public:
  explicit CsvTable(const CsvStyle& style) : style_(style) {}
  // heading: the columns' names, with commas between them. The modified displacement stays in metres: inside an organ it is a force.
  void open(const std::filesystem::path& file, const std::string& heading);
  bool is_open() const { return stream_.is_open(); }
  // Text, whole numbers, doubles, arrays of doubles (a cell for each) and FlagCells.
  template <typename... Cells>
  void row(const Cells&... cells) {
    line_.clear(), column_ = 0;
    (add(cells), ...);
    line_.back() = '\n';
    stream_ << line_;
  }
  // Errors: OperationError (a full disk).
  void close();

 private:
  void add(const std::string& text);
  void add(double number) { end_cell(text_of(number / units_[column_], style_.digits)); }
  void add(std::integral auto number) { end_cell(std::to_string(number)); }
  void end_cell(const std::string& text) { line_ += text + ',', ++column_; }
  void add(const FlagCells& cells);
  template <typename Numbers>
  requires requires(const Numbers& numbers) { std::begin(numbers); }
  void add(const Numbers& numbers) {
    for (const double number : numbers) add(number);
  }

  CsvStyle style_;
  std::vector<double> units_;  // of each column, in SI
  std::size_t column_ = 0;
  std::filesystem::path file_;
  std::ofstream stream_;
  std::string line_;
};

}  // namespace palpate
