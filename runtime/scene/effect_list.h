// The effects of a scene: those whose structs are in the chain of its definition.
#pragma once

#include "runtime/scene/effect.h"

namespace palpate {

class EffectsOfScene {
 public:
  // Copies the structs of a host's chain, over the defaults of this library. PALPATE_OK, or the error, with *error filled.
  palpate_status take(const palpate_part* chain, palpate_error* error);
  // Those that are on, in the order in which effects are built and act.
  EffectList list() const { return {effects_, static_cast<std::size_t>(count_)}; }
  // The copies of their structs as a chain, which is valid as long as this object stays where it is.
  const palpate_part* chain();

 private:
  // One that is off is passed over.
  palpate_status insert(const palpate_part& from, palpate_error* error);
  palpate_part* part(std::int32_t e) { return reinterpret_cast<palpate_part*>(parts_[e]); }

  const Effect* effects_[kMostEffects] = {};
  std::int32_t count_ = 0;
  alignas(8) unsigned char parts_[kMostEffects][kMostPartBytes] = {};
};

}  // namespace palpate
