// The plan of a scene: its passes in order, and the bundle sections that each of them maps.
#pragma once

#include <cstdint>

#include "runtime/base/passes.h"
#include "runtime/bundle/bundle.h"

namespace palpate {

struct Plan {
  static constexpr std::int32_t kCreationPasses = 6, kMost = kPasses + kCreationPasses;
  palpate_plan_pass pass[kMost] = {};
  std::int32_t count = 0;
  std::int64_t most_operations = 0;  // of a touch step
};

// Bytes that a scene has taken, by what they are for.
struct MemoryUse {
  std::uint64_t surface = 0, tissue = 0, fine_surface = 0, queries = 0, render_mesh = 0, collision = 0, report = 0,
                contacts = 0, relaxation = 0, shape = 0, deformation = 0, links = 0, dent = 0, motions = 0, inside = 0,
                needles = 0;
};

// Follows from the scene's effects and from which sections the bundle has; watch: is told each pass's index in the plan.
Plan make_plan(const palpate_scene_def& def, const palpate_bundle& bundle, const MemoryUse& memory, PassWatch& watch);

}  // namespace palpate
