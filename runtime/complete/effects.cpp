#include "runtime/complete/effects.h"

#include "runtime/fine_surface/effect.h"
#include "runtime/grasps/effect.h"
#include "runtime/inside/effect.h"
#include "runtime/large/effect.h"
#include "runtime/links/effect.h"
#include "runtime/motions/effect.h"
#include "runtime/needles/effect.h"
#include "runtime/query/effect.h"
#include "runtime/relaxation/effect.h"
#include "runtime/report/effect.h"
#include "runtime/scene/build_scene.h"
#include "runtime/skin/effect.h"

namespace palpate {

EffectList all_effects() {
  static constexpr const Effect* kAll[] = {&large_effect,   &fine_surface_effect, &grasps_effect,     &needles_effect,
                                           &motions_effect, &links_effect,        &relaxation_effect, &report_effect,
                                           &queries_effect, &skin_effect,         &dent_effect,       &inside_effect};
  static_assert(std::size(kAll) <= kMostEffects);
  return kAll;
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

palpate_status palpate_scene_create(palpate_bundle* bundle, const palpate_scene_def* def, palpate_scene** scene,
                                    palpate_error* error) {
  return palpate::create_scene(bundle, def, palpate::all_effects(), {}, scene, error);
}
