#include "meshing/cut/blade_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "formats/csv_lines.h"
#include "formats/errors.h"
#include "meshing/cut/nearest_of_triangles.h"

namespace palpate {

BladePath read_blade_path(const std::filesystem::path& file) {
  CsvLines lines(file, "the path of a blade");
  BladePath path;
  std::size_t numbers = 0;
  while (lines.next()) {
    if (lines.may_be_heading()) continue;
    const auto found = 1 + static_cast<std::size_t>(std::ranges::count(lines.text(), ','));
    if (numbers == 0 && (found < 6 || found % 3 != 0))
      lines.refuse("x, y, z of each point of the blade's edge, two points or more: 6, 9, 12, ... numbers");
    if (numbers == 0) numbers = found;
    std::vector<double> row(numbers);
    if (!read_csv_numbers(lines.text(), row.data(), numbers))
      lines.refuse(fmt::format("{} numbers, as in the first row", numbers));
    std::vector<std::array<double, 3>>& place = path.places.emplace_back();
    for (std::size_t i = 0; i < numbers; i += 3) place.push_back({row[i], row[i + 1], row[i + 2]});
  }
  if (path.places.size() < 2)
    throw InputError(fmt::format("{}: expected two places of the blade or more, a row for each, found {}",
                                 file.string(), path.places.size()));
  return path;
}

std::array<double, 3> nearest_on_path(const BladePath& path, const std::array<double, 3>& point) {
  NearestOfTriangles nearest(point);
  for (std::size_t i = 0; i + 1 < path.places.size(); ++i)
    for (std::size_t k = 0; k + 1 < path.places[i].size(); ++k) {
      const Vec3 a = load3(path.places[i][k].data()), b = load3(path.places[i][k + 1].data());
      const Vec3 c = load3(path.places[i + 1][k].data()), d = load3(path.places[i + 1][k + 1].data());
      nearest.take(a, b, d), nearest.take(a, d, c);
    }
  return nearest.point();
}

}  // namespace palpate
