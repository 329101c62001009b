// One organ under one set of effects: what palpate_scene of palpate.h points to.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/step_context.h"
#include "runtime/contact/touch.h"
#include "runtime/scene/effect_list.h"
#include "runtime/scene/plan.h"
#include "runtime/shape/shape.h"

namespace palpate {

// An effect of the scene.
struct EffectInScene {
  const Effect* effect = nullptr;
  void* state = nullptr;    // of EffectBuild
  std::uint64_t bytes = 0;  // that it took
};

// Of one of several organs that are solved as one: the room for the rows between them (ContactRows::reserve), and what these use of it.
struct ReservedRows {
  std::int32_t constraints = 0, nodes = 0;
  std::uint32_t uses = 0;  // bits of Use
};

}  // namespace palpate

struct palpate_scene {
  palpate_scene(const palpate_scene_def& wanted, const palpate::EffectsOfScene& effects_of_def, palpate_bundle& opened)
      : def(wanted), parts(effects_of_def), memory(wanted.allocator), context{def, opened, tensors, watch} {
    def.parts = parts.chain();
  }
  palpate_scene_def def;
  palpate::EffectsOfScene parts;
  palpate::SceneMemory memory;
  std::uint64_t definition = 0;  // checksum of what a saved state must have in common with the scene
  palpate::Tensors tensors;
  const std::int32_t* touchable = nullptr;  // [S] node of each column
  palpate::Compliance compliance;           // where the bundle stores the compliance in blocks
  palpate::Corridor corridor;               // where something holds nodes inside
  palpate::PassWatch watch;
  const palpate::StepContext context;
  palpate::TouchState touch;
  palpate::ShapeState shape;
  palpate::Plan plan;
  // Where somebody else steps, saves and restores it in the host's place: what a host that tries is told.
  const char* not_alone = nullptr;
  palpate::EffectInScene effects[palpate::kMostEffects];  // in the order of the list
  std::int32_t effect_count = 0;
  std::uint32_t uses = 0;          // bits of Use, of these effects and of the reserved rows
  palpate::RowBudget rows;         // of these effects
  palpate::ReservedRows reserved;  // beside these

  // The effect that is the body; nullptr: the organ is linear.
  const palpate::EffectInScene* body() const {
    for (std::int32_t e = 0; e < effect_count; ++e)
      if (effects[e].effect->body) return &effects[e];
    return nullptr;
  }
  // The effect whose body the touch solves, with a field of its own; nullptr: the linear organ. Beside a body that is solved in another thread the
  // touch has another one's.
  const palpate::EffectInScene* body_in_touch() const {
    const palpate::EffectInScene* found = nullptr;
    for (std::int32_t e = 0; e < effect_count && touch.body->surface_field(); ++e)
      if (effects[e].effect->body && (!found || touch.body->added())) found = &effects[e];
    return found;
  }
  // The effect's state; nullptr where the scene does not have it.
  void* state_of(const palpate::Effect& effect) const {
    for (std::int32_t e = 0; e < effect_count; ++e)
      if (effects[e].effect == &effect) return effects[e].state;
    return nullptr;
  }
  // Of an effect that the scene has.
  palpate::Pass pass_of(const palpate::Effect& effect) const {
    std::int32_t e = 0;
    while (effects[e].effect != &effect) ++e;
    return palpate::pass_of_effect(e);
  }
};

namespace palpate {

// Fills in the plan's most_operations. Refuses fewer than a step can do with.
palpate_status state_work_bounds(palpate_scene& scene, palpate_error* error);

// Reads the host's pose, which is not NULL. Refused as palpate_scene_set_pose does; *of is then unchanged.
palpate_status set_pose(const palpate_pose* pose, OrganPose* of, palpate_error* error);

}  // namespace palpate
