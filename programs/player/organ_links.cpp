#include "programs/player/organ_links.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/errors.h"
#include "formats/scene_holds.h"
#include "programs/player/tool_places.h"

namespace palpate {
namespace {

using Vector = SceneConfig::Vector;

// One end of a stretch. organ -1: it stands in the world.
struct End {
  palpate_link_end end = {};
  std::int32_t organ = -1;
  Vector place = {};  // m, in the world
};

double distance(const Vector& a, const Vector& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

End end_at(const SurfacePlace& found, std::size_t organ, const palpate_pose& pose) {
  End end;
  end.end.kind = PALPATE_END_SURFACE_POINT, end.end.triangle = found.triangle;
  std::copy(found.barycentric.begin(), found.barycentric.end(), end.end.barycentric);
  end.organ = static_cast<std::int32_t>(organ);
  palpate_point_to_world(pose.position, pose.orientation, found.point.data(), end.place.data());
  return end;
}

}  // namespace

OrganLinks::OrganLinks(const SceneConfig& scene, const std::vector<std::unique_ptr<PlayedOrgan>>& organs,
                       const std::vector<palpate_pose>& poses)
    : scene_(scene) {
  for (std::size_t l = 0; l < scene.links.size(); ++l)
    if (!scene.links[l].organs.empty()) find(scene.links[l], l, organs, poses);
}

void OrganLinks::find(const SceneConfig::Link& link, std::size_t index,
                      const std::vector<std::unique_ptr<PlayedOrgan>>& organs, const std::vector<palpate_pose>& poses) {
  const std::string who = fmt::format("{}:{}: link \"{}\": places", scene_.file.string(), link.line, link.name);
  std::vector<End> ends;
  for (std::size_t p = 0; p < link.places.size(); ++p) {
    const std::size_t k = link.organs[p];
    const PlaceFinder finder(organs[k]->bundle(), PlaceFinder::Where::surface);
    ends.push_back(end_at(finder.nearest(link.places[p], who), k, poses[k]));
  }
  if (link.world) {
    End& end = ends.emplace_back();
    end.end.kind = PALPATE_END_WORLD, end.place = *link.world;
    std::copy(link.world->begin(), link.world->end(), end.end.point);
  }
  double length = 0;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) length += distance(ends[i].place, ends[i + 1].place);
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const double apart = distance(ends[i].place, ends[i + 1].place);
    const auto name = [&](const End& end) {
      return end.organ < 0 ? "world" : scene_.organs[static_cast<std::size_t>(end.organ)].name;
    };
    stretches_.push_back({index, static_cast<int>(i),
                          length > 0 ? apart / length : 1 / static_cast<double>(ends.size() - 1),
                          name(ends[i]) + "+" + name(ends[i + 1])});
    palpate_world_link& made = links_.emplace_back(palpate_default_world_link());
    made.kind = static_cast<palpate_link_kind>(static_cast<int>(link.kind) + 1);
    for (std::size_t e = 0; e < 2; ++e) made.ends[e] = ends[i + e].end, made.organ[e] = ends[i + e].organ;
    made.runs_on = i + 2 < ends.size();
    made.radius = link.radius;
    made.rest_length = link.kind == SceneConfig::Link::Kind::clip ? 0 : apart;
    if (link.breaking_force) made.breaking_force = *link.breaking_force;
  }
}

void OrganLinks::hold(palpate_world* world, double time) {
  bool same = are_given_;
  const auto set = [&](double& number, double to) {
    same = same && number == to;
    number = to;
  };
  for (std::size_t s = 0; s < links_.size(); ++s) {
    const SceneConfig::Link& link = scene_.links[stretches_[s].link];
    if (!link.rest_length.empty()) set(links_[s].rest_length, stretches_[s].share * value_at(link.rest_length, time));
    if (!link.stiffness.empty()) set(links_[s].stiffness, value_at(link.stiffness, time));
  }
  if (same || links_.empty()) return;
  palpate_error error = {};
  if (palpate_world_set_links(world, links_.data(), static_cast<std::int32_t>(links_.size()), &error) != PALPATE_OK)
    throw InputError(fmt::format("{}: {}", scene_.file.string(), error.text));
  are_given_ = true;
}

OrganLinkSummary::OrganLinkSummary(const SceneConfig& scene, const OrganLinks& links, const palpate_world* world)
    : scene_(scene), links_(links), world_(world), peaks_(links.links().size()) {}

void OrganLinkSummary::add(double time) {
  for (std::size_t s = 0; s < peaks_.size(); ++s) {
    const palpate_link_state* state = palpate_world_link_state(world_, static_cast<std::int32_t>(s));
    if (!state) continue;
    if (std::fabs(state->tension) > std::fabs(peaks_[s].tension))
      peaks_[s].tension = state->tension, peaks_[s].time = time;
    if (state->condition == PALPATE_LINK_BROKEN && !peaks_[s].broken) peaks_[s].broken = time;
  }
}

nlohmann::ordered_json OrganLinkSummary::json() const {
  auto list = nlohmann::ordered_json::array();
  for (std::size_t s = 0; s < peaks_.size(); ++s) {
    const OrganLinks::Stretch& stretch = links_.stretches()[s];
    nlohmann::ordered_json entry = {
        {"name", scene_.links[stretch.link].name}, {"organs", stretch.organs},      {"stretch", stretch.part + 1},
        {"peak_tension_N", peaks_[s].tension},     {"peak_time_s", peaks_[s].time}, {"broken_s", nullptr}};
    if (peaks_[s].broken) entry["broken_s"] = *peaks_[s].broken;
    list.push_back(entry);
  }
  return list;
}

std::vector<std::string> OrganLinkSummary::lines() const {
  std::vector<std::string> lines;
  for (std::size_t s = 0; s < peaks_.size(); ++s) {
    if (peaks_[s].tension == 0) continue;
    const OrganLinks::Stretch& stretch = links_.stretches()[s];
    const SceneConfig::Link& link = scene_.links[stretch.link];
    const std::string part = stretches_of(link) == 1 ? "" : fmt::format(" {}", stretch.part + 1);
    const std::string broke = peaks_[s].broken ? fmt::format("; broke at {:.3g} s", *peaks_[s].broken) : "";
    lines.push_back(fmt::format("link \"{}{}\" of {}: largest tension {:.3g} N, at {:.3g} s{}", link.name, part,
                                stretch.organs, peaks_[s].tension, peaks_[s].time, broke));
  }
  return lines;
}

}  // namespace palpate
