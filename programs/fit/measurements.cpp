#include "programs/fit/measurements.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "formats/csv_lines.h"
#include "formats/errors.h"
#include "formats/program.h"

namespace palpate::fit {
namespace {

enum Column { kX, kY, kZ, kRadius, kBallRadius, kDepth, kForce, kColumns };
constexpr const char* kNames[kColumns] = {"x", "y", "z", "radius", "ball_radius", "depth", "force"};
constexpr std::pair<const char*, double> kLengths[] = {{"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}};
constexpr std::pair<const char*, double> kForces[] = {{"N", 1}, {"mN", 1e-3}};

constexpr double kRounding = 1e-9;  // of a depth whose unit was converted

// The cells of a line. A cell may be quoted; a doubled quote within it is one quote. None: a quote without its end.
std::optional<std::vector<std::string>> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"')
      cells.back() += line[++i];
    else if (line[i] == '"')
      quoted = !quoted;
    else if (line[i] == ',' && !quoted)
      cells.emplace_back();
    else
      cells.back() += line[i];
  }
  if (quoted) return std::nullopt;
  for (std::string& cell : cells) {
    const auto begin = cell.find_first_not_of(" \t"), end = cell.find_last_not_of(" \t");
    cell = begin == std::string::npos ? "" : cell.substr(begin, end - begin + 1);
  }
  return cells;
}

struct Header {
  int column[kColumns];  // -1: the file has none
  double unit[kColumns];
  int place = -1, source = -1, specimen = -1, indenter = -1;
  std::vector<std::string> titles;
};

class Reader {
 public:
  Reader(const std::filesystem::path& file, const ReadOptions& options)
      : options_(options), lines_(file, "measurements") {
    result_.file = file;
    bool has_header = false;
    while (lines_.next()) {
      const auto cells = cells_of(lines_.text());
      if (!cells) lines_.refuse("a quote at the end of the quoted cell");
      has_header ? read_row(*cells) : read_header(*cells);
      has_header = true;
    }
    if (!has_header) refuse_columns("found no header");
    if (result_.rows.empty())
      throw InputError(fmt::format("{}: expected rows with a depth above 0{}, found none", file.string(),
                                   options_.curves        ? " with a force above 0 and within the depths asked for"
                                   : result_.left_out > 0 ? " and within --most-depth and --least-depth"
                                                          : ""));
    result_.sha256 = sha256_of_file(file.string());
  }
  Measurements take() { return std::move(result_); }

 private:
  [[noreturn]] void refuse(const std::string& expected, const std::string& found) const {
    lines_.refuse(expected, found);
  }
  [[noreturn]] void refuse_columns(const std::string& found) const {
    throw InputError(fmt::format(
        "{}:{}: expected a header with {}depth_mm and force_N, and optionally place and source; {}",
        result_.file.string(), std::max(lines_.number(), 1),
        options_.plate ? "" : (options_.radius > 0 ? "x_mm, y_mm, z_mm, " : "x_mm, y_mm, z_mm, radius_mm, "), found));
  }

  void read_header(const std::vector<std::string>& cells) {
    header_.titles = cells;
    std::fill_n(header_.column, kColumns, -1);
    for (int c = 0; c < static_cast<int>(cells.size()); ++c) {
      const std::string& title = cells[c];
      if (title == "place" || title == "source" || title == "indenter" || (title == "specimen" && options_.curves)) {
        int& column = title == "place"      ? header_.place
                      : title == "source"   ? header_.source
                      : title == "indenter" ? header_.indenter
                                            : header_.specimen;
        if (column >= 0) refuse_columns(fmt::format("found \"{}\" twice", title));
        column = c;
      } else if (!read_title(title, c)) {
        result_.unused.push_back(title);
      }
    }
    expect_one_radius();
    for (int q = 0; q < kColumns; ++q) {
      const bool of_radius = q == kRadius || q == kBallRadius, of_place = q < kRadius || of_radius;
      const bool given = of_radius && options_.radius > 0;
      if (of_place && header_.column[q] >= 0 && (options_.plate || given))
        refuse_columns(fmt::format("found \"{}\", although {}", cells[header_.column[q]],
                                   options_.plate ? "a plate has no place" : "--radius is given"));
      if (header_.column[q] >= 0 || (of_place && options_.plate) || given) continue;
      if (of_radius && header_.column[q == kRadius ? kBallRadius : kRadius] >= 0) continue;
      const bool semicolons = cells.size() == 1 && cells[0].find(';') != std::string::npos;
      refuse_columns(fmt::format(
          "found no column for {}{}{}", kNames[q],
          q == kRadius
              ? "; add the radius of the indenter's flat end as a column, or give it with --radius MM; a ball has "
                "ball_radius_mm instead"
              : "",
          semicolons ? "; separate the columns by commas, not by semicolons, and write decimal points" : ""));
    }
  }

  void expect_one_radius() const {
    if (header_.column[kRadius] >= 0 && header_.column[kBallRadius] >= 0)
      refuse_columns("found both a radius (of a flat end) and a ball_radius; write two files, one for each indenter");
  }

