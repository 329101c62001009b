// The plan of a scene as a table: what each pass maps, what it is predicted to cost on this machine, what it took.
#pragma once

#include <string>
#include <vector>

#include "programs/player/player.h"

namespace palpate {

// What this machine does now, in plain loops like those that the passes are predicted from.
struct MachineRates {
  double bytes_per_second;  // reading a run of memory again and again
  double flops_per_second;  // single-precision multiply-adds in cache, by the instructions that every processor has
  double steps_per_second;  // multiply-adds each of which waits for the one before
};
// bytes: how long the run is, which says in which cache it stays. About 10 ms.
MachineRates measure_machine(std::uint64_t bytes);

double predicted_seconds(const palpate_pass_work& work, const MachineRates& rates);

// One pass of a step.
struct PassCost {
  palpate_plan_pass pass;
  palpate_pass_work work = {};
  double predicted_us = 0, measured_us = 0;
};
std::string plan_table(const std::vector<PassCost>& passes);

// Plays the scene and tells its plan with the costs at the steps that hold as many nodes as most do. Measured: medians of
// what palpate_watch_passes sees, less the clock's own time; and of whole calls that nobody watches.
std::string explain(Player& player);

}  // namespace palpate
