/* palpate_crossings.h - whether the deformed surface of an organ crosses itself, and where.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_crossings_def crossings = palpate_default_crossings_def();
 *     palpate_add_part(&def.parts, &crossings.part);
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     palpate_crossing place;
 *     palpate_crossings_out found = palpate_default_crossings_out();
 *     found.capacity = 1, found.crossings = &place;
 *     palpate_scene_shape(scene, contacts, &shape); // with positions
 *     if (palpate_scene_crossings(scene, &shape, &found) & PALPATE_STEP_SURFACE_CROSSES)
 *       printf("%d pairs of triangles, one at %g %g %g m\n", found.pairs, place.place[0], place.place[1], place.place[2]);
 */
#ifndef PALPATE_CROSSINGS_H
#define PALPATE_CROSSINGS_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Nothing in the library keeps an organ's surface from passing through itself, under linear or large deformation: two flaps of a liver that
 * are pressed together lie in one another. A scene with crossings ON tells where. */
typedef enum palpate_crossings_model {
  PALPATE_CROSSINGS_OFF, /* no check, and neither memory nor time for it                                          */
  PALPATE_CROSSINGS_ON   /* palpate_scene_crossings. Needs a shape                                                */
} palpate_crossings_model;
typedef struct palpate_crossings_def {
  palpate_part part;
  palpate_crossings_model crossings; /* default ON                                                                */
  int32_t crossings_calls;      /* default 60    [1 .. 1000000] calls from the begin of a check to the begin of the next
                                        one: at 60 shapes a second, one check a second                            */
  int32_t crossings_operations; /* default 60000 [1000 .. 1000000000] counted operations of a call, about 0.06 ms. A
                                        check that takes more than crossings_calls calls goes on to its end       */
  int32_t reserved;             /* 0                                                                         */
} palpate_crossings_def;
PALPATE_API void palpate_init_crossings_def(palpate_crossings_def* def, size_t struct_bytes);
static inline palpate_crossings_def palpate_default_crossings_def(void) {
  palpate_crossings_def def;
  palpate_init_crossings_def(&def, sizeof def);
  return def;
}

/* Two triangles of the bundle's surface that cross. */
typedef struct palpate_crossing {
  int32_t triangle[2]; /* ascending                                                                               */
  double place[3];     /* m, where an edge of one passes through the other, in the organ's frame                  */
  double rest[2][3];   /* m, the same place of each triangle at rest                                              */
} palpate_crossing;

typedef struct palpate_crossings_out {
  uint32_t struct_bytes;       /* sizeof(palpate_crossings_out)                                                   */
  int32_t capacity;            /* in: room in crossings                                                           */
  int32_t count;               /* out: crossings filled                                                           */
  int32_t pairs;               /* out: pairs of triangles that cross; of the first 64 the places are known        */
  uint64_t checks;             /* out: checks that have come to their end; 0: nothing is known yet                */
  palpate_crossing* crossings; /* default NULL; [capacity]                                                        */
} palpate_crossings_out;
PALPATE_API void palpate_init_crossings_out(palpate_crossings_out* out, size_t struct_bytes);
static inline palpate_crossings_out palpate_default_crossings_out(void) {
  palpate_crossings_out out;
  palpate_init_crossings_out(&out, sizeof out);
  return out;
}

/* Goes on with a check of the surface against itself, and says what the last finished one has found; out may be NULL. Call it after each
 * palpate_scene_shape, in its thread. A check copies the positions of the shape that begins it, so all of it is of one shape, and spreads
 * over the calls after that. shape: as palpate_scene_shape filled it; this call reads its positions and node_count, at least Ns. A
 * shape with a position that is not finite begins no check (BAD_INPUT). Returns SURFACE_CROSSES where the last finished check found a crossing.
 * Two triangles cross where an edge of one passes through the inside of the other. Surfaces that touch, and triangles that share an edge, do
 * not cross; of two that share a vertex only what lies opposite of it counts. Two sides that double precision cannot tell apart touch. Allocates nothing. */
PALPATE_API palpate_step_flags palpate_scene_crossings(palpate_scene* scene, const palpate_shape_out* shape,
                                                       palpate_crossings_out* out);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_CROSSINGS_H */
