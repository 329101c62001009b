#include "programs/player/csv_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "formats/errors.h"
#include "programs/player/summary.h"

namespace palpate {
namespace {

// A tool's or a link's name as one cell: a comma or a quote in it must not shift the columns.
std::string quoted(const std::string& name) {
  if (name.find_first_of(",\"\n") == std::string::npos) return name;
  std::string out = "\"";
  for (const char c : name) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

}  // namespace

std::string text_of(double number, int digits) {
  const double without_sign_of_zero = number + 0.0;
  return digits >= kAllDigits ? fmt::format("{}", without_sign_of_zero)
                              : fmt::format("{:.{}g}", without_sign_of_zero, digits);
}

nlohmann::ordered_json rounded(const nlohmann::ordered_json& value, int digits) {
  if (value.is_number_float() && std::isfinite(value.get<double>())) return std::stod(text_of(value, digits));
  nlohmann::ordered_json out = value;
  if (value.is_structured())
    for (auto& each : out) each = rounded(each, digits);
  return out;
}

void CsvTable::open(const std::filesystem::path& file, const std::string& heading) {
  file_ = file;
  stream_.open(file);
  stream_ << heading << '\n';
}

void CsvTable::add(const std::string& text) {
  line_ += quoted(text) + ',';
}

void CsvTable::add(const FlagCells& cells) {
  line_ += fmt::format("{},{},", cells.flags, fmt::join(flag_names(cells.flags), " "));
}

void CsvTable::close() {
  if (!stream_.is_open()) return;
  stream_.close();
  if (!stream_) throw OperationError(fmt::format("{}: cannot write the CSV file", file_.string()));
}

}  // namespace palpate
