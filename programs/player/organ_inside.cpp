#include "programs/player/organ_inside.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "formats/errors.h"

namespace palpate {

OrganInside::OrganInside(const SceneConfig& scene, palpate_scene* runtime_scene, int nodes)
    : runtime_scene_(runtime_scene) {
  const auto rows = static_cast<std::size_t>(nodes);
  strains_.resize(6 * rows), stresses_.resize(6 * rows), pressures_.resize(rows), von_mises_.resize(rows);
  principal_.resize(3 * rows);
  field_.capacity = nodes;
  field_.strains = strains_.data(), field_.stresses = stresses_.data(), field_.pressures = pressures_.data();
  field_.von_mises = von_mises_.data(), field_.principal = principal_.data();
  for (const SceneConfig::Carried& surface : scene.carried) add(surface);
  if (carried_.empty()) return;
  // Where the surfaces are at rest.
  std::vector<float> displacements(3 * rows), positions(displacements);
  palpate_shape_out rest = palpate_default_shape_out();
  rest.displacements = displacements.data(), rest.positions = positions.data(), rest.node_capacity = nodes;
  palpate_scene_shape(runtime_scene_, nullptr, &rest);
  follow(rest);
  for (Carried& surface : carried_) surface.rest = surface.positions;
}

void OrganInside::add(const SceneConfig::Carried& surface) {
  Carried carried;
  carried.name = surface.name;
  carried.mesh = read_render_mesh(surface.file, surface.metres_per_unit);
  const std::vector<double> points(carried.mesh.positions.begin(), carried.mesh.positions.end());
  carried.places.resize(points.size() / 3);
  carried.positions.resize(points.size());
  palpate_scene_locate(runtime_scene_, points.data(), static_cast<std::int32_t>(carried.places.size()),
                       std::numeric_limits<double>::infinity(), carried.places.data());
  std::size_t outside = 0, farthest = 0;
  for (std::size_t v = 0; v < carried.places.size(); ++v) {
    outside += carried.places[v].tetrahedron < 0 || carried.places[v].distance > surface.within;
    if (carried.places[v].distance > carried.places[farthest].distance) farthest = v;
  }
  if (outside > 0)
    throw InputError(
        fmt::format("{}: expected all vertices within {:g} mm of the organ's tetrahedra, found {} of {} farther, "
                    "vertex {} at {:g} {:g} "
                    "{:g} mm by {:g} mm; check the unit and the frame, or raise `within` of [[carried]] \"{}\"",
                    surface.file.string(), 1e3 * surface.within, outside, carried.places.size(), farthest,
                    1e3 * points[3 * farthest], 1e3 * points[3 * farthest + 1], 1e3 * points[3 * farthest + 2],
                    1e3 * carried.places[farthest].distance, surface.name));
  carried_.push_back(std::move(carried));
}

palpate_step_flags OrganInside::follow(const palpate_shape_out& shape) {
  palpate_step_flags flags = palpate_scene_inside(runtime_scene_, &shape, &field_);
  for (Carried& surface : carried_)
    flags |= palpate_scene_carry(runtime_scene_, &shape, surface.places.data(),
                                 static_cast<std::int32_t>(surface.places.size()), surface.positions.data());
  return flags;
}

}  // namespace palpate
