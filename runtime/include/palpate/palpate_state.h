/* palpate_state.h - to save, restore and copy what the touch steps have left in a scene.
 *
 *     size_t bytes = palpate_scene_state_bytes(scene);
 *     void* state = malloc(bytes);
 *     palpate_scene_save(scene, state, bytes, &error);
 *     palpate_scene_touch(scene, tools, tool_count, dt, contacts, contacts_bytes);
 *     palpate_scene_restore(scene, state, bytes, &error);
 *     palpate_scene_touch(scene, tools, tool_count, dt, contacts, contacts_bytes); // the same bits again
 */
#ifndef PALPATE_STATE_H
#define PALPATE_STATE_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What the touch steps have left in a scene: contacts, forces, last positions, relaxation, the pose with its velocities, and the
 * report. After a restore the next steps give the same bits as the next steps of the scene that was saved, if they get the same
 * input. The shape half and the queries have no state of their own.
 * A state is plain bytes, for the same version of the library, the same byte order, a scene with the same definition (render mesh,
 * dent, inside and allocator aside), and a bundle with the same identity; it may be restored into another scene or another process.
 * None of these functions allocates or locks; call them in the thread of palpate_scene_touch. */

/* The bytes that a saved state of the scene takes now. They grow with the contacts: ask after the last step. */
PALPATE_API size_t palpate_scene_state_bytes(const palpate_scene* scene);
/* Writes palpate_scene_state_bytes(scene) bytes to `state`, which is 8-byte aligned and has state_bytes bytes, so many or more.
 * The scene does not change. error may be NULL. Cost: a copy of these bytes and their checksum. */
PALPATE_API palpate_status palpate_scene_save(const palpate_scene* scene, void* state, size_t state_bytes,
                                              palpate_error* error);
/* Restores a state of state_bytes bytes, 8-byte aligned. A state that is damaged, or of another version, definition or bundle, is
 * refused, and the scene stays as it was. A checksum finds damage, not intent: restore no state that you would not run. Cost: as
 * saving, and the compliances between the nodes under contact are read anew. */
PALPATE_API palpate_status palpate_scene_restore(palpate_scene* scene, const void* state, size_t state_bytes,
                                                 palpate_error* error);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_STATE_H */