  // "depth_mm" and the like. False: no quantity of ours.
  bool read_title(const std::string& title, int column) {
    const auto bar = title.rfind('_');
    std::string name = title.substr(0, bar);
    if (name == "displacement") name = kNames[kDepth];
    const auto* found = std::find(std::begin(kNames), std::end(kNames), name);
    if (found == std::end(kNames)) return false;
    const auto q = found - std::begin(kNames);
    const std::string unit = bar == std::string::npos ? "" : title.substr(bar + 1);
    double factor = 0;
    const auto look = [&](const auto& units) {
      for (const auto& [word, value] : units)
        if (unit == word) factor = value;
    };
    q == kForce ? look(kForces) : look(kLengths);
    if (factor == 0)
      refuse(
          fmt::format("the column {0} with its unit, {0}_{1}", name, q == kForce ? "N or _mN" : "m, _cm, _mm or _um"),
          title);
    if (header_.column[q] >= 0) refuse_columns(fmt::format("found {} twice", name));
    header_.column[q] = column, header_.unit[q] = factor;
    return true;
  }

  double number(const std::vector<std::string>& cells, Column q) const {
    const int column = header_.column[q];
    const std::string& cell = cells[column];
    char* end = nullptr;
    const double value = std::strtod(cell.c_str(), &end);
    if (cell.empty() || *end != '\0' || !std::isfinite(value))
      refuse(fmt::format("a number in the column {}", header_.titles[column]), cell);
    return value * header_.unit[q];
  }

  void read_row(const std::vector<std::string>& cells) {
    if (cells.size() != header_.titles.size())
      refuse(fmt::format("{} cells as in the header", header_.titles.size()), fmt::format("{}", fmt::join(cells, ",")));
    Row row;
    row.depth = number(cells, kDepth), row.force = number(cells, kForce);
    if (row.depth < 0)
      refuse("a depth of at least 0, from first contact into the organ", cells[header_.column[kDepth]]);
    if (header_.source >= 0) remember(result_.sources, cells[header_.source]);
    if (header_.indenter >= 0) check_indenter(cells[header_.indenter]);
    Spot spot;
    spot.line = lines_.number(), spot.radius = options_.radius;
    std::string place = "all";
    if (!options_.plate) {
      for (const Column q : {kX, kY, kZ}) spot.at[q] = number(cells, q);
      const Column radius = header_.column[kBallRadius] >= 0 ? kBallRadius : kRadius;
      if (header_.column[radius] >= 0) spot.radius = number(cells, radius);
      if (!(spot.radius > 0)) refuse("a radius above 0", cells[header_.column[radius]]);
      if (radius == kBallRadius) spot.ball_depth = row.depth;
      place = fmt::format("({:g}, {:g}, {:g}) mm", 1e3 * spot.at[0], 1e3 * spot.at[1], 1e3 * spot.at[2]);
    }
    if (header_.place >= 0) place = cells[header_.place];
    if (place.empty()) refuse("a name in the column place", "");
    if (row.depth == 0) return;  // it says nothing about a force that is proportional to the depth
    if (row.depth > (1 + kRounding) * options_.most_depth || row.depth < (1 - kRounding) * options_.least_depth) {
      ++result_.left_out;
      return;
    }
    if (options_.curves && !(row.force > 0)) {
      ++result_.without_push;
      return;
    }
    if (header_.specimen >= 0) {
      if (cells[header_.specimen].empty()) refuse("a name in the column specimen", "");
      row.specimen = remember(result_.specimens, cells[header_.specimen]);
    }
    spot.place = remember(result_.places, place);
    const auto same = [&](const Spot& other) {
      return other.place == spot.place && other.at == spot.at && other.radius == spot.radius &&
             other.ball_depth == spot.ball_depth;
    };
    const auto known = std::find_if(result_.spots.begin(), result_.spots.end(), same);
    row.spot = static_cast<int>(known - result_.spots.begin());
    if (known == result_.spots.end()) result_.spots.push_back(spot);
    result_.rows.push_back(row);
  }

  // The column says in words what the other columns and --plate say.
  void check_indenter(const std::string& word) const {
    if (word != "disc" && word != "ball" && word != "plate") refuse("disc, ball or plate in the column indenter", word);
    if (options_.plate != (word == "plate"))
      refuse(options_.plate ? "plate in the column indenter, as --plate says" : "--plate for the indenter plate", word);
    const bool ball = header_.column[kBallRadius] >= 0;
    if (!options_.plate && ball != (word == "ball"))
      refuse(ball ? "ball in the column indenter, beside ball_radius" : "a column ball_radius_mm for the indenter ball",
             word);
  }

  static int remember(std::vector<std::string>& texts, const std::string& text) {
    const auto known = std::find(texts.begin(), texts.end(), text);
    const auto index = static_cast<int>(known - texts.begin());
    if (known == texts.end() && !text.empty()) texts.push_back(text);
    return index;
  }

  ReadOptions options_;
  CsvLines lines_;
  Measurements result_;
  Header header_;
};

}  // namespace

Measurements read_measurements(const std::filesystem::path& file, const ReadOptions& options) {
  return Reader(file, options).take();
}

}  // namespace palpate::fit
