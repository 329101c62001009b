// What a scene costs: its plan as a table, with predicted and measured times.
#pragma once

#include <string>

#include "programs/player/plan_table.h"
#include "programs/player/world_player.h"

namespace palpate {

// Plays the scene and returns the table. It shows the steps that have the most common number of contact nodes, of all organs
// together. Measured times of passes are medians from palpate_watch_passes, minus the time of reading the clock; those of whole calls are
// measured in plays without it. What the library noted of the scene follows, a line each: how many steps large deformation takes whatever
// max_operations says, organs that overlap as they stand.
std::string explain(Player& player);
std::string explain(WorldPlayer& player);

}  // namespace palpate
