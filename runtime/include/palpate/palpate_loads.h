/* palpate_loads.h - dead weights and tractions on patches of the surface.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_loads_def loads = palpate_default_loads_def();
 *     loads.count = 1;
 *     loads.centre[0][2] = 0.04, loads.radius[0] = 0.01; // m, in the organ's frame
 *     palpate_add_part(&def.parts, &loads.part);
 *     def.collision = PALPATE_COLLISION_DEFORMED;
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     const double weight[3] = {0, 0, -0.5}; // N, downwards in the world
 *     palpate_scene_set_load(scene, 0, PALPATE_LOAD_FORCE_IN_WORLD, weight, &error);
 *     palpate_scene_touch(scene, tools, tool_count, dt, contacts, contacts_bytes);
 *     double sunk = palpate_scene_load_state(scene, 0)->displacement[2]; // m
 *
 * docs/method.md, section 19, has the method.
 */
#ifndef PALPATE_LOADS_H
#define PALPATE_LOADS_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Patches of the surface that bear loads: a patch is what of the organ's surface at rest is within `radius` of the point of the surface
 * nearest to `centre`, on triangles that face as that point's does, within 60 degrees. A load is spread evenly over the area of its patch. Every node of a patch needs a column, so
 * that a patch at a held border is refused. Needs collision OFF or DEFORMED. A body force is a motion of the bundle (palpate_motions.h). */
#define PALPATE_MAX_LOADS 4
typedef struct palpate_loads_def {
  palpate_part part;
  int32_t count;                       /* default 0: none; to PALPATE_MAX_LOADS patches                             */
  int32_t reserved;                    /* 0                                                                         */
  double centre[PALPATE_MAX_LOADS][3]; /* m, in the organ's frame, within 1e6 m                                     */
  double radius[PALPATE_MAX_LOADS];    /* m, above 0 .. 1: no less than the distance of `centre` from the surface   */
} palpate_loads_def;
PALPATE_API void palpate_init_loads_def(palpate_loads_def* def, size_t struct_bytes);
static inline palpate_loads_def palpate_default_loads_def(void) {
  palpate_loads_def def;
  palpate_init_loads_def(&def, sizeof def);
  return def;
}

/* What the three numbers of a load are, and in which frame. */
typedef enum palpate_load_kind {
  PALPATE_LOAD_FORCE = 0,            /* N in all, along the axes of the organ's frame: turns with the pose          */
  PALPATE_LOAD_FORCE_IN_WORLD = 1,   /* N in all, along the world's axes: a weight                                  */
  PALPATE_LOAD_TRACTION = 2,         /* Pa over the area of the patch at rest, as FORCE                             */
  PALPATE_LOAD_TRACTION_IN_WORLD = 3 /* Pa, as FORCE_IN_WORLD                                                       */
} palpate_load_kind;

/* Says what load 0 .. count - 1 is, from the next touch step on, until the next call. At first all are zero.
 * - A load is dead: its direction does not turn as the tissue below it deforms, and its amount does not change with the area.
 * - The first step, and the first one after palpate_scene_reset, takes the load at once. In later steps no node moves faster than
 *   max_tool_speed by a change of the loads, the turn of the pose included: what is more waits for the next steps (MOTION_LIMITED).
 * - Contacts hold what the loads leave of their targets, as with motions. The amounts travel in palpate_contacts behind those of motions: three
 *   for each load, N in the organ's frame.
 * - Under large deformation the load acts on the deformed body, which finds its balance.
 * Refused with PALPATE_ERROR_ARGUMENT, and the scene keeps its loads: another load or kind, a number that is not finite, a load that may
 * move a node of the linear organ by more than 1e6 m. error may be NULL. Never allocates or locks. Call it in the thread of
 * palpate_scene_touch. */
PALPATE_API palpate_status palpate_scene_set_load(palpate_scene* scene, int32_t load, palpate_load_kind kind,
                                                  const double vector[3], palpate_error* error);

/* One load after a touch step; the library fills it. In the world. */
typedef struct palpate_load_state {
  double force[3];        /* N, on the organ, in this step: as set, or as far as MOTION_LIMITED let it come         */
  double place[3];        /* m: the mean over the patch, as the step has deformed it                                */
  double displacement[3]; /* m: of that mean                                                                        */
  double area;            /* m^2, of the patch at rest                                                              */
} palpate_load_state;
/* Of load 0 .. count - 1, inside the scene and valid until the next step; NULL behind the last one, and for a scene without loads. Call
 * it in the thread of palpate_scene_touch. */
PALPATE_API const palpate_load_state* palpate_scene_load_state(const palpate_scene* scene, int32_t load);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_LOADS_H */
