// Times and errors of one system over the ticks of a push.
#pragma once

#include <vector>

#include "studies/peers/push.h"
#include "studies/timing/timing.h"

namespace palpate::studies {

// For each tick: its time, s, and the relative error of the answer in the 2-norm.
struct Measured {
  std::vector<double> seconds, error, force_error;
  void add(double spent, const Answer& answer, const Answer& exact) {
    seconds.push_back(spent);
    error.push_back((answer.surface - exact.surface).norm() / exact.surface.norm());
    force_error.push_back((answer.force - exact.force).norm() / exact.force.norm());
  }
  double median() const { return percentile(seconds, .5); }
};

// Follows the push tick by tick, at most `budget` seconds. The first tick finds cold caches and is not counted.
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

}  // namespace palpate::studies
