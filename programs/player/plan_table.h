// A plan as a table: for each pass the sections it maps, the memory it has taken, its predicted time on this machine, and its
// measured time.
#pragma once

#include <palpate/palpate_complete.h>

#include <cstdint>
#include <string>
#include <vector>

namespace palpate {

// The speed of this machine at this moment, measured in plain loops; the prediction divides by it.
struct MachineRates {
  double bytes_per_second;  // reading a run of memory again and again
  double flops_per_second;  // single-precision multiply-adds in cache, by the instructions that every processor has
  double steps_per_second;  // multiply-adds each of which waits for the one before
};
// bytes: the length of the run, which decides in which cache it stays. Takes about 10 ms.
MachineRates measure_machine(std::uint64_t bytes);

double predicted_seconds(const palpate_pass_work& work, const MachineRates& rates);

// One pass of a step.
struct PassCost {
  palpate_plan_pass pass;
  std::string of;  // "organ \"liver\"", "the world"; empty in a scene of one organ
  palpate_pass_work work = {};
  double predicted_us = 0, measured_us = 0;
};
// Passes of one organ follow one another; their organ stands in a line in front of them.
std::string plan_table(const std::vector<PassCost>& passes);

}  // namespace palpate
