#include "programs/player/shown_obstacles.h"

#include <algorithm>

#include "programs/player/obstacle_surface.h"

namespace palpate {

palpate_obstacle_state ShownObstacle::state() const {
  palpate_obstacle_state sum = {};
  for (const auto& [organ, i] : organs) {
    const palpate_obstacle_state* of = OrganObstacles::state(organ->runtime_scene(), i);
    if (!of) continue;
    std::copy_n(of->position, 3, sum.position), std::copy_n(of->orientation, 4, sum.orientation);
    for (int d = 0; d < 3; ++d) sum.force[d] += of->force[d], sum.torque[d] += of->torque[d];
    sum.deepest = std::max(sum.deepest, of->deepest);
    sum.nodes += of->nodes, sum.slips += of->slips;
  }
  return sum;
}

std::vector<ShownObstacle> shown_obstacles(const std::vector<const PlayedOrgan*>& organs) {
  std::vector<std::pair<int, ShownObstacle>> found;  // with the line of its table
  for (const PlayedOrgan* organ : organs)
    for (std::size_t i = 0; i < organ->obstacles().count(); ++i) {
      const SceneConfig::Obstacle& of = organ->obstacles().of(i);
      auto same = std::ranges::find(found, of.name, [](const auto& one) { return one.second.name; });
      if (same == found.end())
        same = found.insert(found.end(), {of.line, {of.name, moves(of), &organ->obstacles().surface(i), {}}});
      same->second.organs.emplace_back(organ, i);
    }
  std::ranges::stable_sort(found, {}, &std::pair<int, ShownObstacle>::first);
  std::vector<ShownObstacle> shown;
  for (auto& [line, obstacle] : found) shown.push_back(std::move(obstacle));
  return shown;
}

}  // namespace palpate
