// How much memory this process holds, and how much more it may take.
#pragma once

#include <algorithm>
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

// The peak of a process' memory, in which what the processes of a machine share counts once, in equal parts.
class OwnPeak {
 public:
  // After each stage, and before shared memory is given back. peak_resident, shared: what peak_resident_bytes() and shared_resident_bytes() give then; processes_here: those
  // that share. Returns the peak of all stages so far.
  double after_stage(double peak_resident, double shared, int processes_here) {
    // A peak that has not grown was reached in an earlier stage, whose shared memory may have been freed since.
    if (peak_resident > peak_resident_)
      own_ = std::max(own_, peak_resident - shared * (processes_here - 1) / processes_here);
    peak_resident_ = std::max(peak_resident_, peak_resident);
    return own_;
  }

 private:
  double peak_resident_ = 0, own_ = 0;
};

}  // namespace palpate
