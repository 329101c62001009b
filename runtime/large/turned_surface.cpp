#include "runtime/large/turned_surface.h"

namespace palpate {

bool TurnedSurface::create(SceneMemory& memory, const double* rest, std::int32_t nodes, const std::int32_t* triangles,
                           std::int32_t triangle_count) {
  rest_ = rest, triangles_ = triangles;
  const std::size_t corners = 3 * static_cast<std::size_t>(triangle_count);
  fan_start_ = memory.array<std::int32_t>(static_cast<std::size_t>(nodes) + 2);
  fan_ = memory.array<std::int32_t>(corners);
  if (memory.failed()) return false;
  // Counted two entries ahead, so that after the second pass each node's fan begins at its own entry.
  for (std::size_t c = 0; c < corners; ++c) ++fan_start_[triangles[c] + 2];
  for (std::int32_t n = 2; n < nodes + 2; ++n) fan_start_[n] += fan_start_[n - 1];
  for (std::size_t c = 0; c < corners; ++c) fan_[fan_start_[triangles[c] + 1]++] = static_cast<std::int32_t>(c / 3);
  return true;
}

// Source: Rodrigues' formula, with the axis and the angle between two unit vectors.
Mat3 TurnedSurface::rotation(Vec3 from, Vec3 to) {
  Mat3 r;
  for (int i = 0; i < 3; ++i) r.m[i][i] = 1;
  constexpr double farthest = -0.866;  // cosine
  const double cosine = dot(from, to);
  if (!(cosine > farthest) || dot(from, from) == 0 || dot(to, to) == 0) return r;
  const Vec3 axis = cross(from, to);
  if (dot(axis, axis) == 0) return r;
  const double share = 1 / (1 + cosine);
  const double skew[3][3] = {{0, -axis.z, axis.y}, {axis.z, 0, -axis.x}, {-axis.y, axis.x, 0}};
  const double squared = dot(axis, axis);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r.m[i][j] += skew[i][j] + share * (axis[i] * axis[j] - (i == j ? squared : 0));
  return r;
}

}  // namespace palpate
