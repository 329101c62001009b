#include "meshing/image/label_image.h"

#include <fmt/format.h>

#include <cmath>
#include <map>

namespace palpate {

std::array<double, 3> VoxelGrid::point(double i, double j, double k) const {
  std::array<double, 3> p = origin;
  for (int c = 0; c < 3; ++c) p[c] += i * axis[0][c] + j * axis[1][c] + k * axis[2][c];
  return p;
}

std::array<double, 3> VoxelGrid::spacing() const {
  const auto length = [](const std::array<double, 3>& a) { return std::hypot(a[0], a[1], a[2]); };
  return {length(axis[0]), length(axis[1]), length(axis[2])};
}

namespace {
double determinant(const std::array<std::array<double, 3>, 3>& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}
}  // namespace

double VoxelGrid::voxel_volume() const {
  return std::abs(determinant(axis));
}

bool VoxelGrid::left_handed() const {
  return determinant(axis) < 0;
}

namespace {
constexpr std::size_t kGreyValues = 12;
}

std::string describe_values(const LabelImage& image, std::size_t limit) {
  // An image of real numbers can have as many values as voxels, so the map keeps the smallest ones only.
  std::map<float, std::uint64_t> counts;
  bool more = false;
  for (const float value : image.values) {
    const auto found = counts.find(value);
    if (found != counts.end()) {
      ++found->second;
    } else if (std::isnan(value) || (counts.size() == limit && value > counts.rbegin()->first)) {
      more = true;
    } else {
      if (counts.size() == limit) {
        counts.erase(std::prev(counts.end()));
        more = true;
      }
      counts.emplace(value, 1);
    }
  }
  // so many values are grey values, of which the first few tell enough
  while (more && counts.size() > kGreyValues) counts.erase(std::prev(counts.end()));
  std::string text;
  for (const auto& [value, count] : counts) {
    const auto name = image.names.find(value);
    text += fmt::format("{}{}{} ({} voxels)", text.empty() ? "" : ", ", value,
                        name == image.names.end() ? "" : " " + name->second, count);
  }
  return more ? text + ", ..." : text;
}

}  // namespace palpate
