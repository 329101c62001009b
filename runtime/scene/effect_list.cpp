#include "runtime/scene/effect_list.h"

#include <algorithm>
#include <iterator>

#include "runtime/base/error_text.h"

namespace palpate {
namespace {

// The fields of palpate_scene_def that switch an effect on.
constexpr EffectKey kSwitches[] = {
    {PALPATE_KEY_IN(relaxation, model), PALPATE_KEY_CHOICE, "", "", 0, 1},
    {PALPATE_KEY(deformation), PALPATE_KEY_CHOICE, "", "", 0, 1},
    {PALPATE_KEY(fine_surface), PALPATE_KEY_POINTER, "", "", 0, 1},
    {PALPATE_KEY(grasps), PALPATE_KEY_FLAG, "", "", 0, 1},
    {PALPATE_KEY(needles), PALPATE_KEY_FLAG, "", "", 0, 1},
    {PALPATE_KEY(motions), PALPATE_KEY_FLAG, "", "", 0, 1},
    {PALPATE_KEY(max_links), PALPATE_KEY_COUNT, "", "", 0, 1},
    {PALPATE_KEY(report), PALPATE_KEY_CHOICE, "", "", 0, 1},
    {PALPATE_KEY(queries), PALPATE_KEY_CHOICE, "", "", 0, 1},
    {PALPATE_KEY(render_mesh), PALPATE_KEY_POINTER, "", "", 0, 1},
    {PALPATE_KEY(dent), PALPATE_KEY_CHOICE, "", "", 0, 1},
    {PALPATE_KEY(inside), PALPATE_KEY_CHOICE, "", "", 0, 1},
};

}  // namespace

palpate_status EffectChoice::take(const palpate_effect* const* effects, std::int32_t count, palpate_error* error) {
  if (count < 0 || (count > 0 && !effects))
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "effects must be an array of effect_count pointers, found %d",
                static_cast<int>(count));
  count_ = 0;
  for (std::int32_t e = 0; e < count; ++e) {
    if (!effects[e]) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "effect %d must not be NULL", static_cast<int>(e));
    const Effect** const end = effects_ + count_;
    const Effect** const at =
        std::find_if(effects_, end, [&](const Effect* other) { return other->order >= effects[e]->order; });
    if (at != end && *at == effects[e]) continue;
    // Each effect of the library is in the list once, and they fit: one more is none of the library's.
    if (count_ == kMostEffects)
      return fail(error, PALPATE_ERROR_ARGUMENT, 0, "effect %d is not one of the library's", static_cast<int>(e));
    std::copy_backward(at, end, end + 1);
    *at = effects[e], ++count_;
  }
  return PALPATE_OK;
}

palpate_status check_effects_are_listed(const palpate_scene_def& def, EffectList effects, palpate_error* error) {
  for (const EffectKey& key : kSwitches) {
    const bool listed = std::any_of(effects.begin(), effects.end(),
                                    [&](const Effect* effect) { return effect->keys[0].offset == key.offset; });
    if (!listed && palpate_key_number(&key, &def) != 0)
      return fail(
          error, PALPATE_ERROR_EFFECT, 0,
          "palpate_scene_def: %s is set, and the list of effects does not have its effect; add it to the list, or use "
          "palpate_scene_create, which has all effects",
          key.name);
  }
  return PALPATE_OK;
}

}  // namespace palpate
