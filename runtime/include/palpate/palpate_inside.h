/* palpate_inside.h - strain and stress inside the organ, and meshes that are carried along.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_inside_def inside = palpate_default_inside_def();
 *     def.shape = PALPATE_SHAPE_VOLUME;
 *     palpate_add_part(&def.parts, &inside.part);
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     palpate_inside_place place;
 *     palpate_scene_locate(scene, point, 1, 0.001, &place); // once
 *     palpate_scene_shape(scene, contacts, &shape);
 *     palpate_scene_inside(scene, &shape, NULL);
 *     float pressure; // Pa
 *     palpate_inside_out out = palpate_default_inside_out();
 *     out.capacity = 1, out.pressures = &pressure;
 *     palpate_scene_inside_at(scene, &place, 1, &out);
 */
#ifndef PALPATE_INSIDE_H
#define PALPATE_INSIDE_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Whether the scene tells strain and stress inside the organ (palpate_scene_inside) and carries meshes inside it
 * (palpate_scene_carry). */
typedef enum palpate_inside_model {
  PALPATE_INSIDE_OFF, /* neither, and neither memory nor time for them                                           */
  PALPATE_INSIDE_ON   /* both. Needs shape VOLUME and a bundle of the elements p1, p1-anp or p1-ang              */
} palpate_inside_model;
typedef struct palpate_inside_def {
  palpate_part part;
  palpate_inside_model inside; /* default ON */
  int32_t reserved;            /* 0          */
} palpate_inside_def;
PALPATE_API void palpate_init_inside_def(palpate_inside_def* def, size_t struct_bytes);
static inline palpate_inside_def palpate_default_inside_def(void) {
  palpate_inside_def def;
  palpate_init_inside_def(&def, sizeof def);
  return def;
}

/* What a scene with inside ON says about the tissue below the surface: the section of a viewer, the strain in a tumour, where a
 * vessel has gone. All of it follows from a shape, so that motions, preload and large deformation are in it as they are in the shape.
 *
 * Strain   of small displacements, the symmetric part of the displacement gradient; under deformation LARGE and its kin, Green and
 *          Lagrange's strain (H + H^T + H^T H) / 2. It is counted from the organ as it was meshed: with preload ON, that of the
 *          preload is part of it.
 * Stress   Cauchy's, Pa, by the bundle's moduli, and under LARGE by its laws: the instantaneous one, without relaxation. With radial
 *          RESPONSE it is that of the corrected displacements, which do not balance the forces.
 * Tensors  xx yy zz xy yz xz along the axes of the organ's frame; xy is half of the shear angle.
 * Accuracy A node's value is the mean over the tetrahedra around it, and a place's lies between those of its nodes: right to the size of the
 *          mesh, less so at the surface and where a tool presses (docs/method.md, section 20). Half precision in the bundle makes noise in the
 *          pressure of nearly incompressible tissue.
 * Threads  palpate_scene_inside, _inside_at and _carry belong to the thread of palpate_scene_shape; any thread may call
 *          palpate_scene_locate. None of them allocates. */

/* A place of the tissue: a point of a tetrahedron. The library fills it, once; it stays valid for all scenes on the bundle. */
typedef struct palpate_inside_place {
  int32_t tetrahedron; /* 0 .. E-1; -1: none is as near as was asked                                              */
  int32_t reserved;    /* 0                                                                                       */
  double weight[4];    /* of its four nodes, that sum to 1; for a point outside of the mesh some are below 0      */
  double distance;     /* m, of the point from the tetrahedron; 0 inside                                          */
} palpate_inside_place;

/* Finds the place of each point: the tetrahedron that it lies in, or the nearest one where that is within `farthest` metres. points:
 * [count][3] m, in the organ's frame, on the shape as it was meshed; places: [count], all filled. Returns how many have no
 * tetrahedron, and -1 for a scene without inside, a NULL array, or a count or farthest below 0. A point that is not finite has none. Cost: about 4 us a point;
 * not for a loop with deadlines. */
PALPATE_API int32_t palpate_scene_locate(const palpate_scene* scene, const double* points, int32_t count,
                                         double farthest, palpate_inside_place* places);

/* The caller's arrays; each may be NULL. A row is a node or a place. */
typedef struct palpate_inside_out {
  uint32_t struct_bytes; /* sizeof(palpate_inside_out)                                                        */
  int32_t capacity;      /* in: rows of each array                                                            */
  int32_t count;         /* out: rows filled                                                                  */
  int32_t reserved;      /* 0                                                                                 */
  float* displacements;  /* default NULL; [capacity][3] m, from rest                                          */
  float* strains;        /* default NULL; [capacity][6] without unit                                          */
  float* stresses;       /* default NULL; [capacity][6] Pa                                                    */
  float* pressures;      /* default NULL; [capacity] Pa, above 0 under compression                            */
  float* von_mises;      /* default NULL; [capacity] Pa: the stress along one axis that distorts as much      */
  float* principal;      /* default NULL; [capacity][3] Pa, the principal stresses, largest first             */
} palpate_inside_out;
PALPATE_API void palpate_init_inside_out(palpate_inside_out* out, size_t struct_bytes);
static inline palpate_inside_out palpate_default_inside_out(void) {
  palpate_inside_out out;
  palpate_init_inside_out(&out, sizeof out);
  return out;
}

/* Strain and stress of a shape, kept in the scene until the next call, and filled for the nodes 0 .. N-1. shape: as
 * palpate_scene_shape filled it; this call reads its displacements and node_count, N. out may be NULL. A displacement that is not
 * finite counts as zero (BAD_INPUT). Under LARGE, a tetrahedron that the shape turns inside out has a stress without meaning
 * (UNSOLVED). A number beyond single precision becomes zero (UNSOLVED). A node where regions meet has the mean of theirs. Cost: two passes over the tetrahedra. */
PALPATE_API palpate_step_flags palpate_scene_inside(palpate_scene* scene, const palpate_shape_out* shape,
                                                    palpate_inside_out* out);
/* The same at places, of the shape of the last palpate_scene_inside (without one: BAD_INPUT). Beyond the mesh, strain and stress are those of
 * the tetrahedron, and the displacement goes on in a straight line. A place that palpate_scene_locate has not filled, or without tetrahedron, gets
 * zeros (BAD_INPUT). */
PALPATE_API palpate_step_flags palpate_scene_inside_at(palpate_scene* scene, const palpate_inside_place* places,
                                                       int32_t count, palpate_inside_out* out);

/* Carries points of the tissue along, such as the vertices of a tumour or a vessel: positions [count][3] m of places in a shape. It needs no
 * palpate_scene_inside. shape: as palpate_scene_shape filled it; this call reads its positions and node_count, N. Places as for
 * palpate_scene_inside_at: the point of one outside of the mesh moves with the nearest tetrahedron. Cost: four rows read for each place. */
PALPATE_API palpate_step_flags palpate_scene_carry(palpate_scene* scene, const palpate_shape_out* shape,
                                                   const palpate_inside_place* places, int32_t count, float* positions);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_INSIDE_H */
