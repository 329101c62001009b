/* palpate_world_state.h - to save and restore what the touch steps have left in a world.
 *
 *     size_t bytes = palpate_world_state_bytes(world);
 *     void* state = malloc(bytes);
 *     palpate_world_save(world, state, bytes, &error);
 *     palpate_world_touch(world, tools, tool_count, dt, world_contacts, world_bytes);
 *     palpate_world_restore(world, state, bytes, &error); // before that step again
 */
#ifndef PALPATE_WORLD_STATE_H
#define PALPATE_WORLD_STATE_H

#include "palpate_world.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What the touch steps have left in a world, as palpate_scene_save states it for a scene. */
PALPATE_API size_t palpate_world_state_bytes(const palpate_world* world);
PALPATE_API palpate_status palpate_world_save(const palpate_world* world, void* state, size_t state_bytes,
                                              palpate_error* error);
/* A state that is refused leaves all organs as they were. */
PALPATE_API palpate_status palpate_world_restore(palpate_world* world, const void* state, size_t state_bytes,
                                                 palpate_error* error);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_WORLD_STATE_H */
