#include "programs/player/played_tools.h"

#include <algorithm>

#include "programs/player/tool_points.h"

namespace palpate {
namespace {

using Vector = SceneConfig::Vector;

// points and grips are borrowed.
palpate_tool tool_of(const SceneConfig::Tool& from, const std::vector<SceneConfig::Vector>& points,
                     const std::vector<palpate_grip>& grips) {
  palpate_tool tool = palpate_default_tool();
  tool.points = points.empty() ? nullptr : points[0].data();
  tool.point_count = static_cast<std::int32_t>(points.size());
  tool.grips = grips.data();
  tool.grip_count = static_cast<std::int32_t>(grips.size());
  tool.disc_radius = from.disc_radius, tool.friction = from.friction, tool.hold = from.hold ? 1 : 0;
  tool.has_torque = from.grasp || from.needle ? 1 : 0;
  return tool;
}

}  // namespace

PlayedTools::PlayedTools(const SceneConfig& scene, std::vector<PlayedOrgan*> organs, std::vector<palpate_pose> poses)
    : scene_(scene), organs_(std::move(organs)), poses_(std::move(poses)) {
  for (const auto& tool : scene.tools) local_points_.push_back(tool_points(tool));
  points_ = local_points_;
  positions_.resize(scene.tools.size());
  for (const auto& tool : scene.tools) {
    palpate_given_force& given = forces_.emplace_back(palpate_default_given_force());
    if (tool.given_force && tool.given_force->speed) given.speed = *tool.given_force->speed;
  }
  for (std::size_t t = 0; t < scene.tools.size(); ++t)
    tools_.push_back(tool_of(scene.tools[t], points_[t], organs_[scene.tools[t].organ]->grips()[t]));
}

void PlayedTools::move(double time) {
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    if (const auto& given = scene_.tools[t].given_force) {
      const Vector force = position_at(given->forces, time);
      std::copy(force.begin(), force.end(), forces_[t].force);
    }
    place(t, position_at(scene_.tools[t].path, time), turn_at(scene_.tools[t].turn, time));
    if (is_away(scene_.tools[t], time)) withdraw(t);
  }
}

void PlayedTools::place(std::size_t tool, const Vector& position, const Rotation& turn) {
  PlayedOrgan& organ = *organs_[scene_.tools[tool].organ];
  positions_[tool] = position;
  for (std::size_t p = 0; p < points_[tool].size(); ++p) {
    const Vector& local = local_points_[tool][p];
    for (int d = 0; d < 3; ++d)
      points_[tool][p][d] = position[d] + (turn[d][0] * local[0] + turn[d][1] * local[1] + turn[d][2] * local[2]);
  }
  const palpate_pose* pose = poses_.empty() ? nullptr : &poses_[scene_.tools[tool].organ];
  const Vector& start = scene_.tools[tool].path.front().position;
  for (palpate_grip& grip : organ.grips()[tool]) {
    for (int d = 0; d < 3; ++d) grip.displacement[d] = position[d] - start[d];
    if (pose) palpate_vector_to_organ(pose->orientation, grip.displacement, grip.displacement);
  }
  tools_[tool].point_count = static_cast<std::int32_t>(points_[tool].size());
  tools_[tool].grip_count = static_cast<std::int32_t>(organ.grips()[tool].size());
  tools_[tool].organ = static_cast<std::int32_t>(scene_.tools[tool].organ);
  tools_[tool].parts = nullptr;
  if (organ.has_needles())
    if (palpate_needle* const needle = organ.needles().place(tool, position, turn, pose))
      palpate_add_part(&tools_[tool].parts, &needle->part);
  if (organ.holds_tissue())
    if (palpate_grasp* const grasp = organ.held().place_grasp(tool, position, turn))
      palpate_add_part(&tools_[tool].parts, &grasp->part);
  if (scene_.tools[tool].given_force && organ.presses_with_forces())
    palpate_add_part(&tools_[tool].parts, &forces_[tool].part);
  if (!tools_[tool].has_torque) return;
  std::copy(position.begin(), position.end(), tools_[tool].reference);
}

void PlayedTools::follow() {
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    if (!scene_.tools[t].given_force || !tools_[t].parts) continue;
    const palpate_given_force_state* const state =
        palpate_scene_given_force_state(organs_[scene_.tools[t].organ]->runtime_scene(), static_cast<std::int32_t>(t));
    for (int d = 0; state && d < 3; ++d) {
      positions_[t][d] += state->displacement[d];
      for (Vector& point : points_[t]) point[d] += state->displacement[d];
    }
  }
}

void PlayedTools::withdraw(std::size_t tool) {
  tools_[tool].point_count = tools_[tool].grip_count = 0;
  tools_[tool].parts = nullptr;
}

}  // namespace palpate
