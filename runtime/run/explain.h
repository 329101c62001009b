// The plan of a scene as a table: what each pass maps and what it is predicted to cost.
#pragma once

#include <string>

#include "runtime/run/player.h"

namespace palpate {

// Bytes per second of one plain read pass over memory larger than the caches, measured now (about 50 ms).
double measure_read_rate();

// contact_nodes: how many are under contact in one step. A pass is predicted to take the longer of reading its bytes at
// read_rate and of one multiply-add a nanosecond; passes that do not grow with the contacts show no prediction.
std::string plan_table(const palpate_plan_pass* passes, int count, int contact_nodes, double read_rate);

}  // namespace palpate
