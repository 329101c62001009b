#include "programs/player/step_loads.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace palpate {
namespace {

constexpr int kRowsOfDisc = 9;   // of a grasp: three constraints of three rows
constexpr int kRowsOfPlace = 3;  // of a needle; its tip has as many
constexpr double kAtLimit = 1 - 1e-6;

int rows_of_tool(const PlayedOrgan& organ, std::size_t tool, const palpate_contacts& contacts) {
  const palpate_contact_law law = organ.scene().def.law;
  const int rows_of_place = law == PALPATE_LAW_SLIDING || law == PALPATE_LAW_UNILATERAL ? 1 : 3;
  const int grips = static_cast<int>(organ.grips()[tool].size());
  int rows = 0;
  for (const palpate_grip& grip : organ.grips()[tool]) rows += std::popcount(grip.axes);
  const int places =
      std::max(0, palpate_contacts_tool(&contacts, static_cast<std::int32_t>(tool))->contact_count - grips);
  const palpate_grasp_state* grasp = palpate_scene_grasp_state(organ.runtime_scene(), static_cast<std::int32_t>(tool));
  const bool grasps = grasp && (grasp->condition == PALPATE_GRASP_HOLDS || grasp->condition == PALPATE_GRASP_SLIPS);
  const int discs = std::min(places, !grasps ? 0 : organ.held().grasp(tool)->opposite_triangle >= 0 ? 2 : 1);
  return rows + rows_of_place * (places - discs) + kRowsOfDisc * discs;
}

int rows_of_needle(const PlayedOrgan& organ, std::size_t tool) {
  const palpate_needle_state* needle =
      palpate_scene_needle_state(organ.runtime_scene(), static_cast<std::int32_t>(tool));
  if (!needle || needle->condition <= PALPATE_NEEDLE_OUTSIDE) return 0;
  if (needle->condition == PALPATE_NEEDLE_PRESSES) return 1;
  return kRowsOfPlace * (needle->places + 1);
}

int rows_of_links(const PlayedOrgan& organ) {
  int rows = 0;
  for (std::size_t s = 0; s < organ.held().links().size(); ++s) {
    const palpate_link_state* link = palpate_scene_link_state(organ.runtime_scene(), static_cast<std::int32_t>(s));
    if (!link || link->condition != PALPATE_LINK_TAUT) continue;
    rows += organ.held().links()[s].kind == PALPATE_LINK_CLIP ? 3 : 1;
  }
  return rows;
}

int rows_of_obstacles(const PlayedOrgan& organ) {
  int rows = 0;
  for (std::size_t i = 0; i < organ.obstacles().count(); ++i)
    if (const palpate_obstacle_state* state = OrganObstacles::state(organ.runtime_scene(), i))
      rows += state->nodes * (organ.obstacles().of(i).friction > 0 ? 3 : 1);
  return rows;
}

// Adds a pair that presses: its rows, and whether it slips.
void add_pressing(const palpate_world_pair& pair, double friction, palpate_step_load* load) {
  double across = 0, normal = 0;
  for (int d = 0; d < 3; ++d) normal += pair.force[d] * pair.normal[d];
  for (int d = 0; d < 3; ++d) across += std::pow(pair.force[d] - normal * pair.normal[d], 2);
  if (!(normal > 0)) return;
  load->rows += friction > 0 ? 3 : 1;
  load->slips += friction > 0 && std::sqrt(across) >= kAtLimit * friction * normal;
}

int nodes_with_force(const palpate_contacts& contacts) {
  int count = 0;
  for (std::int32_t e = 0; e < contacts.node_count; ++e) {
    const double* const force = palpate_contacts_node(&contacts, e)->force;
    count += force[0] != 0 || force[1] != 0 || force[2] != 0;
  }
  return count;
}

}  // namespace

palpate_step_load load_of(const PlayedOrgan& organ, const ToolPoints& points, const palpate_contacts& contacts) {
  palpate_step_load load = palpate_default_step_load();
  load.tools = contacts.tool_count;
  for (std::size_t t = 0; t < points.size(); ++t) {
    load.points += static_cast<std::int32_t>(points[t].size());
    load.grips += static_cast<std::int32_t>(organ.grips()[t].size());
    load.rows += rows_of_tool(organ, t, contacts) + rows_of_needle(organ, t);
  }
  load.rows += rows_of_links(organ) + rows_of_obstacles(organ);
  for (std::int32_t t = 0; t < contacts.tool_count; ++t) {
    const palpate_tool_state& tool = *palpate_contacts_tool(&contacts, t);
    load.contacts += tool.contact_count, load.slips += tool.slip_count;
  }
  load.nodes = contacts.node_count, load.sweeps = contacts.sweeps;
  load.newton_steps = contacts.newton_steps;
  return load;
}

std::vector<palpate_step_load> loads_of(const WorldPlayer& player, const palpate_world_contacts& contacts) {
  std::vector<palpate_step_load> loads;
  std::vector<char> is_joint(player.organ_count());
  palpate_step_load world = palpate_default_step_load();
  const double friction = player.scene().organ_friction;
  for (std::int32_t i = 0; i < contacts.pair_count; ++i) {
    const palpate_world_pair& pair = *palpate_world_contacts_pair(&contacts, i);
    is_joint[static_cast<std::size_t>(pair.organ[0])] = is_joint[static_cast<std::size_t>(pair.organ[1])] = true;
    add_pressing(pair, friction, &world);
  }
  int rows_between_organs = 0;
  for (std::size_t s = 0; s < player.links().links().size(); ++s) {
    const palpate_world_link& link = player.links().links()[s];
    const palpate_link_state* state = palpate_world_link_state(player.runtime_world(), static_cast<std::int32_t>(s));
    if (!state || state->condition != PALPATE_LINK_TAUT) continue;
    rows_between_organs += link.kind == PALPATE_LINK_CLIP ? 3 : 1;
    for (const std::int32_t organ : link.organ)
      if (organ >= 0) is_joint[static_cast<std::size_t>(organ)] = true;
  }
  world.contacts = contacts.pair_count, world.rows += rows_between_organs;
  world.tools = contacts.tool_count;
  for (const auto& points : player.points()) world.points += static_cast<std::int32_t>(points.size());
  for (std::size_t k = 0; k < player.organ_count(); ++k) {
    const auto organ = static_cast<std::int32_t>(k);
    const palpate_contacts& of_organ = *palpate_world_contacts_organ(&contacts, organ);
    palpate_step_load load = load_of(player.organ(k), player.points(), of_organ);
    // Points of far tools are not looked at.
    const int near = palpate_world_contacts_state(&contacts, organ)->near_tools;
    load.points = load.points * near / std::max(1, load.tools);
    world.grips += load.grips, world.nodes += nodes_with_force(of_organ);
    if (is_joint[k]) {
      world.rows += load.rows;
      world.sweeps = std::max(world.sweeps, load.sweeps);
      world.newton_steps = std::max(world.newton_steps, load.newton_steps);
      load.rows = load.sweeps = load.newton_steps = 0;
    }
    loads.push_back(load);
  }
  loads.push_back(world);
  return loads;
}

}  // namespace palpate
