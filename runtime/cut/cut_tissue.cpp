#include "runtime/cut/cut_tissue.h"

#include <algorithm>

namespace palpate {

bool CutTissue::create(SceneMemory& memory, const HyperelasticBody& body, std::int32_t most_new) {
  body_ = &body, most_new_ = most_new;
  const auto nodes = static_cast<std::size_t>(body.node_count),
             tetrahedra = static_cast<std::size_t>(body.tetrahedron_count), corners = 4 * tetrahedra;
  corners_ = memory.array<std::int32_t>(corners), removed_ = memory.array<std::uint8_t>(tetrahedra);
  first_ = memory.array<std::int32_t>(nodes + 1), around_ = memory.array<std::int32_t>(corners);
  parent_ = memory.array<std::int32_t>(static_cast<std::size_t>(most_new));
  origin_ = memory.array<std::int32_t>(static_cast<std::size_t>(most_new));
  base_ = memory.array<std::int32_t>(static_cast<std::size_t>(most_new));
  loads_ = memory.array<LoadShare>(nodes + static_cast<std::size_t>(most_new));
  if (memory.failed()) return false;
  forget();
  for (std::size_t c = 0; c < corners; ++c) ++first_[corners_[c] + 1];
  for (std::size_t n = 0; n < nodes; ++n) {
    largest_star_ = std::max(largest_star_, 1 + 3 * first_[n + 1]);
    first_[n + 1] += first_[n];
  }
  for (std::size_t c = corners; c-- > 0;) around_[--first_[corners_[c] + 1]] = static_cast<std::int32_t>(c / 4);
  // Each list was filled from its end, so that first_[n + 1] now is where list n begins.
  for (std::size_t n = 0; n < nodes; ++n) first_[n] = first_[n + 1];
  first_[nodes] = static_cast<std::int32_t>(corners);
  return true;
}

void CutTissue::forget() {
  const std::size_t tetrahedra = static_cast<std::size_t>(body_->tetrahedron_count);
  std::copy_n(body_->tetrahedra, 4 * tetrahedra, corners_);
  std::fill_n(removed_, tetrahedra, std::uint8_t{0});
  std::fill_n(loads_, most_nodes(), LoadShare{});
  new_count_ = 0, base_nodes_ = body_->node_count;
}

void CutTissue::begin_from(const CutTissue& now) {
  const std::size_t tetrahedra = static_cast<std::size_t>(body_->tetrahedron_count);
  std::copy_n(now.corners_, 4 * tetrahedra, corners_);
  std::copy_n(now.removed_, tetrahedra, removed_);
  std::copy_n(now.loads_, most_nodes(), loads_);
  std::copy_n(now.parent_, now.new_count_, parent_), std::copy_n(now.origin_, now.new_count_, origin_);
  new_count_ = now.new_count_, base_nodes_ = now.nodes();
}

void CutTissue::add_node(std::int32_t from, LoadShare share) {
  LoadShare &goes = loads_[nodes()], &stays = loads_[from];
  goes = {share.in_volume * stays.in_volume, share.on_surface * stays.on_surface};
  stays.in_volume -= goes.in_volume, stays.on_surface -= goes.on_surface;
  parent_[new_count_] = from, origin_[new_count_] = origin(from), base_[new_count_] = base(from);
  ++new_count_;
}

void CutTissue::lose_loads(std::int32_t node, LoadShare share) {
  loads_[node].in_volume *= 1 - share.in_volume, loads_[node].on_surface *= 1 - share.on_surface;
}

void CutTissue::move_corner(std::int32_t e, std::int32_t from, std::int32_t to) {
  std::int32_t* const corner = corners_ + 4 * static_cast<std::int64_t>(e);
  std::replace(corner, corner + 4, from, to);
}

double CutTissue::own_stiffness(std::int32_t of_region, int mode) const {
  const TissueLaw& law = body_->laws[of_region];
  if (mode > 0) return 2 * (1 - body_->averaged_shear) * law.shear;
  return body_->nodal_dilatation ? 0 : law.bulk;
}

double CutTissue::site_stiffness(std::int32_t of_region, int mode) const {
  const TissueLaw& law = body_->laws[of_region];
  return mode > 0 ? 2 * body_->averaged_shear * law.shear : law.bulk;
}

double CutTissue::gradients(std::int32_t e, Vec3 g[4]) const {
  double inner[3][3];
  const double volume = shape_gradients(*body_, e, inner);
  g[0] = {};
  for (int a = 0; a < 3; ++a) {
    g[a + 1] = load3(inner[a]);
    g[0] = g[0] - g[a + 1];
  }
  return volume;
}

int CutTissue::corner_of(std::int32_t e, std::int32_t node) const {
  for (int a = 0; a < 4; ++a)
    if (corners(e)[a] == node) return a;
  return -1;
}

std::int32_t CutTissue::tetrahedra_at(std::int32_t node) const {
  std::int32_t count = 0;
  for_each_at(node, [&](std::int32_t, int) { ++count; });
  return count;
}

void CutTissue::add_quarter(std::int32_t e, NodeGradients& site) const {
  Vec3 g[4];
  const double quarter = gradients(e, g) / 4;
  site.volume += quarter;
  for (int a = 0; a < 4; ++a) site.add(corners(e)[a], quarter * g[a]);
}

}  // namespace palpate
