/* palpate_grasps.h - jaws that hold tissue.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_grasps_def grasps = palpate_default_grasps_def();
 *     palpate_add_part(&def.parts, &grasps.part);
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     palpate_grasp jaws = palpate_default_grasp();
 *     jaws.triangle = 7, jaws.barycentric[0] = 1;
 *     jaws.radius = 0.003; // m
 *     palpate_tool forceps = palpate_default_tool();
 *     palpate_add_part(&forceps.parts, &jaws.part);
 *     palpate_scene_touch(scene, &forceps, 1, dt, contacts, contacts_bytes); // they close
 *     jaws.position[2] += 0.001;
 *     palpate_scene_touch(scene, &forceps, 1, dt, contacts, contacts_bytes); // they draw the tissue along
 *     int slips = palpate_scene_grasp_state(scene, 0)->condition == PALPATE_GRASP_SLIPS;
 */
#ifndef PALPATE_GRASPS_H
#define PALPATE_GRASPS_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Each tool may grasp (palpate_grasp). Needs contact PATCH. */
typedef struct palpate_grasps_def {
  palpate_part part;
  int32_t grasps;   /* default 1; 0: no tool grasps, and there is no memory for it */
  int32_t reserved; /* 0                                                          */
} palpate_grasps_def;
PALPATE_API void palpate_init_grasps_def(palpate_grasps_def* def, size_t struct_bytes);
static inline palpate_grasps_def palpate_default_grasps_def(void) {
  palpate_grasps_def def;
  palpate_init_grasps_def(&def, sizeof def);
  return def;
}

/* Jaws that hold tissue: the surface below one disc, or below two discs that face each other across a fold, follows the rigid motion of the
 * tool since the jaws closed, in all six degrees of freedom. The tool gets the force and, with has_torque, the torque.
 * - The grasp closes in the first step that has it, and anew where the id changes: with no force of its own, wherever the tissue then is.
 *   Jaws that close anew while they hold tissue let it go in that step, without a force, and take hold of it in the next one.
 *   It opens in the first step of the tool without it.
 * - Beyond its friction it slips: the tissue stays behind so far that the force is friction times what presses the jaws on the tissue
 *   (the force along the jaws, between two discs from both sides). Once it has slipped by more than `radius` it lets go, until it closes anew.
 * - Its nodes count towards max_contact_nodes, each three times: at most 192 for each disc, and no more than 96 where
 *   max_contact_nodes leaves no room for more beside 8 for each of max_points and 192 for each of max_tools.
 * - A grasp needs a scene with a palpate_grasps_def (else: bad input). */
typedef struct palpate_grasp {
  palpate_part part;
  int32_t id;                     /* default 0: of this closing                                                     */
  int32_t triangle;               /* 0 .. F-1: where the first disc's middle is                                     */
  int32_t opposite_triangle;      /* default -1: one disc; 0 .. F-1: where the second one's middle is               */
  int32_t reserved;               /* 0                                                                              */
  double barycentric[3];          /* weights of the triangle's vertices, 0 .. 1, that sum to 1                      */
  double opposite_barycentric[3]; /* the same of the opposite triangle                                              */
  double position[3];             /* m, of the tool in the world, within 1e6 m                                      */
  double orientation[4];          /* default 1 0 0 0: of the tool, a quaternion w x y z of length 1                 */
  double radius;                  /* m, above 0 .. 1: of each disc                                                  */
  double closing;     /* default 0 m: by how much the discs have come nearer since the jaws closed; 0 .. 1 */
  double friction;    /* default INFINITY: it never slips; 0 or more                                    */
  double clamp_force; /* default INFINITY; N, 0 or more: what presses the jaws on the tissue of one disc. Two discs have
                         the force between them in its place                                                        */
} palpate_grasp;
PALPATE_API void palpate_init_grasp(palpate_grasp* grasp, size_t struct_bytes);
static inline palpate_grasp palpate_default_grasp(void) {
  palpate_grasp grasp;
  palpate_init_grasp(&grasp, sizeof grasp);
  return grasp;
}

typedef enum palpate_grasp_condition {
  PALPATE_GRASP_OPEN = 0,  /* the tool has no grasp                                                                 */
  PALPATE_GRASP_HOLDS = 1, /* the tissue follows the jaws                                                           */
  PALPATE_GRASP_SLIPS = 2, /* it slipped in this step                                                               */
  PALPATE_GRASP_LET_GO = 3 /* it has slipped by more than its radius: no force until it closes anew                 */
} palpate_grasp_condition;

/* The grasp of one tool after a touch step; the library fills it. In the world. */
typedef struct palpate_grasp_state {
  palpate_grasp_condition condition; /* in this step                                                                */
  int32_t reserved;                  /* 0                                                                           */
  double force[3];                   /* N, on the tool, of the grasp alone, before Q, relaxation and limits         */
  double torque[3];                  /* N m, the same about the tool's reference                                    */
  double place[3];                   /* m: where the first disc's middle is held                                    */
  double slipped;                    /* m: by how much the tissue has stayed behind                                 */
  double friction_limit;             /* N: beyond which it slips; INFINITY: never                                   */
} palpate_grasp_state;

/* Of the tool with that id, inside the scene and valid until the next step; NULL where no tool has the id, or no tool may grasp. Call it
 * in the thread of palpate_scene_touch. */
PALPATE_API const palpate_grasp_state* palpate_scene_grasp_state(const palpate_scene* scene, int32_t id);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_GRASPS_H */
