#include "programs/player/played_needles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

using Vector = SceneConfig::Vector;

constexpr int kNodesOfPlace = 4;        // as palpate.h states them
constexpr double kDrawnOutside = 0.05;  // m

double distance(const Vector& a, const Vector& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

}  // namespace

PlayedNeedles::PlayedNeedles(const SceneConfig& scene, const palpate_bundle* bundle)
    : places_(scene.def.needles.needle_places),
      needles_(scene.tools.size()),
      near_(scene.tools.size()),
      directions_(scene.tools.size()),
      drawn_(scene.tools.size()) {
  const auto has_needle = [](const SceneConfig::Tool& tool) { return tool.needle.has_value(); };
  if (std::none_of(scene.tools.begin(), scene.tools.end(), has_needle)) return;
  const PlaceFinder finder(bundle, PlaceFinder::Where::touchable);
  for (std::size_t t = 0; t < scene.tools.size(); ++t)
    if (scene.tools[t].needle) find(scene.tools[t], finder, bundle, scene.file, t);
}

void PlayedNeedles::find(const SceneConfig::Tool& tool, const PlaceFinder& finder, const palpate_bundle* bundle,
                         const std::filesystem::path& file, std::size_t index) {
  const SceneConfig::Needle& from = *tool.needle;
  near_[index] = from.entry ? *from.entry : tool.place->near ? *tool.place->near : find_place(tool, bundle, file).point;
  const SurfacePlace entry = finder.nearest(
      near_[index], fmt::format("{}:{}: tool \"{}\": needle.entry", file.string(), from.line, tool.name));
  palpate_needle& needle = needles_[index] = palpate_default_needle();
  needle.triangle = entry.triangle, needle.radius = from.radius;
  std::copy(entry.barycentric.begin(), entry.barycentric.end(), needle.barycentric);
  needle.friction = from.friction, needle.spacing = from.spacing;
  needle.puncture_force = from.puncture_force, needle.cutting_force = from.cutting_force;
  directions_[index] = direction_at(tool, entry);
  for (const SceneConfig::KeyFrame& frame : tool.path)
    drawn_[index] = std::max(drawn_[index], distance(frame.position, tool.path.front().position) + kDrawnOutside);
}

bool PlayedNeedles::any() const {
  return std::any_of(needles_.begin(), needles_.end(), [](const palpate_needle& needle) { return needle.radius > 0; });
}

int PlayedNeedles::most_nodes() const {
  int nodes = 0;
  for (const palpate_needle& needle : needles_)
    if (needle.radius > 0) nodes += kNodesOfPlace * (places_ + 2);
  return nodes;
}

palpate_needle* PlayedNeedles::place(std::size_t tool, const Vector& position, const Rotation& turn,
                                     const palpate_pose* pose) {
  if (!of(tool)) return nullptr;
  palpate_needle& needle = needles_[tool];
  Vector direction = directions_[tool];
  if (pose) palpate_vector_to_world(pose->orientation, direction.data(), direction.data());
  direction = turned(turn, direction);
  std::copy(position.begin(), position.end(), needle.tip);
  std::copy(direction.begin(), direction.end(), needle.direction);
  return &needle;
}

}  // namespace palpate
