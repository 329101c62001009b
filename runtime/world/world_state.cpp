// Saving and restoring a world: a state of its own, and behind it the state of each organ's scene.
#include "runtime/base/alignment.h"
#include "runtime/base/error_text.h"
#include "runtime/contact/touch.h"
#include "runtime/include/palpate/palpate_world_state.h"
#include "runtime/scene/state.h"
#include "runtime/world/world.h"

namespace palpate {
namespace {

SceneState own_state_of(const palpate_world& world) {
  return {world.memory, world.definition, 0};
}

std::size_t bytes_of(const palpate_world& world) {
  std::size_t bytes = own_state_of(world).bytes();
  for (std::int32_t k = 0; k < world.organ_count; ++k) bytes += state_of(*world.organ[k]).bytes();
  return bytes;
}

}  // namespace

std::uint64_t definition_of(const palpate_world& world) {
  Digest digest;
  digest.add(world.organ_count, world.def.force_limit, world.def.force_slew, world.def.torque_limit,
             world.def.torque_slew, world.def.friction, world.def.max_pairs, world.def.max_links);
  for (std::int32_t k = 0; k < world.organ_count; ++k) digest.add(world.organ[k]->definition);
  return digest.value();
}

}  // namespace palpate

using palpate::fail;

size_t palpate_world_state_bytes(const palpate_world* world) {
  return world ? palpate::bytes_of(*world) : 0;
}

palpate_status palpate_world_save(const palpate_world* world, void* state, size_t state_bytes, palpate_error* error) {
  if (!world || !state) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "world and state must not be NULL");
  if (!palpate::is_aligned(static_cast<const std::uint64_t*>(state)))
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "state must be 8-byte aligned");
  if (const size_t needed = palpate_world_state_bytes(world); state_bytes < needed)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "state has %llu bytes; expected %llu, as palpate_world_state_bytes returns now",
                static_cast<unsigned long long>(state_bytes), static_cast<unsigned long long>(needed));
  auto* at = static_cast<unsigned char*>(state);
  at += palpate::own_state_of(*world).write(at);
  for (std::int32_t k = 0; k < world->organ_count; ++k) at += palpate::state_of(*world->organ[k]).write(at);
  return palpate::succeed(error);
}

palpate_status palpate_world_restore(palpate_world* world, const void* state, size_t state_bytes,
                                     palpate_error* error) {
  if (!world || !state) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "world and state must not be NULL");
  if (!palpate::is_aligned(static_cast<const std::uint64_t*>(state)))
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "state must be 8-byte aligned");
  const unsigned char* of_organ[PALPATE_MAX_ORGANS] = {};
  const auto* at = static_cast<const unsigned char*>(state);
  const auto* const end = at + state_bytes;
  std::size_t bytes = 0;
  if (const palpate_status status =
          palpate::own_state_of(*world).check(at, static_cast<std::size_t>(end - at), &bytes, error))
    return status;
  for (std::int32_t k = 0; k < world->organ_count; ++k) {
    of_organ[k] = at += bytes;
    palpate_error found = {};
    if (palpate::state_of(*world->organ[k]).check(at, static_cast<std::size_t>(end - at), &bytes, &found) != PALPATE_OK)
      return fail(error, found.status, 0, "organ %d: %s", static_cast<int>(k), found.text);
  }
  palpate::own_state_of(*world).read(static_cast<const unsigned char*>(state));
  for (std::int32_t k = 0; k < world->organ_count; ++k) {
    palpate_scene& scene = *world->organ[k];
    palpate::state_of(scene).read(of_organ[k]);
    palpate::touch_restored(scene.context, scene.touch);
  }
  return palpate::succeed(error);
}
