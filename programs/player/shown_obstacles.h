// The obstacles of a scene for those who draw them, each once, whatever number of organs it holds off.
#pragma once

#include <palpate/palpate_obstacles.h>

#include <string>
#include <utility>
#include <vector>

#include "programs/player/played_organ.h"

namespace palpate {

struct ShownObstacle {
  std::string name;
  bool moves;                 // while the scene is played
  const RenderMesh* surface;  // in its frame
  std::vector<std::pair<const PlayedOrgan*, std::size_t>>
      organs;  // that it holds off, and its number among their obstacles
  // After a touch step, in the world: the force and the torque are those of all organs together.
  palpate_obstacle_state state() const;
};

// In the order of the scene. organs must outlive the result.
std::vector<ShownObstacle> shown_obstacles(const std::vector<const PlayedOrgan*>& organs);

}  // namespace palpate
