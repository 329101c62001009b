// Closed triangle surfaces with known volumes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "meshing/surface/triangle_surface.h"

namespace palpate::tests {

// A sphere: an icosahedron whose triangles are split in four `splits` times, with its points moved onto the sphere. Triangles
// point outward.
inline TriangleSurface sphere_surface(int splits, double radius, Point centre = {0, 0, 0}) {
  const double g = std::numbers::phi;
  std::vector<Point> points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                               {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  std::vector<Triangle> triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                     {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                     {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                     {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  const auto normalise = [&](Point& p) { p = (1 / std::sqrt(dot(p, p))) * p; };
  for (Point& p : points) normalise(p);
  for (int s = 0; s < splits; ++s) {
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middle_of;
    const auto middle = [&](std::int32_t a, std::int32_t b) {
      const auto [found, fresh] = middle_of.emplace(std::minmax(a, b), static_cast<std::int32_t>(points.size()));
      if (fresh) {
        points.push_back(points[a] + points[b]);
        normalise(points.back());
      }
      return found->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : triangles) {
      const std::int32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    triangles = finer;
  }
  for (Point& p : points) p = centre + radius * p;
  return {points, triangles};
}

// The surface of a box: each face is n x n squares of two triangles. Triangles point outward.
TriangleSurface box_surface(int n, Point low, Point high);

void turn_inside_out(TriangleSurface& surface);

void append(TriangleSurface& surface, const TriangleSurface& other);

void write_off(const std::string& file, const TriangleSurface& surface);

}  // namespace palpate::tests
