/* palpate_large.h - large deformation that is solved beside the touch.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     def.deformation = PALPATE_DEFORMATION_LARGE_BESIDE; // of a bundle that was made for it
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     // in a thread of its own:
 *     while (runs)
 *       if (palpate_scene_deform(scene) == 0) sleep_a_millisecond();
 *
 * Under PALPATE_DEFORMATION_LARGE the touch step solves the body itself, and a host calls nothing of this header.
 */
#ifndef PALPATE_LARGE_H
#define PALPATE_LARGE_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* LARGE_BESIDE, LARGE_RENEWED: solves the body under the contacts of the newest touch step, eight quasi-Newton steps at most, and hands the solution
 * to the touch steps that follow. Call it in a loop in a third thread, beside those of touch and shape; neither waits for the
 * other. A host without a third thread may call it between touch steps. Returns the evaluations of the energy that it took: 0 where
 * there was nothing to do, so that the thread may sleep for a millisecond; -1 for a scene of another deformation.
 * Never allocates or locks. Cost: docs/method.md, section 14. While it runs, palpate_scene_save and palpate_scene_restore must not be
 * called for the scene, nor palpate_scene_destroy. */
PALPATE_API int32_t palpate_scene_deform(palpate_scene* scene);

/* The effect, for the list that a host gives to palpate_scene_create_with. */
PALPATE_API const palpate_effect* palpate_large_effect(void);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_LARGE_H */
