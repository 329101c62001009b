// The quantities of a played step that its cost depends on, as palpate_predict_pass takes them.
#pragma once

#include <vector>

#include "programs/player/world_player.h"

namespace palpate {

using ToolPoints = std::vector<std::vector<SceneConfig::Vector>>;  // [tool][point]

palpate_step_load load_of(const PlayedOrgan& organ, const ToolPoints& points, const palpate_contacts& contacts);

// Of each organ of a world, and last that of the world, as palpate_world_predict_pass takes them.
std::vector<palpate_step_load> loads_of(const WorldPlayer& player, const palpate_world_contacts& contacts);

}  // namespace palpate
