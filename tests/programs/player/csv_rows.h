// The rows of a CSV file that palpate-run wrote, by the names of their columns.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

namespace palpate::tests {

using Row = std::map<std::string, std::string>;
inline std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (const char c : line)
    if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      cells.emplace_back();
    else
      cells.back() += c;
  return cells;
}
inline std::vector<Row> read_rows(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  const std::vector<std::string> header = cells_of(line);
  std::vector<Row> rows;
  while (std::getline(stream, line)) {
    const std::vector<std::string> cells = cells_of(line);
    EXPECT_EQ(cells.size(), header.size()) << line;
    rows.emplace_back();
    for (std::size_t i = 0; i < std::min(header.size(), cells.size()); ++i) rows.back()[header[i]] = cells[i];
  }
  return rows;
}
inline double number(const Row& row, const std::string& name) {
  return std::stod(row.at(name));
}

}  // namespace palpate::tests
