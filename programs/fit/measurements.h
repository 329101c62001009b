// The CSV file of measured forces: one row for each depth at which the force of an indenter was read.
#pragma once

#include <array>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

namespace palpate::fit {

// A place of the organ and the indenter that pressed it there. Rows with the same place, point and radius share one spot; each row
// of a ball has a spot of its own, because its contact grows with the depth.
struct Spot {
  std::array<double, 3> at{};  // m, in the bundle's frame
  double radius = 0;           // m: of the flat end, or of the ball
  int place = 0;               // index into Measurements::places
  int line = 0;                // of its first row, for refusals
  double ball_depth = 0;       // m; above 0: a ball that is pressed so deep
};

struct Row {
  int spot = 0;
  double depth = 0, force = 0;  // m from first contact, N
  int specimen = 0;             // index into Measurements::specimens
};

struct Measurements {
  std::filesystem::path file;
  std::string sha256;
  std::vector<Spot> spots;
  std::vector<std::string> places;     // the column place, else the point in words
  std::vector<std::string> specimens;  // the column specimen, where it is asked for
  std::vector<Row> rows;               // at a depth above 0
  std::vector<std::string> sources;    // each text of the column source once, in order
  std::vector<std::string> unused;     // columns that are not read
  int left_out = 0;                    // rows deeper or shallower than asked for
  int without_push = 0;                // curves: rows that were left out because their force is not above 0
};

struct ReadOptions {
  bool plate = false;  // a plate presses everything at once: the file has columns for neither point nor radius
  double radius = 0;   // m; above 0: the radius of every row's flat end, and the file has no column for it
  double most_depth = std::numeric_limits<double>::infinity();  // m; deeper rows are left out
  double least_depth = 0;                                       // m; shallower rows are left out
  bool curves = false;  // for a fit under large strain: the column specimen counts, and rows push
};

// docs/files.md explains the columns. Errors: InputError that names the file and the line.
Measurements read_measurements(const std::filesystem::path& file, const ReadOptions& options);

}  // namespace palpate::fit
