// Which triangles of a surface cross, by all pairs and exact signs: the reference of palpate_scene_crossings.
#pragma once

#include <algorithm>
#include <array>
#include <set>
#include <vector>

#include "runtime/surface/exact_signs.h"

namespace palpate::tests {

using PairOfTriangles = std::array<std::int32_t, 2>;

// Whether the edge from p to q passes through the inside of the triangle.
inline bool passes_exactly(Vec3 p, Vec3 q, const Vec3 corner[3]) {
  const auto plane = [&](Vec3 x) {
    return exact_sign_of_determinant({corner[1], corner[0]}, {corner[2], corner[0]}, {x, corner[0]});
  };
  if (plane(p) * plane(q) >= 0) return false;
  int sum = 0;
  for (int c = 0; c < 3; ++c)
    sum += exact_sign_of_determinant({p, corner[c]}, {corner[(c + 1) % 3], corner[c]}, {q, p});
  return sum == 3 || sum == -3;
}

// positions: [nodes][3] m.
inline std::set<PairOfTriangles> crossed_triangles(const std::vector<float>& positions,
                                                   const std::vector<std::array<std::int32_t, 3>>& triangles) {
  std::set<PairOfTriangles> found;
  const auto at = [&](std::int32_t node) {
    const float* const x = &positions[3 * static_cast<std::size_t>(node)];
    return Vec3{x[0], x[1], x[2]};
  };
  const auto meets = [&](const std::array<std::int32_t, 3>& of, const std::array<std::int32_t, 3>& other) {
    const Vec3 corner[3] = {at(other[0]), at(other[1]), at(other[2])};
    const auto shared = [&](std::int32_t node) { return node == other[0] || node == other[1] || node == other[2]; };
    for (int c = 0; c < 3; ++c) {
      const std::int32_t p = of[c], q = of[(c + 1) % 3];
      if (!shared(p) && !shared(q) && passes_exactly(at(p), at(q), corner)) return true;
    }
    return false;
  };
  // Triangles whose boxes are apart do not cross.
  const auto count = static_cast<std::int32_t>(triangles.size());
  std::vector<std::array<float, 6>> boxes;
  for (const auto& triangle : triangles) {
    std::array<float, 6>& box = boxes.emplace_back();
    for (std::size_t d = 0; d < 3; ++d) {
      const auto [low, high] = std::minmax({positions[3 * static_cast<std::size_t>(triangle[0]) + d],
                                            positions[3 * static_cast<std::size_t>(triangle[1]) + d],
                                            positions[3 * static_cast<std::size_t>(triangle[2]) + d]});
      box[d] = low, box[3 + d] = high;
    }
  }
  const auto are_apart = [](const std::array<float, 6>& a, const std::array<float, 6>& b) {
    for (std::size_t d = 0; d < 3; ++d)
      if (a[d] > b[3 + d] || b[d] > a[3 + d]) return true;
    return false;
  };
  for (std::int32_t a = 0; a < count; ++a)
    for (std::int32_t b = a + 1; b < count; ++b)
      if (!are_apart(boxes[static_cast<std::size_t>(a)], boxes[static_cast<std::size_t>(b)]) &&
          (meets(triangles[a], triangles[b]) || meets(triangles[b], triangles[a])))
        found.insert({a, b});
  return found;
}

}  // namespace palpate::tests
