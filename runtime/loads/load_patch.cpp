#include "runtime/loads/load_patch.h"

#include <cmath>
#include <numbers>

namespace palpate {
namespace {

// Each triangle is divided into kParts^2 like parts: a part counts whole where its middle is in the patch.
constexpr int kParts = 16;
// Triangles of the patch face as that of its middle does, within 60 degrees: the other side of a thin organ does not.
constexpr double kFaces = 0.5;

// Calls visit(barycentric) for the middle of each part.
template <class Visit>
void for_each_part(const Visit& visit) {
  const auto at = [&](double i, double j) {
    const double b[3] = {i / kParts, j / kParts, 1 - (i + j) / kParts};
    visit(b);
  };
  for (int i = 0; i < kParts; ++i)
    for (int j = 0; i + j < kParts; ++j) {
      at(i + 1.0 / 3, j + 1.0 / 3);
      if (i + j + 1 < kParts) at(i + 2.0 / 3, j + 2.0 / 3);
    }
}

Vec3 place(const Vec3 corner[3], const double b[3]) {
  return b[0] * corner[0] + b[1] * corner[1] + b[2] * corner[2];
}

// m^2 that belong to each node of the triangle, added. Returns the sum.
double add_triangle(const SurfaceIndex& surface, const std::int32_t* triangles, std::int32_t t, Vec3 middle,
                    double radius, double* area_of_node) {
  const Vec3 corner[3] = {surface.corner(t, 0), surface.corner(t, 1), surface.corner(t, 2)};
  const double part = 0.5 * length(cross(corner[1] - corner[0], corner[2] - corner[0])) / (kParts * kParts);
  double sum = 0;
  for_each_part([&](const double* b) {
    if (length(place(corner, b) - middle) > radius) return;
    sum += part;
    for (int v = 0; v < 3; ++v) area_of_node[triangles[3 * static_cast<std::size_t>(t) + v]] += b[v] * part;
  });
  return sum;
}

}  // namespace

bool find_patch(SceneMemory& memory, SurfaceIndex& surface, const std::int32_t* triangles, std::int32_t nodes,
                Vec3 centre, double radius, LoadPatch* patch) {
  const SurfacePoint nearest = surface.nearest(centre);
  if (nearest.triangle < 0) return true;
  const Vec3 middle = surface.position(nearest), outward = surface.outward(nearest.triangle);
  if (length(middle - centre) > radius) return true;
  SceneMemory scratch = memory.of_same_host();
  double* const area = scratch.array<double>(static_cast<std::size_t>(nodes));
  if (!area) return false;
  for (std::int32_t t = 0; t < surface.triangle_count(); ++t)
    if (surface.is_active(t) && dot(surface.outward(t), outward) > kFaces)
      patch->area += add_triangle(surface, triangles, t, middle, radius, area);
  if (patch->area == 0) {
    patch->area = std::numbers::pi * radius * radius;
    for (int v = 0; v < 3; ++v)
      area[triangles[3 * static_cast<std::size_t>(nearest.triangle) + v]] = nearest.barycentric[v] * patch->area;
  }
  for (std::int32_t n = 0; n < nodes; ++n) patch->count += area[n] > 0;
  patch->node = memory.array<std::int32_t>(static_cast<std::size_t>(patch->count));
  patch->weight = memory.array<double>(static_cast<std::size_t>(patch->count));
  for (std::int32_t n = 0, i = 0; n < nodes && !memory.failed(); ++n)
    if (area[n] > 0) patch->node[i] = n, patch->weight[i++] = area[n] / patch->area;
  scratch.release_all();
  return !memory.failed();
}

}  // namespace palpate
