// The path of a blade through an organ at rest, as a CSV file.
#pragma once

#include <array>
#include <filesystem>
#include <vector>

namespace palpate {

// The blade's edge, a line of points, at one place after the other. Between two places it sweeps a surface: two triangles for each of its
// segments, which share the diagonal from the earlier place of the first point to the later place of the second one.
struct BladePath {
  // In the unit of the mesh: 2 places or more, each of the same 2 points or more.
  std::vector<std::vector<std::array<double, 3>>> places;
};

// A row for each place: x, y, z of each point of the edge. Errors: InputError that names the line.
BladePath read_blade_path(const std::filesystem::path& file);

// The point of the swept surface that is nearest to a point. Cost: all triangles.
std::array<double, 3> nearest_on_path(const BladePath& path, const std::array<double, 3>& point);

}  // namespace palpate
