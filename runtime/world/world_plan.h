// The passes that a world itself runs in a step, beside those of its organs.
#pragma once

#include <cstdint>

#include "runtime/base/effects.h"
#include "runtime/include/palpate/palpate_plan.h"
#include "runtime/include/palpate/palpate_world.h"

namespace palpate {

enum class WorldPass : std::int32_t { input, search, solve, links, output, count };
constexpr std::int32_t kWorldPasses = static_cast<std::int32_t>(WorldPass::count);

struct WorldPlan {
  palpate_plan_pass pass[kWorldPasses] = {};
  std::int32_t count = 0;
  std::int32_t index[kWorldPasses] = {};  // of each WorldPass in pass; -1: the world does without it
  std::int32_t first = 0;                 // behind the passes of all organs
  palpate_pass_watcher watcher = nullptr;
  void* user = nullptr;

  void ended(WorldPass id) const {
    const std::int32_t at = index[static_cast<std::int32_t>(id)];
    if (kHasEffects && watcher && at >= 0) watcher(user, first + at);
  }
};

// Follows from the organs and from what the world has taken for them.
WorldPlan make_world_plan(const palpate_world& world);

}  // namespace palpate
