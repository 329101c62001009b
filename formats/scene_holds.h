// What holds, loads and moves tissue in a scene.toml: its links, loads and motions, and the grasps, needles and turns of its tools.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "formats/csv_lines.h"
#include "formats/errors.h"
#include "formats/scene_config.h"
#include "formats/toml_reader.h"

namespace palpate {

// What the parts of a scene file share: v times scale; the number of a key, which must be above 0 (expected: what the refusal says).
inline SceneConfig::Vector scaled(SceneConfig::Vector v, double scale) {
  for (double& x : v) x *= scale;
  return v;
}
inline double positive(TomlTable& table, const char* key, const char* expected) {
  const double value = table.number(key);
  if (!(value > 0)) table.wrong(key, expected);
  return value;
}

// A whole number of least to most; a coefficient of friction.
inline int count(TomlTable& table, const char* key, int least, int most) {
  const std::int64_t value = table.integer(key);
  if (value < least || value > most)
    table.wrong(key, "a whole number of " + std::to_string(least) + " to " + std::to_string(most));
  return static_cast<int>(value);
}
inline double friction(TomlTable& table) {
  const double value = table.number("friction");
  if (!(value >= 0 && value <= 100)) table.wrong("friction", "a coefficient of 0 to 100");
  return value;
}

inline constexpr const char* kAscending = "a time of at least 0 s and after the row before";
template <std::size_t n>
bool follows(const std::vector<std::array<double, n>>& rows, const std::array<double, n>& row) {
  return rows.empty() ? row[0] >= 0 : row[0] > rows.back()[0];
}

// Rows [t, ...] whose times ascend.
template <std::size_t n>
std::vector<std::array<double, n>> timed_rows(TomlTable& table, const char* key, const char* shown) {
  std::vector<std::array<double, n>> rows;
  for (const auto& row : table.rows<n>(key, shown)) {
    if (!follows(rows, row)) table.wrong_row(key, rows.size(), kAscending);
    rows.push_back(row);
  }
  return rows;
}

// The same of a CSV file, whose first line may hold names. numbers: "two numbers".
template <std::size_t n>
std::vector<std::array<double, n>> timed_csv_rows(const std::filesystem::path& csv, const std::string& what,
                                                  const std::string& numbers, const std::string& columns) {
  CsvLines lines(csv, what);
  std::vector<std::array<double, n>> rows;
  while (lines.next()) {
    if (lines.may_be_heading()) continue;
    const auto row = csv_numbers<n>(lines.text());
    if (!row) lines.refuse(numbers + " " + columns);
    if (!follows(rows, *row)) lines.refuse(kAscending);
    rows.push_back(*row);
  }
  if (rows.empty()) throw InputError(fmt::format("{}: expected rows of {}, found none", csv.string(), columns));
  return rows;
}

// Rows [from, until], one after another.
std::vector<std::array<double, 2>> read_spans(TomlTable& table, const char* key);

// Names that are parts of file names and of --bundle NAME=FILE.
inline bool is_plain(const std::string& name) {
  return name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_") == name.npos;
}

inline constexpr double kMostDegrees = 1e6;  // of a turn

using Lengths = std::vector<std::pair<std::string, double>>;
inline const Lengths& scene_lengths() {
  static const Lengths lengths = {{"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}};
  return lengths;
}
inline std::string unit_of(double metres) {
  return std::ranges::find(scene_lengths(), metres, &Lengths::value_type::second)->first;
}

// Each table is read whole. scene: its unit and organs. scale: metres in a unit of the file. Errors: InputError with file, line, key, expected and found.
SceneConfig::Link read_link(TomlTable table, const SceneConfig& scene);
SceneConfig::Grasp read_grasp(TomlTable table, double scale);
// has_place: the tool has `at` or `near`, where the needle then enters.
SceneConfig::Needle read_needle(TomlTable table, double scale, bool has_place);
SceneConfig::GivenForce read_given_force(TomlTable table, double scale);
std::vector<SceneConfig::KeyFrame> read_turn(TomlTable& tool);
std::vector<SceneConfig::KeyFrame> key_frames(const std::vector<std::array<double, 4>>& rows, double scale);

SceneConfig::Motion read_motion(TomlTable table, const SceneConfig& scene);
SceneConfig::Load read_load(TomlTable table, const SceneConfig& scene);
SceneConfig::Obstacle read_obstacle(TomlTable table, const SceneConfig& scene);
// m, above 0, at most 1 m: the key `radius`.
double read_radius(TomlTable& table, double scale);
// Where what the scene moves is: one row of the key `position`, or the rows of `path` or `path_csv`; without all of them the origin. what: "an obstacle's
// path".
std::vector<SceneConfig::KeyFrame> read_way(TomlTable& table, double scale, const char* what);
// The rows of the key `path`, or of the file of `path_csv`, of which there must be exactly one. what: "a tool's path"; otherwise: the end of the
// sentence that refuses both and neither.
std::vector<SceneConfig::KeyFrame> read_path(TomlTable& table, double scale, const char* what, const char* otherwise);
// Of a table with the key `at`.
SceneConfig::Place::At read_at(TomlTable& table);

// Constraints of the palpate_link that a link of the scene makes: one for each stretch between two of its ends.
int stretches_of(const SceneConfig::Link& link);

// The numbers of rows [t, value] at a time: on straight lines between the rows, the first one before them, the last one after them.
double value_at(const std::vector<std::array<double, 2>>& rows, double time);

}  // namespace palpate
