// How much memory this process holds, and how much more it may take.
#pragma once

#include <filesystem>

namespace palpate {

// Bytes that this process may still take. limit_gigabytes > 0: its share of that limit less what it holds. 0: its share of
// four fifths of what the machine has free and what each control group around the process leaves (control groups are how
// Slurm, containers and systemd limit a job). root: where /proc and /sys stand; the tests put their own there.
double memory_left_bytes(double limit_gigabytes, int processes_here, const std::filesystem::path& root = "/");

double resident_bytes();       // of this process now
double peak_resident_bytes();  // at most so far

}  // namespace palpate
