#include "runtime/large/turned_surface.h"

namespace palpate {

bool TurnedSurface::create(SceneMemory& memory, const Source& source) {
  source_ = source;
  if (source.fans) return true;
  source_.fans = &own_;
  return own_.build(memory, source.nodes, source.triangles, source.triangle_count);
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
