// The passes of a step, and the host's function that a scene calls at the end of each one.
#pragma once

#include <cstdint>

#include "runtime/base/effects.h"
#include "runtime/include/palpate/palpate_plan.h"

namespace palpate {

// In the order in which a step runs them.
enum class Pass : std::int32_t {
  input,
  collision,
  rows,
  contact,
  force,
  output,
  deform,
  superposition,
  radial,
  positions,
  count
};
constexpr std::int32_t kPasses = static_cast<std::int32_t>(Pass::count);
// Effects that a scene may have on at once (scene/effect.h). The number of an effect's pass is behind those of all others.
constexpr std::int32_t kMostEffects = 17;
constexpr Pass pass_of_effect(std::int32_t effect) {
  return static_cast<Pass>(kPasses + effect);
}

struct PassWatch {
  palpate_pass_watcher watcher = nullptr;
  void* user = nullptr;
  std::int32_t index_in_plan[kPasses + kMostEffects];  // of each Pass; -1: the plan does not have it
  std::int32_t first = 0;                              // of the plan, in that of several scenes whose watcher this is

  PassWatch() {
    for (std::int32_t& index : index_in_plan) index = -1;
  }
  // A pass may end several times in a step, once for each part of its work. Without a watcher: one branch, never taken.
  void ended(Pass pass) const {
    if (kHasEffects && watcher) watcher(user, first + index_in_plan[static_cast<std::int32_t>(pass)]);
  }
};

}  // namespace palpate
