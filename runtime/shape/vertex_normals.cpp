#include "runtime/shape/vertex_normals.h"

#include <algorithm>

#include "runtime/surface/surface_tree.h"

namespace palpate {

bool find_vertex_normals(const float* positions, std::int32_t nodes, const std::int32_t* triangles,
                         std::int32_t triangle_count, const std::uint8_t* active, float* normals) {
  bool all_finite = true;
  std::fill(normals, normals + 3 * static_cast<std::size_t>(nodes), 0.0f);
  for (std::int32_t t = 0; t < triangle_count; ++t) {
    if (active && !active[t]) continue;
    const std::int32_t* node = triangles + 3 * static_cast<std::size_t>(t);
    Vec3 corner[3];
    for (int v = 0; v < 3; ++v) {
      const float* p = positions + 3 * static_cast<std::size_t>(node[v]);
      corner[v] = {p[0], p[1], p[2]};
    }
    const Vec3 normal = unit_or_zero(cross(corner[1] - corner[0], corner[2] - corner[0]));
    all_finite = all_finite && is_finite(corner[0]) && is_finite(corner[1]) && is_finite(corner[2]);
    if (dot(normal, normal) == 0) continue;
    for (int v = 0; v < 3; ++v) {
      const double angle = corner_angle(corner[v], corner[(v + 1) % 3], corner[(v + 2) % 3]);
      for (int d = 0; d < 3; ++d)
        normals[3 * static_cast<std::size_t>(node[v]) + static_cast<std::size_t>(d)] +=
            static_cast<float>(angle * normal[d]);
    }
  }
  for (std::int32_t n = 0; n < nodes; ++n) {
    float* out = normals + 3 * static_cast<std::size_t>(n);
    const Vec3 unit = unit_or_zero({out[0], out[1], out[2]});
    for (int d = 0; d < 3; ++d) out[d] = static_cast<float>(unit[d]);
  }
  return all_finite;
}

}  // namespace palpate
