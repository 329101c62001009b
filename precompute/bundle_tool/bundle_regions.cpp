#include "precompute/bundle_tool/bundle_regions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

namespace palpate {

using namespace formats;

namespace {

using Point = std::array<double, 3>;

double area_of(const Point& a, const Point& b, const Point& c) {
  const Point u = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  return 0.5 * std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
}

std::vector<Point> nodes_of(const BundleFile& file) {
  const auto numbers = file.numbers<double>(SectionId::nodes);
  std::vector<Point> nodes(numbers.size() / 3);
  for (std::size_t n = 0; n < nodes.size(); ++n)
    for (int d = 0; d < 3; ++d) nodes[n][d] = 1e3 * numbers[3 * n + static_cast<std::size_t>(d)];
  return nodes;
}

std::vector<double> node_areas(const BundleFile& file, const std::vector<Point>& nodes) {
  std::vector<double> areas(nodes.size());
  const auto triangles = file.numbers<std::int32_t>(SectionId::triangles);
  const auto present = [&](std::int32_t n) { return n >= 0 && static_cast<std::size_t>(n) < nodes.size(); };
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
    const std::int32_t a = triangles[t], b = triangles[t + 1], c = triangles[t + 2];
    if (!present(a) || !present(b) || !present(c)) continue;
    const double third = area_of(nodes[a], nodes[b], nodes[c]) / 3;
    areas[a] += third, areas[b] += third, areas[c] += third;
  }
  return areas;
}

}  // namespace

nlohmann::json regions_json(const BundleFile& file) {
  const std::vector<Point> nodes = nodes_of(file);
  const std::vector<double> areas = node_areas(file, nodes);
  double whole = 0;
  for (const double area : areas) whole += area;

  const auto region = [&](const std::vector<char>& in) {
    Point low{}, high{};
    low.fill(std::numeric_limits<double>::infinity()), high.fill(-std::numeric_limits<double>::infinity());
    std::size_t count = 0;
    double area = 0;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      if (!in[n]) continue;
      ++count, area += areas[n];
      for (int d = 0; d < 3; ++d) low[d] = std::min(low[d], nodes[n][d]), high[d] = std::max(high[d], nodes[n][d]);
    }
    nlohmann::json json = {{"nodes", count}, {"area_mm2", area}, {"share", whole > 0 ? area / whole : 0}};
    json["box_mm"] = count ? nlohmann::json::array({low, high}) : nlohmann::json();
    return json;
  };

  std::vector<char> touchable(nodes.size()), held(nodes.size());
  for (const std::int32_t n : file.numbers<std::int32_t>(SectionId::touchable))
    if (n >= 0 && static_cast<std::size_t>(n) < nodes.size()) touchable[n] = 1;
  const auto fixed = file.numbers<std::uint8_t>(SectionId::fixed);
  for (std::size_t i = 0; i < std::min(fixed.size(), 3 * nodes.size()); ++i) held[i / 3] |= fixed[i] != 0;
  std::vector<char> supported(nodes.size());
  const auto foundation = file.numbers<double>(SectionId::foundation);
  const auto triangles = file.numbers<std::int32_t>(SectionId::triangles);
  for (std::size_t i = 0; i < std::min(triangles.size(), 3 * (foundation.size() / 2)); ++i)
    if (foundation[2 * (i / 3)] > 0 || foundation[2 * (i / 3) + 1] > 0)
      if (const auto n = triangles[i]; n >= 0 && static_cast<std::size_t>(n) < nodes.size()) supported[n] = 1;
  return {{"organ", region(std::vector<char>(nodes.size(), 1))},
          {"touchable", region(touchable)},
          {"held", region(held)},
          {"supported", region(supported)}};
}

}  // namespace palpate
