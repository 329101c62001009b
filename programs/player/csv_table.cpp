#include "programs/player/csv_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "formats/errors.h"
#include "formats/scene_holds.h"
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
  if (value.is_number_float() && std::isfinite(value.get<double>()))
    return std::strtod(text_of(value, digits).c_str(), nullptr);
  nlohmann::ordered_json out = value;
  if (value.is_structured())
    for (auto& each : out) each = rounded(each, digits);
  return out;
}

void CsvTable::open(const std::filesystem::path& file, const std::string& heading) {
  file_ = file;
  stream_.open(file);
  std::istringstream names(heading);
  for (std::string name; std::getline(names, name, ',');) {
    const bool length = name.ends_with("_m") && !name.starts_with("modified_");
    if (length) name.replace(name.size() - 1, 1, unit_of(style_.metres_per_unit));
    stream_ << (units_.empty() ? "" : ",") << name;
    units_.push_back(length ? style_.metres_per_unit : 1);
  }
  stream_ << '\n';
}

void CsvTable::add(const std::string& text) {
  end_cell(quoted(text));
}

void CsvTable::add(const FlagCells& cells) {
  add(cells.flags);
  end_cell(fmt::format("{}", fmt::join(flag_names(cells.flags), " ")));
}

void CsvTable::close() {
  if (!stream_.is_open()) return;
  stream_.close();
  if (!stream_) throw OperationError(fmt::format("{}: cannot write the CSV file", file_.string()));
}

}  // namespace palpate
