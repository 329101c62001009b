#include "meshing/image/label_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "formats/errors.h"

namespace palpate {
namespace {

constexpr std::size_t kMostLabels = 10'000;

// Adds a voxel to its label; half: how far a voxel reaches from its centre along x, y and z.
void add_voxel(LabelEntry& entry, const VoxelGrid& grid, const std::array<int, 3>& at,
               const std::array<double, 3>& half) {
  const std::array<double, 3> centre = grid.point(at[0], at[1], at[2]);
  for (int c = 0; c < 3; ++c) {
    entry.low[c] = std::min(entry.low[c], centre[c] - half[c]);
    entry.high[c] = std::max(entry.high[c], centre[c] + half[c]);
    entry.touches_border |= grid.size[c] > 1 && (at[c] == 0 || at[c] == grid.size[c] - 1);
  }
  ++entry.voxels;
}

}  // namespace

std::vector<LabelEntry> list_labels(const LabelImage& image, const std::string& image_name) {
  const VoxelGrid& grid = image.grid;
  std::array<double, 3> half{};
  for (int c = 0; c < 3; ++c)
    for (int a = 0; a < 3; ++a) half[c] += 0.5 * std::abs(grid.axis[a][c]);

  std::map<float, LabelEntry> found;
  std::vector<std::uint8_t> seen(grid.voxels());
  std::vector<std::array<int, 3>> front;
  const auto flood = [&](LabelEntry& entry, const std::array<int, 3>& seed) {
    const std::uint64_t before = entry.voxels;
    front.assign(1, seed);
    seen[grid.index(seed[0], seed[1], seed[2])] = 1;
    while (!front.empty()) {
      const std::array<int, 3> at = front.back();
      front.pop_back();
      add_voxel(entry, grid, at, half);
      for (int d = 0; d < 6; ++d) {
        std::array<int, 3> next = at;
        next[d / 2] += d % 2 ? 1 : -1;
        if (next[d / 2] < 0 || next[d / 2] >= grid.size[d / 2]) continue;
        const std::size_t v = grid.index(next[0], next[1], next[2]);
        if (seen[v] || image.values[v] != entry.label) continue;
        seen[v] = 1;
        front.push_back(next);
      }
    }
    ++entry.pieces;
    entry.largest_piece = std::max(entry.largest_piece, entry.voxels - before);
  };
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i) {
        const std::size_t v = grid.index(i, j, k);
        const float value = image.values[v];
        if (seen[v] || value == 0 || std::isnan(value)) continue;
        const auto [entry, is_new] = found.try_emplace(value);
        if (is_new) {
          constexpr double infinity = std::numeric_limits<double>::infinity();
          entry->second.label = value;
          entry->second.low.fill(infinity), entry->second.high.fill(-infinity);
        }
        if (found.size() > kMostLabels)
          throw InputError(
              fmt::format("{}: expected a label image, found more than {} different values (an image of grey values?); "
                          "segment it first, or choose with --threshold",
                          image_name, kMostLabels));
        flood(entry->second, {i, j, k});
      }

  std::vector<LabelEntry> labels;
  for (auto& [value, entry] : found) {
    entry.volume_mm3 = static_cast<double>(entry.voxels) * grid.voxel_volume();
    if (const auto name = image.names.find(value); name != image.names.end()) entry.name = name->second;
    labels.push_back(std::move(entry));
  }
  return labels;
}

std::string label_list_text(const std::vector<LabelEntry>& labels) {
  std::size_t width = 4;
  for (const LabelEntry& entry : labels) width = std::max(width, entry.name.size());
  std::string text = fmt::format("{:>6}  {:<{}} {:>12} {:>7} {:>7}  {}\n", "label", "name", width, "volume", "pieces",
                                 "border", "box in LPS mm: x, y, z");
  for (const LabelEntry& e : labels)
    text +=
        fmt::format("{:>6}  {:<{}} {:>8.4g} cm3 {:>7} {:>7}  {:.1f} .. {:.1f}, {:.1f} .. {:.1f}, {:.1f} .. {:.1f}\n",
                    e.label, e.name.empty() ? "-" : e.name, width, e.volume_mm3 / 1000, e.pieces,
                    e.touches_border ? "touches" : "-", e.low[0], e.high[0], e.low[1], e.high[1], e.low[2], e.high[2]);
  return text;
}

nlohmann::ordered_json label_list_json(const std::vector<LabelEntry>& labels) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const LabelEntry& e : labels)
    list.push_back({{"label", e.label},
                    {"name", e.name},
                    {"voxels", e.voxels},
                    {"volume_mm3", e.volume_mm3},
                    {"box_low_mm", e.low},
                    {"box_high_mm", e.high},
                    {"pieces", e.pieces},
                    {"touches_border", e.touches_border}});
  return list;
}

}  // namespace palpate
