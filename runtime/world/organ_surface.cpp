#include "runtime/world/organ_surface.h"

#include <algorithm>

namespace palpate {
namespace {

constexpr double kSmooth = 0.9063;  // cosine of 25 degrees
constexpr double kFolded = 0.5;     // cosine of 60 degrees

}  // namespace

bool OrganSurface::create(SceneMemory& memory, palpate_scene& organ) {
  TouchState& touch = organ.touch;
  tree_ = &touch.tree, deformed_ = &touch.deformed, touched_ = &touch.surface;
  if (const TouchedSurface& mesh = touch.surface; mesh.bound) {
    tree_ = &own_tree_, deformed_ = &own_deformed_;
    if (!tree_->build(memory, mesh.rest, organ.tensors.surface_nodes, mesh.triangles, mesh.triangle_count) ||
        !deformed_->create(memory, tree_, touch.field, nullptr))
      return false;
    tree_->set_reach(mesh.node_reach);
    tree_->keep_seen(memory);
  }
  const SurfaceTree* const tree = tree_;
  normal_ = memory.array<Vec3>(static_cast<std::size_t>(tree->surface_nodes()));
  area_ = memory.array<double>(static_cast<std::size_t>(tree->surface_nodes()));
  now_ = memory.array<Vec3>(static_cast<std::size_t>(tree->surface_nodes()));
  seen_ = memory.array<std::uint64_t>(static_cast<std::size_t>(tree->surface_nodes()));
  if (memory.failed()) return false;
  measure();
  return true;
}

void OrganSurface::measure() {
  version_ = touched_->versions;
  std::fill(normal_, normal_ + tree_->surface_nodes(), Vec3{});
  std::fill(area_, area_ + tree_->surface_nodes(), 0.0);
  for (std::int32_t t = 0; t < tree_->triangle_count(); ++t) {
    if (!tree_->is_active(t)) continue;
    const std::int32_t* const corner = tree_->corners(t);
    const Vec3 a = tree_->at_rest(corner[0]);
    const Vec3 twice = cross(tree_->at_rest(corner[1]) - a, tree_->at_rest(corner[2]) - a);
    for (int v = 0; v < 3; ++v) normal_[corner[v]] += twice, area_[corner[v]] += length(twice) / 6;
  }
  for (std::int32_t n = 0; n < tree_->surface_nodes(); ++n) normal_[n] = unit_or_zero(normal_[n]);
}

void OrganSurface::begin_step() {
  ++step_;
  if (version_ != touched_->versions) measure();
}

void OrganSurface::forget() {
  if (tree_ == &own_tree_) own_tree_.forget();
}

bool OrganSurface::is_smooth(std::int32_t corner, Vec3 flat_at_rest) const {
  return dot(normal_[corner], flat_at_rest) > kSmooth;
}

double OrganSurface::bulge(const SurfacePoint& place) const {
  const Vec3 flat = tree_->outward_at_rest(place.triangle), at = tree_->at_rest(place);
  const std::int32_t* const corner = tree_->corners(place.triangle);
  double bulge = 0;
  for (int v = 0; v < 3; ++v)
    bulge += 0.5 * place.barycentric[v] *
             dot(is_smooth(corner[v], flat) ? normal_[corner[v]] : flat, tree_->at_rest(corner[v]) - at);
  return bulge;
}

Vec3 OrganSurface::normal(const SurfacePoint& place, Vec3 flat) {
  const Vec3 flat_at_rest = tree_->outward_at_rest(place.triangle);
  const std::int32_t* const corner = tree_->corners(place.triangle);
  Vec3 sum;
  for (int v = 0; v < 3; ++v) {
    const std::int32_t n = corner[v];
    Vec3 of_corner = flat;
    if (is_smooth(n, flat_at_rest)) {
      if (seen_[n] != step_) seen_[n] = step_, now_[n] = deformed_->normal(n);
      // Where the surface is folded, a normal between both sides of the fold says little.
      if (dot(now_[n], flat) > kFolded) of_corner = now_[n];
    }
    sum += place.barycentric[v] * of_corner;
  }
  const Vec3 normal = unit_or_zero(sum);
  return length(normal) == 0 ? flat : normal;
}

}  // namespace palpate
