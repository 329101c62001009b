// The plan of a scene: its passes in order, and the bundle sections that each of them maps.
#pragma once

#include <cstdint>

#include "runtime/base/passes.h"
#include "runtime/bundle/bundle.h"

namespace palpate {

struct Plan {
  static constexpr std::int32_t kCreationPasses = 3, kMost = kPasses + kCreationPasses;
  palpate_plan_pass pass[kMost] = {};
  std::int32_t count = 0;
};

// Follows from the scene's effects and from which sections the bundle has; watch: is told each pass's index in the plan.
Plan make_plan(const palpate_scene_def& def, const palpate_bundle& bundle, PassWatch& watch);

}  // namespace palpate
