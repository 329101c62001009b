#include "programs/player/organ_links.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "formats/errors.h"
#include "programs/player/tool_places.h"

namespace palpate {

OrganLinks::OrganLinks(const SceneConfig& scene, const std::vector<std::unique_ptr<PlayedOrgan>>& organs,
                       const std::vector<palpate_pose>& poses)
    : scene_(scene) {
  for (std::size_t l = 0; l < scene.links.size(); ++l)
    if (!scene.links[l].organs.empty()) find(scene.links[l], l, organs, poses);
}

void OrganLinks::find(const SceneConfig::Link& link, std::size_t index,
                      const std::vector<std::unique_ptr<PlayedOrgan>>& organs, const std::vector<palpate_pose>& poses) {
  const std::string who = fmt::format("{}:{}: link \"{}\": places", scene_.file.string(), link.line, link.name);
  std::vector<palpate_link_end> ends;
  std::vector<std::int32_t> organ;  // of each end; -1: it stands in the world
  std::vector<SceneConfig::Vector> points;
  for (std::size_t p = 0; p < link.places.size(); ++p) {
    const std::size_t k = link.organs[p];
    const SurfacePlace found =
        PlaceFinder(organs[k]->bundle(), PlaceFinder::Where::surface).nearest(link.places[p], who);
    ends.push_back(end_at(found)), organ.push_back(static_cast<std::int32_t>(k));
    palpate_point_to_world(poses[k].position, poses[k].orientation, found.point.data(), points.emplace_back().data());
  }
  if (link.world) ends.push_back(end_in_world(*link.world)), organ.push_back(-1), points.push_back(*link.world);
  const auto name_at = [&](std::size_t end) {
    return organ[end] < 0 ? "world" : scene_.organs[static_cast<std::size_t>(organ[end])].name;
  };
  for (const LinkStretch& stretch : stretches_through(index, points)) {
    const auto i = static_cast<std::size_t>(stretch.part);
    palpate_world_link& made = links_.emplace_back(palpate_default_world_link());
    for (std::size_t e = 0; e < 2; ++e) made.ends[e] = ends[i + e], made.organ[e] = organ[i + e];
    take_link(link, stretch, i + 2 < ends.size(), &made);
    stretches_.push_back({stretch, name_at(i) + "+" + name_at(i + 1)});
  }
}

void OrganLinks::hold(palpate_world* world, double time) {
  const bool changed = take_numbers(scene_.links, stretches_, time, &links_);
  if ((are_given_ && !changed) || links_.empty()) return;
  palpate_error error = {};
  if (palpate_world_set_links(world, links_.data(), static_cast<std::int32_t>(links_.size()), &error) != PALPATE_OK)
    throw InputError(fmt::format("{}: {}", scene_.file.string(), error.text));
  are_given_ = true;
}

OrganLinkSummary::OrganLinkSummary(const SceneConfig& scene, const OrganLinks& links, const palpate_world* world)
    : scene_(scene), links_(links), world_(world), peaks_(links.links().size()) {}

void OrganLinkSummary::add(double time) {
  for (std::size_t s = 0; s < peaks_.size(); ++s)
    peaks_[s].add(palpate_world_link_state(world_, static_cast<std::int32_t>(s)), time);
}

nlohmann::ordered_json OrganLinkSummary::json() const {
  auto list = nlohmann::ordered_json::array();
  for (std::size_t s = 0; s < peaks_.size(); ++s) {
    const OrganLinks::Stretch& stretch = links_.stretches()[s];
    nlohmann::ordered_json& entry = list.emplace_back();
    entry["name"] = scene_.links[stretch.link].name, entry["organs"] = stretch.organs;
    entry["stretch"] = stretch.part + 1;
    peaks_[s].put(&entry);
  }
  return list;
}

std::vector<std::string> OrganLinkSummary::lines() const {
  std::vector<std::string> lines;
  for (std::size_t s = 0; s < peaks_.size(); ++s) {
    if (peaks_[s].tension == 0) continue;
    const OrganLinks::Stretch& stretch = links_.stretches()[s];
    lines.push_back(fmt::format("link \"{}\" of {}: {}", name_of(scene_.links[stretch.link], stretch), stretch.organs,
                                peaks_[s].sentence()));
  }
  return lines;
}

}  // namespace palpate
