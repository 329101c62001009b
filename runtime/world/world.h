// Several organs and the tools that touch them: what palpate_world of palpate_world.h points to.
#pragma once

#include <cstdint>

#include "runtime/base/host_struct.h"
#include "runtime/base/scene_memory.h"
#include "runtime/include/palpate/palpate_world.h"
#include "runtime/scene/scene.h"
#include "runtime/world/islands.h"
#include "runtime/world/organ_pairs.h"
#include "runtime/world/world_input.h"
#include "runtime/world/world_links.h"
#include "runtime/world/world_plan.h"
#include "runtime/world/world_step.h"

namespace palpate {}  // namespace palpate

struct palpate_world {
  explicit palpate_world(const palpate_world_def& wanted) : def(wanted), memory(wanted.allocator) {}
  palpate_world_def def;
  palpate::SceneMemory memory;
  std::uint64_t definition = 0;  // checksum of what a saved state must have in common with the world
  palpate_scene* organ[PALPATE_MAX_ORGANS] = {};
  std::int32_t organ_count = 0;
  palpate::OrganInput organ_input[PALPATE_MAX_ORGANS];
  palpate::WorldInput input;
  // What joins organs, and the step that asks for its rows.
  palpate::OrganPairs pairs;
  palpate::WorldLinks links;
  palpate::Islands islands;
  palpate::WorldStep in_step;
  std::uint64_t pass_bytes[palpate::kWorldPasses] = {};  // memory of each WorldPass
  palpate::WorldPlan plan;
  palpate::SentForce sent[PALPATE_MAX_TOOLS];
  std::uint64_t step = 0;
};

namespace palpate {

// The touch step of all organs; *out has room for all that it may find. Returns the step flags.
std::uint32_t touch_world(palpate_world& world, const palpate_tool* tools, std::int32_t tool_count, double dt,
                          palpate_world_contacts& out);
// Bytes of the result, with room for all that a step may find.
std::size_t bytes_of_world_contacts(const palpate_world& world);

// A checksum of what a saved state must have in common with the world.
std::uint64_t definition_of(const palpate_world& world);

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_world_organ> = offsetof(palpate_world_organ, def);
template <>
inline constexpr std::size_t kLeastStructBytes<palpate_world_def> = offsetof(palpate_world_def, force_limit);

}  // namespace palpate
