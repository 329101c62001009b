#include "runtime/complete/effects.h"

#include "runtime/crossings/effect.h"
#include "runtime/cut/blades.h"
#include "runtime/cut/effect.h"
#include "runtime/cut/lips.h"
#include "runtime/fine_surface/effect.h"
#include "runtime/force_control/effect.h"
#include "runtime/grasps/effect.h"
#include "runtime/inside/effect.h"
#include "runtime/large/effect.h"
#include "runtime/links/effect.h"
#include "runtime/links/link.h"
#include "runtime/loads/effect.h"
#include "runtime/motions/effect.h"
#include "runtime/needles/effect.h"
#include "runtime/needles/needle.h"
#include "runtime/obstacles/effect.h"
#include "runtime/obstacles/obstacles.h"
#include "runtime/query/effect.h"
#include "runtime/relaxation/effect.h"
#include "runtime/report/effect.h"
#include "runtime/skin/effect.h"
#include "runtime/world/joint_solver.h"

namespace palpate {

// Each source has a number of its own, and they ascend in the order in which a step asks for rows.
static_assert(ContactSource::tool < kNeedleSource && kNeedleSource == ContactSource{kLastSourceOfTools} &&
              kNeedleSource < kLinkSource && kLinkSource < kObstacleSource && kObstacleSource < kBladeSource &&
              kBladeSource < kLipSource && kLipSource < kPairSource && kPairSource < kWorldLinkSource &&
              kWorldLinkSource == ContactSource{kLastSource});

EffectList all_effects() {
#ifdef PALPATE_CORE_ALONE  // the module of the core for browsers (bindings/web)
  return {};
#else
  static constexpr const Effect* kAll[] = {
      &large_effect,      &fine_surface_effect,  &grasps_effect,    &needles_effect,   &motions_effect, &links_effect,
      &relaxation_effect, &report_effect,        &queries_effect,   &skin_effect,      &dent_effect,    &inside_effect,
      &loads_effect,      &force_control_effect, &obstacles_effect, &crossings_effect, &cut_effect};
  static_assert(std::size(kAll) <= kMostEffects);
  return kAll;
#endif
}

}  // namespace palpate

const palpate_key* palpate_scene_key(int32_t key) {
  std::span<const palpate::EffectKey> keys = palpate::core_keys();
  std::size_t at = static_cast<std::size_t>(key);
  for (const palpate::Effect* effect : palpate::all_effects()) {
    if (at < keys.size()) break;
    at -= keys.size(), keys = effect->keys;
  }
  return at < keys.size() ? &keys[at] : nullptr;
}

// One struct behind the other, each in kMostPartBytes.
size_t palpate_all_parts_bytes(void) {
  return palpate::all_effects().size() * palpate::kMostPartBytes;
}

void palpate_add_all_parts(palpate_scene_def* def, void* memory) {
  unsigned char* at = static_cast<unsigned char*>(memory);
  for (const palpate::Effect* effect : palpate::all_effects()) {
    auto* const part = reinterpret_cast<palpate_part*>(at);
    effect->def.init(part, effect->def.sizes.known);
    palpate_add_part(&def->parts, part);
    palpate_set_key(&effect->keys[0], def, 0);
    at += palpate::kMostPartBytes;
  }
}
