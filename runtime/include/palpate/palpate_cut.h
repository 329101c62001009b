/* palpate_cut.h - an organ that is cut while it is touched: blades that the host moves, and tissue that is removed.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_cut_def cut = palpate_default_cut_def();
 *     palpate_add_part(&def.parts, &cut.part);
 *     def.collision = PALPATE_COLLISION_DEFORMED;
 *     palpate_scene_create(bundle, &def, &scene, &error); // a bundle with [cut] in its boundary file
 *     const double edge[6] = {0.01, 0.02, 0.05, 0.01, 0.02, 0.03}; // m, in the world: from heel to tip
 *     palpate_scene_set_blade(scene, 0, edge, 2, &error); // in each step
 *     palpate_scene_touch(scene, tools, tool_count, dt, contacts, contacts_bytes);
 *     int32_t lips = palpate_scene_cut_state(scene)->faces;
 *     if (lips > 0) printf("%d faces are cut\n", lips);
 *
 * docs/method.md, section 24, has the method.
 */
#ifndef PALPATE_CUT_H
#define PALPATE_CUT_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The organ's mesh is cut along the faces of its tetrahedra that lie nearest to the way of a blade; tissue that is removed is whole tetrahedra. What is
 * left deforms as the mesh that is left would, exactly (linear elasticity). The lips of a cut are surface: they are touched and drawn. */
typedef enum palpate_cut {
  PALPATE_CUT_OFF, /* no cut, and neither memory nor time for it                                                 */
  PALPATE_CUT_ON   /* Needs a bundle with a region that can be cut, and collision DEFORMED                       */
} palpate_cut;
typedef struct palpate_cut_def {
  palpate_part part;
  palpate_cut cut;   /* default ON                                                                            */
  int32_t cut_nodes; /* default 0 [0 .. 100000]: new nodes at most; 0: as many as the bundle reserves         */
  int32_t cut_rank;  /* default 600 [16 .. 4096]: rank of what all cuts may add to the compliance: 3 a split node, 5 of
                            p1-anp; up to 12 a removed tetrahedron. Memory: 8 rank^2 + 24 rank Ns bytes           */
  int32_t
      cut_operations; /* default 100000 [1000 .. 1000000000]: counted operations of a step for the compliance of what was
                            cut, about a nanosecond each; what is left of it comes in the next steps             */
} palpate_cut_def;
PALPATE_API void palpate_init_cut_def(palpate_cut_def* def, size_t struct_bytes);
static inline palpate_cut_def palpate_default_cut_def(void) {
  palpate_cut_def def;
  palpate_init_cut_def(&def, sizeof def);
  return def;
}

#define PALPATE_MAX_BLADES 4
#define PALPATE_MAX_BLADE_POINTS 16

/* Says where the edge of blade 0 .. PALPATE_MAX_BLADES - 1 is at the next touch step: a line of points, [point_count][3] m, in the world. It cuts
 * what lies between its line in the step before and this one, in the organ as it is then deformed; a blade that comes, with other points or
 * behind point_count 0, cuts nothing in its first step. point_count 0: the blade is withdrawn. Tissue that moves past a blade that stands
 * still is cut too. A blade feels no force and holds nothing.
 * - Only faces of the region that the bundle's boundary file names are cut.
 * - A cut begins at the surface or at another cut.
 * - While the compliance of an earlier step's cut is not whole (palpate_cut_state.left), blades wait: what they pass is cut after that, along the straight
 *   way between.
 * Refused with PALPATE_ERROR_ARGUMENT: another blade, a scene that does not cut, more points than PALPATE_MAX_BLADE_POINTS or one point alone,
 * numbers that are not finite or beyond 1e6 m. error may be NULL. Never allocates or locks. Call it in the thread of palpate_scene_touch. */
PALPATE_API palpate_status palpate_scene_set_blade(palpate_scene* scene, int32_t blade, const double* points,
                                                   int32_t point_count, palpate_error* error);

/* At the next touch step, removes the tetrahedra of the region whose middle lies within `radius` m of `centre`, [3] m in the world, in the organ as
 * it is then deformed: those nearest to the centre first, and only those that leave a surface without edges of more than two triangles. The next call
 * before that step takes the place of this one. Refused with PALPATE_ERROR_ARGUMENT: numbers as above, a radius that is not above 0. */
PALPATE_API palpate_status palpate_scene_remove_tissue(palpate_scene* scene, const double* centre, double radius,
                                                       palpate_error* error);

/* What has been cut. The library fills it. */
typedef struct palpate_cut_state {
  uint64_t surface; /* goes up by one or more with each change of the surface                                  */
  double area;      /* m^2, at rest: of the faces that are cut, each once                                      */
  int32_t faces;    /* that are cut                                                                            */
  int32_t removed;  /* tetrahedra                                                                              */
  int32_t nodes;    /* new ones: they have the last numbers among the nodes of a shape that are in use         */
  int32_t pieces;   /* of the organ, 1 where nothing has come off                                              */
  int32_t waiting;  /* faces that a blade has met and that cannot be cut yet: the surface would not be closed  */
  int32_t left;     /* changes that the compliance does not have yet: 0 in most steps                          */
  int32_t rank;     /* of what the cuts add to the compliance                                                  */
  int32_t is_full;  /* 1: there are no nodes or no rank left, and nothing more is cut                          */
} palpate_cut_state;
/* Inside the scene and valid until the next step; NULL for a scene that does not cut. Call it in the thread of palpate_scene_touch. */
PALPATE_API const palpate_cut_state* palpate_scene_cut_state(const palpate_scene* scene);

/* The surface of what is left, as [count][3] nodes of a shape, counter-clockwise from outside: to draw a shape, in place of the bundle's triangles. Fills
 * `triangles` with the first `capacity` of them, and returns the count; 0 for a scene that does not cut. Where is_lip is not NULL, it gets 1
 * for each triangle of a cut, 0 for each of the bundle's own. Call it in the thread of palpate_scene_touch, when palpate_cut_state.surface has changed. */
PALPATE_API int32_t palpate_scene_cut_surface(const palpate_scene* scene, int32_t* triangles, uint8_t* is_lip,
                                              int32_t capacity);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_CUT_H */
