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

static_assert(static_cast<int>(SceneConfig::Link::Kind::thread) + 1 == PALPATE_LINK_THREAD);
static_assert(static_cast<int>(SceneConfig::Link::Kind::spring) + 1 == PALPATE_LINK_SPRING);
static_assert(static_cast<int>(SceneConfig::Link::Kind::clip) + 1 == PALPATE_LINK_CLIP);

// As palpate.h states them.
constexpr int kNodesOfDisc = 96, kNodesOfEnd = 3, kNodesOfWideEnd = 8;

double distance(const Vector& a, const Vector& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

palpate_link_end end_at(const SurfacePlace& place) {
  palpate_link_end end = {};
  end.kind = PALPATE_END_SURFACE_POINT, end.triangle = place.triangle;
  std::copy(place.barycentric.begin(), place.barycentric.end(), end.barycentric);
  return end;
}

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
    if (link.world) {
      palpate_link_end& end = ends.emplace_back();
      end.kind = PALPATE_END_WORLD;
      std::copy(link.world->begin(), link.world->end(), end.point);
      points.push_back(*link.world);
    }
    double length = 0;
    for (std::size_t i = 0; i + 1 < ends.size(); ++i) length += distance(points[i], points[i + 1]);
    for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
      const double apart = distance(points[i], points[i + 1]);
      stretches_.push_back(
          {l, static_cast<int>(i), length > 0 ? apart / length : 1 / static_cast<double>(ends.size() - 1), apart});
      palpate_link& made = links_.emplace_back(palpate_default_link());
      made.kind = static_cast<palpate_link_kind>(static_cast<int>(link.kind) + 1);
      made.ends[0] = ends[i], made.ends[1] = ends[i + 1];
      made.runs_on = i + 2 < ends.size();
      made.radius = link.radius;
      made.rest_length = link.kind == SceneConfig::Link::Kind::clip ? 0 : apart;
      if (link.breaking_force) made.breaking_force = *link.breaking_force;
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
      std::copy(opposite.barycentric.begin(), opposite.barycentric.end(), grasp.opposite_barycentric);
    }
    if (from.friction) grasp.friction = *from.friction;
    if (from.clamp_force) grasp.clamp_force = *from.clamp_force;
  }
}

std::string HeldTissue::name_of(std::size_t stretch) const {
  const Stretch& of = stretches_[stretch];
  const SceneConfig::Link& link = from_links_[of.link];
  return stretches_of(link) == 1 ? link.name : fmt::format("{} {}", link.name, of.part + 1);
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
  bool same = links_are_given_;
  const auto set = [&](double& number, double to) {
    same = same && number == to;
    number = to;
  };
  for (std::size_t s = 0; s < links_.size(); ++s) {
    const SceneConfig::Link& link = from_links_[stretches_[s].link];
    if (!link.rest_length.empty()) set(links_[s].rest_length, stretches_[s].share * value_at(link.rest_length, time));
    if (!link.stiffness.empty()) set(links_[s].stiffness, value_at(link.stiffness, time));
  }
  if (same || links_.empty()) return;
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

const palpate_grasp* HeldTissue::place_grasp(std::size_t tool, const Vector& position, const Rotation& turn) {
  if (!grasp(tool) || !closed_[tool]) return nullptr;
  palpate_grasp& grasp = grasps_[tool];
  std::copy(position.begin(), position.end(), grasp.position);
  const std::array<double, 4> orientation = quaternion_of(turn);
  std::copy(orientation.begin(), orientation.end(), grasp.orientation);
  return &grasp;
}

}  // namespace palpate
