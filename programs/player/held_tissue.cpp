#include "programs/player/held_tissue.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/errors.h"
#include "formats/scene_holds.h"
#include "programs/player/tool_places.h"

namespace palpate {
namespace {

using Vector = SceneConfig::Vector;

// As palpate.h states them.
constexpr int kNodesOfDisc = 96, kNodesOfEnd = 3, kNodesOfWideEnd = 8;

bool is_in(const std::vector<std::array<double, 2>>& rows, double time, int* row) {
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i][0] <= time && time < rows[i][1]) {
      *row = static_cast<int>(i);
      return true;
    }
  return false;
}

}  // namespace

HeldTissue::HeldTissue(const SceneConfig& scene, const palpate_bundle* bundle)
    : file_(scene.file.string()), from_links_(scene.links) {
  for (const auto& tool : scene.tools) tools_.push_back(tool.name), from_grasps_.push_back(tool.grasp);
  grasps_.resize(scene.tools.size());
  closed_.assign(scene.tools.size(), 1);
  apart_.resize(scene.tools.size());
  if (!from_links_.empty()) find_links(bundle);
  if (std::any_of(from_grasps_.begin(), from_grasps_.end(), [](const auto& grasp) { return grasp.has_value(); }))
    find_grasps(bundle);
}

void HeldTissue::find_links(const palpate_bundle* bundle) {
  const PlaceFinder finder(bundle, PlaceFinder::Where::surface);
  for (std::size_t l = 0; l < from_links_.size(); ++l) {
    const SceneConfig::Link& link = from_links_[l];
    const std::string who = fmt::format("{}:{}: link \"{}\": places", file_, link.line, link.name);
    std::vector<palpate_link_end> ends;
    std::vector<Vector> points;
    for (const Vector& place : link.places) {
      const SurfacePlace found = finder.nearest(place, who);
      ends.push_back(end_at(found)), points.push_back(found.point);
    }
    if (link.world) ends.push_back(end_in_world(*link.world)), points.push_back(*link.world);
    for (const LinkStretch& stretch : stretches_through(l, points)) {
      const auto i = static_cast<std::size_t>(stretch.part);
      palpate_link& made = links_.emplace_back(palpate_default_link());
      made.ends[0] = ends[i], made.ends[1] = ends[i + 1];
      take_link(link, stretch, i + 2 < ends.size(), &made);
      stretches_.push_back(stretch);
    }
  }
}

void HeldTissue::find_grasps(const palpate_bundle* bundle) {
  const PlaceFinder finder(bundle, PlaceFinder::Where::touchable);
  for (std::size_t t = 0; t < from_grasps_.size(); ++t) {
    if (!from_grasps_[t]) continue;
    const SceneConfig::Grasp& from = *from_grasps_[t];
    const std::string who = fmt::format("{}:{}: tool \"{}\": grasp", file_, from.line, tools_[t]);
    palpate_grasp& grasp = grasps_[t] = palpate_default_grasp();
    const SurfacePlace near = finder.nearest(from.near, who + ".near");
    grasp.triangle = near.triangle, grasp.radius = from.radius;
    std::copy(near.barycentric.begin(), near.barycentric.end(), grasp.barycentric);
    if (from.opposite) {
      const SurfacePlace opposite = finder.nearest(*from.opposite, who + ".opposite");
      grasp.opposite_triangle = opposite.triangle;
      apart_[t] = std::hypot(near.point[0] - opposite.point[0], near.point[1] - opposite.point[1],
                             near.point[2] - opposite.point[2]);
      std::copy(opposite.barycentric.begin(), opposite.barycentric.end(), grasp.opposite_barycentric);
    }
    if (from.friction) grasp.friction = *from.friction;
    if (from.clamp_force) grasp.clamp_force = *from.clamp_force;
  }
}

std::string HeldTissue::name_of(std::size_t stretch) const {
  return palpate::name_of(from_links_[stretches_[stretch].link], stretches_[stretch]);
}

bool HeldTissue::has_grasps() const {
  return std::any_of(grasps_.begin(), grasps_.end(), [](const palpate_grasp& grasp) { return grasp.radius > 0; });
}

int HeldTissue::most_nodes() const {
  int nodes = 0;
  for (const palpate_link& link : links_)
    for (const palpate_link_end& end : link.ends)
      if (end.kind == PALPATE_END_SURFACE_POINT) nodes += link.radius > 0 ? kNodesOfWideEnd : kNodesOfEnd;
  for (const palpate_grasp& grasp : grasps_)
    if (grasp.radius > 0) nodes += kNodesOfDisc * (grasp.opposite_triangle >= 0 ? 2 : 1);
  return nodes;
}

void HeldTissue::hold_links(palpate_scene* scene, double time) {
  const bool changed = take_numbers(from_links_, stretches_, time, &links_);
  if ((links_are_given_ && !changed) || links_.empty()) return;
  palpate_error error = {};
  if (palpate_scene_set_links(scene, links_.data(), static_cast<std::int32_t>(links_.size()), &error) != PALPATE_OK)
    throw InputError(fmt::format("{}: {}", file_, error.text));
  links_are_given_ = true;
}

void HeldTissue::close_grasps(double time) {
  for (std::size_t t = 0; t < grasps_.size(); ++t) {
    if (!grasp(t)) continue;
    const SceneConfig::Grasp& from = *from_grasps_[t];
    int row = 0;
    closed_[t] = from.closed.empty() || is_in(from.closed, time, &row);
    grasps_[t].id = row;
    if (!from.closing.empty()) grasps_[t].closing = value_at(from.closing, time);
  }
}

palpate_grasp* HeldTissue::place_grasp(std::size_t tool, const Vector& position, const Rotation& turn) {
  if (!grasp(tool) || !closed_[tool]) return nullptr;
  palpate_grasp& grasp = grasps_[tool];
  std::copy(position.begin(), position.end(), grasp.position);
  const std::array<double, 4> orientation = quaternion_of(turn);
  std::copy(orientation.begin(), orientation.end(), grasp.orientation);
  return &grasp;
}

}  // namespace palpate
