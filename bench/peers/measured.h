// What a system's ticks took, and how far its answers are from the exact ones.
#pragma once

#include <chrono>
#include <vector>

#include "bench/peers/push.h"
#include "programs/player/summary.h"

namespace palpate::bench {

using Clock = std::chrono::steady_clock;
inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Per system: the time of each tick, and each answer's relative L2 distance from the exact one.
struct Measured {
  std::vector<double> seconds, error, force_error;
  void add(double spent, const Answer& answer, const Answer& exact) {
    seconds.push_back(spent);
    error.push_back((answer.surface - exact.surface).norm() / exact.surface.norm());
    force_error.push_back((answer.force - exact.force).norm() / exact.force.norm());
  }
  double median() const { return percentile(seconds, .5); }
};

// Ticks along the push until the time is up; the first, cold one is not counted.
template <typename Tick, typename ExactAnswer>
Measured follow(const Push& push, const ExactAnswer& exact, double budget, const Tick& tick) {
  Measured measured;
  Answer answer;
  answer.surface.resize(3 * push.body.surface_count);
  const auto start = Clock::now();
  tick(push.displacements[0], answer);
  for (std::size_t at = 1; at < push.displacements.size(); ++at) {
    const auto begin = Clock::now();
    tick(push.displacements[at], answer);
    measured.add(seconds_since(begin), answer, exact.at(push.displacements[at]));
    if (seconds_since(start) > budget) break;
  }
  return measured;
}

}  // namespace palpate::bench
