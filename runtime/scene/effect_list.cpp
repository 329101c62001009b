#include "runtime/scene/effect_list.h"

#include <algorithm>

#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"

namespace palpate {
namespace {

// An effect whose switch is an array of the host is off where all bytes behind its palpate_part are zero. So a host that sets other fields and
// forgets the array is told.
bool is_off(const Effect& effect, const unsigned char* part) {
  if (effect.keys[0].type != PALPATE_KEY_POINTER) return number_in(effect.keys[0], part) == 0;
  return std::all_of(part + sizeof(palpate_part), part + effect.def.sizes.known,
                     [](unsigned char b) { return b == 0; });
}

}  // namespace

palpate_status EffectsOfScene::take(const palpate_part* chain, palpate_error* error) {
  count_ = 0;
  std::int32_t seen = 0;
  for (const palpate_part* from = chain; from; from = from->next) {
    if (seen++ == kMostEffects)
      return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                  "palpate_scene_def: more than %d parts in the chain; add each part once",
                  static_cast<int>(kMostEffects));
    if (!is_aligned(from) || !from->effect)
      return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                  "palpate_scene_def: part %d of the chain is not the struct of an effect; start from its "
                  "palpate_default function",
                  static_cast<int>(seen));
    if (const palpate_status status = insert(*from, error)) return status;
  }
  return PALPATE_OK;
}

palpate_status EffectsOfScene::insert(const palpate_part& from, palpate_error* error) {
  const Effect& effect = *from.effect;
  alignas(8) unsigned char copy[kMostPartBytes] = {};
  effect.def.init(copy, effect.def.sizes.known);
  if (const palpate_status status = read_host_struct(effect.def.name, &from, copy, effect.def.sizes, error))
    return status;
  if (is_off(effect, copy)) return PALPATE_OK;
  std::int32_t at = 0;
  while (at < count_ && effects_[at]->order < effect.order) ++at;
  if (at < count_ && effects_[at] == &effect)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_scene_def: the chain of parts has palpate_%s twice; add it once", effect.def.name);
  std::copy_backward(effects_ + at, effects_ + count_, effects_ + count_ + 1);
  std::copy_backward(parts_[at], parts_[count_], parts_[count_ + 1]);
  effects_[at] = &effect, ++count_;
  std::copy_n(copy, kMostPartBytes, parts_[at]);
  return PALPATE_OK;
}

const palpate_part* EffectsOfScene::chain() {
  for (std::int32_t e = 0; e < count_; ++e) part(e)->next = e + 1 < count_ ? part(e + 1) : nullptr;
  return count_ > 0 ? part(0) : nullptr;
}

}  // namespace palpate
