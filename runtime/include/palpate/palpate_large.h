/* palpate_large.h - large deformation that is solved beside the touch.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_large_def large = palpate_default_large_def(); // of a bundle that was made for it
 *     large.deformation = PALPATE_DEFORMATION_LARGE_BESIDE;
 *     palpate_add_part(&def.parts, &large.part);
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     // in a thread of its own:
 *     while (runs)
 *       if (palpate_scene_deform(scene) == 0) sleep_a_millisecond();
 *
 * Under PALPATE_DEFORMATION_LARGE the touch step solves the body itself, and a host calls nothing of this header.
 *
 * What palpate_contacts tells of the body (BESIDE and RENEWED: of its newest solution): body_steps, the quasi-Newton steps; body_residual,
 * square root of the share of its energy that it had still to lose before the last of them, as the method estimates it, where 0.5 stands
 * for 0.5 and more: above it the step was undone, and the body and its forces are those of the step before; least_volume. The displacements
 * behind field_offset are all of the surface's under LARGE; under the others they add to the superposition of the contact nodes.
 */
#ifndef PALPATE_LARGE_H
#define PALPATE_LARGE_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How the organ deforms. */
typedef enum palpate_deformation_model {
  PALPATE_DEFORMATION_LINEAR, /* by superposition of the tensors: right for small displacements                    */
  PALPATE_DEFORMATION_LARGE, /* as the hyperelastic body that its mesh and laws make: forces and shape are right at any depth,
                                 and a step takes longer (docs/method.md, section 14). The bundle must have been made for it
                                 (palpate-precompute --large-deformation). RESPONSE is refused beside it: it corrects a
                                 linear answer. Where a slender part begins to buckle, the body may stay for some steps in
                                 a balance that has become unstable: PALPATE_STEP_DEFORMATION_BEHIND tells this          */
  PALPATE_DEFORMATION_LARGE_BESIDE, /* the same body, solved by palpate_scene_deform in a thread of its own. The touch step takes
                                 the newest solution and goes on from it by superposition, as fast as LINEAR: for bodies that
                                 are too large to be solved in each step                                                  */
  PALPATE_DEFORMATION_LARGE_RENEWED, /* LARGE_BESIDE for slender parts and nearly incompressible tissue (Poisson's ratio above 0.495): while
                                 it solves, palpate_scene_deform also makes a new metric of the solver from the body as it is, a 16th of it in
                                 each call. Takes five times the memory of the factor, and more time in the third thread */
  PALPATE_DEFORMATION_LARGE_AUTO /* LARGE where max_operations has 500 for each node of the bundle (600 nodes at the default), else
                                 LARGE_BESIDE; the scene's log says which. The host calls palpate_scene_deform in either case        */
} palpate_deformation_model;
typedef struct palpate_large_def {
  palpate_part part;
  palpate_deformation_model deformation; /* default LARGE */
  int32_t reserved;                      /* 0             */
} palpate_large_def;
PALPATE_API void palpate_init_large_def(palpate_large_def* def, size_t struct_bytes);
static inline palpate_large_def palpate_default_large_def(void) {
  palpate_large_def def;
  palpate_init_large_def(&def, sizeof def);
  return def;
}

/* LARGE_BESIDE, LARGE_RENEWED: solves the body under the contacts of the newest touch step, eight quasi-Newton steps at most, and hands the solution
 * to the touch steps that follow. Call it in a loop in a third thread, beside those of touch and shape; neither waits for the
 * other. A host without a third thread may call it between touch steps. Returns the evaluations of the energy that it took: 0 where
 * there was nothing to do, so that the thread may sleep for a millisecond; -1 for a scene that solves no body beside the touch, so that the
 * thread may end.
 * Never allocates or locks. Cost: docs/method.md, section 14. While it runs, palpate_scene_save and palpate_scene_restore must not be
 * called for the scene, nor palpate_scene_destroy. */
PALPATE_API int32_t palpate_scene_deform(palpate_scene* scene);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_LARGE_H */
