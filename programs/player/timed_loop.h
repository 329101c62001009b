// A loop that calls a step at a fixed rate, and measures how well it keeps the rate.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace palpate {

using Nanoseconds = std::int64_t;

Nanoseconds now();         // CLOCK_MONOTONIC
Nanoseconds wall_clock();  // since 1970, CLOCK_REALTIME: to compare with that of another machine
void sleep_until(Nanoseconds when);
inline double microseconds(Nanoseconds time) {
  return static_cast<double>(time) * 1e-3;
}

// What one loop measured. Times in microseconds, one for each step, in order.
struct LoopTiming {
  std::vector<double> work;     // of the call alone
  std::vector<double> wake_up;  // how late the system woke the loop, after the time it had asked for
  std::uint64_t missed = 0;  // deadlines: steps that were not done when the next one was due, and steps left out for it
  long preempted = 0;        // times the system took the processor away during the run (involuntary switches)
  std::string scheduling;    // "SCHED_FIFO 80", or why not
};

// Asks for SCHED_FIFO at that priority for the calling thread. Without the right to it the thread stays under the normal
// scheduler. Returns the name of the scheduler that it has.
std::string ask_for_fifo(int priority);

long preemptions();  // of the calling thread, so far

enum class LateSteps { left_out, caught_up };

// step(index), index from 0 to steps - 1, is called when it is due and returns the time to record as its work. Steps
// that are already late are skipped, or called one after the other without waiting. When *stop becomes true, the loop ends
// after the current step.
template <typename Step>
void run_loop(LoopTiming& timing, Nanoseconds start, double rate, std::uint64_t steps, LateSteps late,
              const std::atomic<bool>* stop, const Step& step) {
  const double period = 1e9 / rate;
  const auto due = [&](std::uint64_t index) {
    return start + static_cast<Nanoseconds>(std::llround(static_cast<double>(index) * period));
  };
  const long preempted_before = preemptions();
  for (std::uint64_t index = 0; index < steps && !(stop && stop->load());) {
    sleep_until(due(index));
    const Nanoseconds woken = now();
    const Nanoseconds spent = step(index);
    timing.wake_up.push_back(microseconds(woken - due(index)));
    timing.work.push_back(microseconds(spent));
    const Nanoseconds done = now();
    std::uint64_t next = index + 1;
    if (done > due(next)) {
      ++timing.missed;
      if (late == LateSteps::left_out) {
        const auto in_time = static_cast<std::uint64_t>(std::ceil(static_cast<double>(done - start) / period));
        timing.missed += std::min(steps, in_time) - next;
        next = std::min(steps, in_time);
      }
    }
    index = next;
  }
  timing.preempted = preemptions() - preempted_before;
}

// Percentiles p50 to p99.99 and the largest value: as JSON, as the head of a table, and as a row of it (empty without
// values).
nlohmann::ordered_json percentile_summary(const std::vector<double>& values);
std::string percentile_head(const std::string& unit);
std::string percentile_row(const std::string& name, const std::vector<double>& values);

nlohmann::ordered_json loop_summary(const LoopTiming& loop);

}  // namespace palpate
