/* palpate_motions.h - supports that move, pressure on a piece of the surface, gravity.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_motions_def motions = palpate_default_motions_def();
 *     palpate_add_part(&def.parts, &motions.part);
 *     def.collision = PALPATE_COLLISION_DEFORMED;
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     palpate_motion_info breath; // names and units: of motion 0
 *     palpate_bundle_motion(bundle, 0, &breath, sizeof breath, &error);
 *     for (double t = 0; t < 4; t += dt) {
 *       double amounts[1] = {0.01 * sin(t)}; // m, of a bundle with one motion
 *       palpate_scene_set_motions(scene, amounts, 1, &error);
 *       palpate_scene_touch(scene, tools, tool_count, dt, contacts, contacts_bytes);
 *     }
 *
 * docs/method.md, section 19, has the method; docs/files.md says how a bundle gets motions.
 */
#ifndef PALPATE_MOTIONS_H
#define PALPATE_MOTIONS_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The bundle's motions move the organ (palpate_scene_set_motions). Needs collision OFF or DEFORMED. Under large deformation a
 * pressure follows the surface: it acts along the present normals on the present areas. */
typedef struct palpate_motions_def {
  palpate_part part;
  int32_t motions;  /* default 1; 0: supports stand, nothing presses, and it costs neither time nor memory */
  int32_t reserved; /* 0                                                                                   */
} palpate_motions_def;
PALPATE_API void palpate_init_motions_def(palpate_motions_def* def, size_t struct_bytes);
static inline palpate_motions_def palpate_default_motions_def(void) {
  palpate_motions_def def;
  palpate_init_motions_def(&def, sizeof def);
  return def;
}

/* What a unit of a motion is. */
typedef enum palpate_motion_kind {
  PALPATE_MOTION_PISTON = 1,   /* supports move by 1 m along an axis                                                */
  PALPATE_MOTION_ROTATION = 2, /* supports turn by 1 rad about an axis, linearly: right for small angles            */
  PALPATE_MOTION_FIELD = 3,    /* supports move once as a file said                                                 */
  PALPATE_MOTION_PRESSURE = 4, /* 1 Pa on a piece of the surface, or in a cavity                                    */
  PALPATE_MOTION_GRAVITY = 5   /* 1 m/s^2 along x, y or z of the organ's frame                                      */
} palpate_motion_kind;
#define PALPATE_MAX_MOTIONS 32

/* One motion of a bundle; the library fills it. */
typedef struct palpate_motion_info {
  palpate_motion_kind kind; /* what its unit is                                                                     */
  int32_t reserved;         /* 0                                                                                    */
  char name[64];            /* as the boundary file has it; ends with a zero                                        */
} palpate_motion_info;
/* Fills *info for motion 0 .. motion_count - 1 (palpate_bundle_info). The first call maps or copies sections of a file: do not call
 * it in a step. error may be NULL. */
PALPATE_API palpate_status palpate_bundle_motion(const palpate_bundle* bundle, int32_t motion,
                                                 palpate_motion_info* info, size_t struct_bytes, palpate_error* error);

/* Says by how much each motion of the bundle moves the organ, from the next touch step on: amounts [count], count the bundle's
 * motion_count, in the units of palpate_motion_kind. At first all are 0. The organ is at the same amounts until the next call, so a
 * host that breathes calls this in every touch step.
 * - The first step, and the first one after palpate_scene_reset, takes the amounts at once. In later steps no node moves faster than
 *   max_tool_speed by a change of amounts: what is more waits for the next steps (MOTION_LIMITED).
 * - Contacts hold places that move: a tool at rest is met and pressed by an organ that moves against it. Contacts and grasps
 *   hold d - B q in place of d, B q the displacement by the motions (docs/method.md, section 19).
 * - The amounts of a step travel in its palpate_contacts, so that shape and queries show the organ at the same ones.
 * - Under large deformation supports stand where the amounts bring them, gravity is a load along its axis, and the body finds its balance.
 * Refused with PALPATE_ERROR_ARGUMENT, and the scene keeps its amounts: another count, a number that is not finite, amounts that may
 * move a node by more than 1e6 m, under large deformation a pressure other than 0 of a bundle without motion/pressed. error may be NULL. Never allocates or locks. Call it in the thread of palpate_scene_touch. */
PALPATE_API palpate_status palpate_scene_set_motions(palpate_scene* scene, const double* amounts, int32_t count,
                                                     palpate_error* error);

/* For a motion of kind PRESSURE: holds 1: its surface sweeps `volume` (m^3, away from where the pressure acts; of a cavity, by how much
 * it grows), and the pressure is what that takes, whatever palpate_scene_set_motions says; so a host pumps, or closes a valve at the volume that
 * palpate_scene_motion_state tells. holds 0: the pressure is given again, at first the last one. A step in which one begins or ceases
 * to be held computes its contacts anew. Under large deformation the volume is met within 1 % of what the surface's triangles sweep, or the step is
 * flagged (DEFORMATION_BEHIND); it needs motion/pressed of the bundle. A scene with cut ON refuses it. error may be NULL. Never allocates or locks. Call it in the thread of palpate_scene_touch. */
PALPATE_API palpate_status palpate_scene_hold_volume(palpate_scene* scene, int32_t motion, int32_t holds, double volume,
                                                     palpate_error* error);

/* One motion after a touch step; the library fills it. */
typedef struct palpate_motion_state {
  double amount; /* in this step: as set, or as far as MOTION_LIMITED let it come; of a held volume the pressure, Pa */
  double volume; /* m^3: of a pressure, what its surface has swept, under contacts too; else, and with cut ON, 0. Under
                  * large deformation what it has swept on its way, which counts where the surface's rim moves         */
} palpate_motion_state;
/* Of motion 0 .. motion_count - 1, inside the scene and valid until the next step; NULL behind the last one, and for a scene without
 * motions. Call it in the thread of palpate_scene_touch. */
PALPATE_API const palpate_motion_state* palpate_scene_motion_state(const palpate_scene* scene, int32_t motion);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_MOTIONS_H */
