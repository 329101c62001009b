// The plan of a scene: its passes in order, and the bundle sections that each of them maps.
#pragma once

#include <cstdint>

#include "runtime/base/passes.h"
#include "runtime/bundle/bundle.h"

struct palpate_scene;

namespace palpate {

struct Plan {
  static constexpr std::int32_t kMost = kPasses + kMostEffects + 5;
  palpate_plan_pass pass[kMost] = {};
  std::int32_t count = 0;
  std::int64_t most_operations = 0;  // of a touch step
  // The names of the sections that the passes map, one text behind another; the passes point into it.
  static constexpr std::int32_t kMostText = 8192;
  char text[kMostText] = {};
  std::int32_t text_count = 0;
};

// Bytes that a scene has taken, by what they are for. Each effect of the scene's list states its own.
struct MemoryUse {
  std::uint64_t surface = 0, tissue = 0, collision = 0, contacts = 0, shape = 0;
};

// Fills in the scene's plan, and tells its watch each pass's index in the plan. Both follow from the scene's effects and from which
// sections the bundle has.
void make_plan(palpate_scene& scene, const MemoryUse& memory);

}  // namespace palpate
