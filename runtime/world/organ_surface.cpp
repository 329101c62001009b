#include "runtime/world/organ_surface.h"

namespace palpate {
namespace {

constexpr double kSmooth = 0.9063;  // cosine of 25 degrees

}  // namespace

bool OrganSurface::create(SceneMemory& memory, const SurfaceTree* tree) {
  tree_ = tree;
  normal_ = memory.array<Vec3>(static_cast<std::size_t>(tree->surface_nodes()));
  area_ = memory.array<double>(static_cast<std::size_t>(tree->surface_nodes()));
  if (memory.failed()) return false;
  for (std::int32_t t = 0; t < tree->triangle_count(); ++t) {
    const std::int32_t* const corner = tree->corners(t);
    const Vec3 a = tree->at_rest(corner[0]);
    const Vec3 twice = cross(tree->at_rest(corner[1]) - a, tree->at_rest(corner[2]) - a);
    for (int v = 0; v < 3; ++v) normal_[corner[v]] += twice, area_[corner[v]] += length(twice) / 6;
  }
  for (std::int32_t n = 0; n < tree->surface_nodes(); ++n) normal_[n] = unit_or_zero(normal_[n]);
  return true;
}

OrganSurface::Smooth OrganSurface::at(const SurfacePoint& place) const {
  const Vec3 flat = tree_->outward_at_rest(place.triangle), at = tree_->at_rest(place);
  const std::int32_t* const corner = tree_->corners(place.triangle);
  Smooth smooth;
  for (int v = 0; v < 3; ++v) {
    const Vec3 normal = dot(normal_[corner[v]], flat) > kSmooth ? normal_[corner[v]] : flat;
    smooth.normal += place.barycentric[v] * normal;
    smooth.bulge += 0.5 * place.barycentric[v] * dot(normal, tree_->at_rest(corner[v]) - at);
  }
  smooth.normal = unit_or_zero(smooth.normal);
  if (length(smooth.normal) == 0) smooth.normal = flat;
  return smooth;
}

}  // namespace palpate
