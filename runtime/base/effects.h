// What a scene's collision, contact model and law ask of the core. Effects of the list (scene/effect.h) need no question: a step goes
// through its parts.
//
// A build with PALPATE_WITHOUT_EFFECTS answers "no" to each, so that the compiler removes that code. Such a build exists for
// two comparisons alone: recorded_run_test compares the bits of a scene that leaves the effects off, bench/effects_off.cpp
// its time. The functions are static, so that a program may hold sources of both builds.
#pragma once

#include "runtime/include/palpate/palpate.h"

namespace palpate {

#ifdef PALPATE_WITHOUT_EFFECTS
constexpr bool kHasEffects = false;
#else
constexpr bool kHasEffects = true;
#endif

// Collision against the deformed surface, not the surface at rest.
[[maybe_unused]] static bool follows_deformed_surface(const palpate_scene_def& def) {
  return kHasEffects && def.collision == PALPATE_COLLISION_DEFORMED;
}

// Contacts distinguish the surface's normal from the directions across it.
[[maybe_unused]] static bool needs_contact_frames(const palpate_scene_def& def) {
  return kHasEffects && (def.contact == PALPATE_CONTACT_PATCH || def.law != PALPATE_LAW_STICKING);
}

// The surface point that a tool point holds is found anew in every step.
[[maybe_unused]] static bool anchors_follow_tools(const palpate_scene_def& def) {
  return kHasEffects && (def.law == PALPATE_LAW_SLIDING || def.law == PALPATE_LAW_UNILATERAL);
}

// A contact may carry no force, or slip.
[[maybe_unused]] static bool contacts_may_give_way(const palpate_scene_def& def) {
  return kHasEffects && (def.law == PALPATE_LAW_UNILATERAL || def.law == PALPATE_LAW_COULOMB);
}

// Anchors move over the surface, against their tools.
[[maybe_unused]] static bool contacts_may_slide(const palpate_scene_def& def) {
  return kHasEffects && def.law != PALPATE_LAW_STICKING && def.collision != PALPATE_COLLISION_OFF;
}

// True where the scene asks for something that a build without effects does not have.
[[maybe_unused]] static bool asks_for_missing_effects(const palpate_scene_def& def) {
  return !kHasEffects &&
         (def.collision == PALPATE_COLLISION_DEFORMED || def.contact == PALPATE_CONTACT_PATCH ||
          def.law != PALPATE_LAW_STICKING || def.force == PALPATE_FORCE_RESPONSE || def.radial != PALPATE_RADIAL_OFF);
}

}  // namespace palpate
