// How much memory this process holds, and how much more it may take.
#pragma once

#include <filesystem>

namespace palpate {

// Bytes that this process may still take. limit_gigabytes > 0: the process's share of that limit, less what it holds. 0: its
// share of four fifths of what is free: on the machine or, if that is less, in one of the control groups around the process
// (Slurm, containers and systemd limit a job by control groups). root: the folder that has /proc and /sys; tests pass their
// own.
double memory_left_bytes(double limit_gigabytes, int processes_here, const std::filesystem::path& root = "/");

double resident_bytes();         // of this process now
double peak_resident_bytes();    // of this process, the most so far
double shared_resident_bytes();  // of resident_bytes(): memory that it shares with other processes, MachineMemory's

}  // namespace palpate
