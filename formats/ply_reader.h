// Triangles of a PLY file, text or binary.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace palpate {

struct PlyTriangles {
  std::vector<std::array<double, 3>> points;  // in the file's unit
  std::vector<std::array<std::int32_t, 3>> triangles;
};

// Polygons are cut into fans. bytes: the whole file; file: its name, for refusals.
// Errors: InputError with the line or byte: not a number or not finite, an index out of range, counts that do not fit the
// file's size, a file that ends early. not_finite: where given, takes the points whose coordinates are not finite, each with
// the sentence that would refuse it, and they are not refused.
PlyTriangles read_ply(const std::filesystem::path& file, const std::string& bytes,
                      std::map<std::int32_t, std::string>* not_finite = nullptr);

// Appends a polygon as a fan after checking its indices against the number of points. where names the face in a
// refusal. Errors: InputError.
void add_polygon(const std::filesystem::path& file, const std::string& where, const std::vector<std::int64_t>& corners,
                 std::size_t points, std::vector<std::array<std::int32_t, 3>>& triangles);

}  // namespace palpate
