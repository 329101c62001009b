/* palpate_relaxation.h - forces that decay while a displacement is held.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_relaxation_def relaxation = palpate_default_relaxation_def();
 *     relaxation.terms = 1;
 *     relaxation.share[0] = 0.4; // of the force
 *     relaxation.time[0] = 2;    // s
 *     palpate_add_part(&def.parts, &relaxation.part);
 *     palpate_scene_create(bundle, &def, &scene, &error);
 */
#ifndef PALPATE_RELAXATION_H
#define PALPATE_RELAXATION_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A force that decays while a displacement is held, by a sum of exponentials (a Prony series): R(t) = 1 - sum_i share[i] (1 - exp(-t / time[i]))
 * times the instantaneous force, which the bundle's moduli give. Exact for tissue that relaxes alike everywhere, under given displacements.
 * Loading that is slow against time[i] is softer, down to the factor 1 - sum share. It acts on each tool's force, after Q; the contact
 * nodes keep the instantaneous force. Relaxation never makes a tool without `hold` pull. A tool without contacts feels no
 * force, and its memory of earlier forces fades. Needs force LINEAR or RESPONSE. */
#define PALPATE_MAX_RELAXATION_TERMS 8
typedef struct palpate_relaxation_def {
  palpate_part part;
  int32_t terms;                              /* default 0: off; to PALPATE_MAX_RELAXATION_TERMS */
  int32_t reserved;                           /* 0                                               */
  double share[PALPATE_MAX_RELAXATION_TERMS]; /* each 0 or more, together below 1                */
  double time[PALPATE_MAX_RELAXATION_TERMS];  /* s, above 0                                      */
} palpate_relaxation_def;
PALPATE_API void palpate_init_relaxation_def(palpate_relaxation_def* def, size_t struct_bytes);
static inline palpate_relaxation_def palpate_default_relaxation_def(void) {
  palpate_relaxation_def def;
  palpate_init_relaxation_def(&def, sizeof def);
  return def;
}

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_RELAXATION_H */
