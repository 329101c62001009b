#include "runtime/cut/divided_surface.h"

#include <cmath>

namespace palpate {
namespace {

// A triangle is divided into kParts^2 like parts: each counts where its middle is in the disc.
constexpr int kParts = 8;

}  // namespace

DividedNodes::Pair DividedSurface::pair(std::int32_t k) const {
  const std::int32_t node = tissue().rest_nodes() + k;
  return {target_->surface_node(node), target_->surface_node(tissue().parent(node))};
}

// Calls visit(face, node now) for the faces around a node as it was when `seen` new nodes were made: those of the surface at rest, or those of
// lips.
template <class Visit>
void DividedSurface::for_each_face(std::int32_t node, std::int32_t seen, bool of_lips, Visit visit) const {
  const RestMesh& rest = mesh_->state().rest();
  for (const std::int32_t corner : rest.star(tissue().origin(node))) {
    const std::int32_t e = corner / 4, now = tissue().corners(e)[corner % 4];
    std::int32_t before = now;
    while (before >= tissue().rest_nodes() + seen) before = tissue().parent(before);
    if (before != node || !tissue().is_left(e)) continue;
    for (std::int32_t face = 4 * e; face < 4 * e + 4; ++face)
      if (face != corner && (rest.neighbour(face) < 0 ? !of_lips : of_lips && mesh_->state().open(face)))
        visit(face, now);
  }
}

void DividedSurface::measure(std::int32_t face, Vec3 middle, double radius, Part* part) const {
  const std::int32_t* const nodes = tissue().corners(face / 4);
  Vec3 at[3];
  for (int v = 0; v < 3; ++v) at[v] = rest_of(nodes[kFaceCorners[face % 4][v]]);
  const double area = 0.5 * length(cross(at[1] - at[0], at[2] - at[0])) / (kParts * kParts);
  const auto take = [&](double i, double j) {
    const double far = length(at[0] + (i / kParts) * (at[1] - at[0]) + (j / kParts) * (at[2] - at[0]) - middle);
    part->area += far <= radius ? area : 0;
    part->distance = std::fmin(part->distance, far);
  };
  for (int i = 0; i < kParts; ++i)
    for (int j = 0; i + j < kParts; ++j) {
      take(i + 1.0 / 3, j + 1.0 / 3);
      if (i + j + 1 < kParts) take(i + 2.0 / 3, j + 2.0 / 3);
    }
}

std::int32_t DividedSurface::now(std::int32_t node, std::int32_t seen, const SurfacePoint& place, double radius) const {
  const std::int32_t own = target_->node_of_mesh(node), first = tissue().rest_nodes(), origin = tissue().origin(own);
  bool divided = false;
  for (std::int32_t k = seen; k < made() && !divided; ++k) divided = tissue().origin(first + k) == origin;
  if (!divided) return node;
  Vec3 middle;
  for (int v = 0; v < 3; ++v) {
    const std::int32_t corner =
        surface_->triangles()[3 * static_cast<std::size_t>(place.triangle) + static_cast<std::size_t>(v)];
    middle += place.barycentric[v] * load3(rest_ + 3 * static_cast<std::size_t>(corner));
  }
  Part parts[kMostParts] = {{own, 0, HUGE_VAL}};
  int count = 1;
  bool found = false;
  const auto take = [&](std::int32_t face, std::int32_t now) {
    int p = 0;
    while (p < count && parts[p].node != now) ++p;
    if (p == kMostParts) return;
    if (p == count) parts[count++] = {now, 0, HUGE_VAL};
    measure(face, middle, radius, &parts[p]);
    if (surface_->triangle_of(face) == place.triangle) parts[p].distance = -1;
    found = true;
  };
  for_each_face(own, seen, false, take);
  if (!found) for_each_face(own, seen, true, take);
  const Part* best = parts;
  for (const Part* p = parts; p < parts + count; ++p)
    if (p->area > best->area || (p->area == 0 && best->area == 0 && p->distance < best->distance)) best = p;
  return target_->surface_node(best->node);
}

}  // namespace palpate
