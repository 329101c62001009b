#include "programs/player/held_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace palpate {
namespace {

double length(const double (&v)[3]) {
  return std::hypot(v[0], v[1], v[2]);
}

nlohmann::ordered_json or_null(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

}  // namespace

HeldSummary::HeldSummary(const PlayedOrgan& organ)
    : organ_(organ), links_(organ.held().links().size()), grasps_(organ.scene().tools.size()) {}

void HeldSummary::add(double time) {
  for (std::size_t s = 0; s < links_.size(); ++s)
    links_[s].add(palpate_scene_link_state(organ_.runtime_scene(), static_cast<std::int32_t>(s)), time);
  for (std::size_t t = 0; t < grasps_.size(); ++t) {
    const palpate_grasp_state* state =
        organ_.held().grasp(t) ? palpate_scene_grasp_state(organ_.runtime_scene(), static_cast<std::int32_t>(t))
                               : nullptr;
    if (!state) continue;
    Grasp& grasp = grasps_[t];
    grasp.peak_force = std::max(grasp.peak_force, length(state->force));
    if (const double torque = length(state->torque); torque > grasp.peak_torque)
      grasp.peak_torque = torque, grasp.peak_torque_time = time;
    grasp.slipped = std::max(grasp.slipped, state->slipped);
    if (state->condition == PALPATE_GRASP_LET_GO && !grasp.let_go) grasp.let_go = time;
  }
}

nlohmann::ordered_json HeldSummary::links() const {
  auto list = nlohmann::ordered_json::array();
  for (std::size_t s = 0; s < links_.size(); ++s) {
    const LinkStretch& stretch = organ_.held().stretches()[s];
    nlohmann::ordered_json& entry = list.emplace_back();
    entry["name"] = organ_.scene().links[stretch.link].name, entry["stretch"] = stretch.part + 1;
    links_[s].put(&entry);
  }
  return list;
}

nlohmann::ordered_json HeldSummary::grasp(std::size_t tool) const {
  const palpate_grasp* of = organ_.held().grasp(tool);
  if (!of) return nullptr;
  const Grasp& grasp = grasps_[tool];
  return {{"radius_m", of->radius},           {"discs", of->opposite_triangle >= 0 ? 2 : 1},
          {"peak_force_N", grasp.peak_force}, {"peak_torque_Nm", grasp.peak_torque},
          {"slipped_m", grasp.slipped},       {"let_go_s", or_null(grasp.let_go)}};
}

std::vector<std::string> HeldSummary::lines() const {
  std::vector<std::string> lines;
  for (std::size_t s = 0; s < links_.size(); ++s) {
    if (links_[s].tension == 0) continue;
    lines.push_back(fmt::format("link \"{}\": {}", organ_.held().name_of(s), links_[s].sentence()));
  }
  for (std::size_t t = 0; t < grasps_.size(); ++t) {
    const Grasp& grasp = grasps_[t];
    if (!organ_.held().grasp(t)) continue;
    lines.push_back(fmt::format("grasp of tool \"{}\": largest torque {:.3g} N m, at {:.3g} s{}",
                                organ_.scene().tools[t].name, grasp.peak_torque, grasp.peak_torque_time,
                                grasp.let_go        ? fmt::format("; let go at {:.3g} s", *grasp.let_go)
                                : grasp.slipped > 0 ? fmt::format("; slipped by {:.3g} mm", 1e3 * grasp.slipped)
                                                    : std::string()));
  }
  return lines;
}

}  // namespace palpate
