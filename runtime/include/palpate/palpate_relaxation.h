/* palpate_relaxation.h - forces that decay while a displacement is held.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     def.relaxation.model = PALPATE_RELAXATION_PRONY;
 *     def.relaxation.terms = 1;
 *     def.relaxation.share[0] = 0.4; // of the force
 *     def.relaxation.time[0] = 2;    // s
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *
 * palpate.h has the struct.
 */
#ifndef PALPATE_RELAXATION_H
#define PALPATE_RELAXATION_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The effect, for the list that a host gives to palpate_scene_create_with. */
PALPATE_API const palpate_effect* palpate_relaxation_effect(void);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_RELAXATION_H */
