// The effects that a host names for a scene or a world.
#pragma once

#include "runtime/scene/effect.h"

namespace palpate {

class EffectChoice {
 public:
  // The host's list in the order in which effects are built and act, each of them once. PALPATE_OK, or the error, with *error filled.
  palpate_status take(const palpate_effect* const* effects, std::int32_t count, palpate_error* error);
  EffectList list() const { return {effects_, static_cast<std::size_t>(count_)}; }

 private:
  const Effect* effects_[kMostEffects] = {};
  std::int32_t count_ = 0;
};

// PALPATE_OK, or the error where the definition switches an effect on that the list does not have.
palpate_status check_effects_are_listed(const palpate_scene_def& def, EffectList effects, palpate_error* error);

}  // namespace palpate
