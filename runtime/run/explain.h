// The plan of a scene as a table: what each pass maps and what it is predicted to cost.
#pragma once

#include <filesystem>
#include <string>

#include "runtime/run/player.h"

namespace palpate {

// What this machine does now in plain loops: bytes/s of one read pass over that much memory, and flop/s of
// multiply-adds in cache. About 50 ms.
struct MachineRates {
  double bytes_per_second, flops_per_second;
};
MachineRates measure_machine(std::uint64_t memory_bytes);

// contact_nodes: how many are under contact in one step. A pass is predicted to take the longer of reading its bytes
// and of doing its flops; passes that do not grow with the contacts show no prediction.
std::string plan_table(const palpate_plan_pass* passes, int count, int contact_nodes, const MachineRates& rates);

// Plays the scene. Returns the plan, its predicted cost at the most contact nodes that the scene reaches, and what
// touch and shape took there; and, for each effect that can be left out alone, what they took less without it. bundle: the
// player's.
std::string explain(Player& player, const std::filesystem::path& bundle);

}  // namespace palpate
