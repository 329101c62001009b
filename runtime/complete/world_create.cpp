#include "runtime/complete/effects.h"
#include "runtime/include/palpate/palpate_world.h"

palpate_status palpate_world_create(const palpate_world_def* def, palpate_world** world, palpate_error* error) {
  const palpate::EffectList all = palpate::all_effects();
  return palpate_world_create_with(def, all.data(), static_cast<int32_t>(all.size()), world, error);
}
