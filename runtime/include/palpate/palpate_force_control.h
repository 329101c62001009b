/* palpate_force_control.h - tools that press with a force that the host gives; the step tells where they stand.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_force_control_def control = palpate_default_force_control_def();
 *     palpate_add_part(&def.parts, &control.part);
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     palpate_given_force push = palpate_default_given_force();
 *     push.force[2] = -0.5; // N, downwards in the world
 *     double point[3] = {0.03, 0.025, 0.041}; // m: where the tool starts
 *     palpate_tool probe = palpate_default_tool();
 *     probe.points = point, probe.point_count = 1;
 *     palpate_add_part(&probe.parts, &push.part);
 *     palpate_scene_touch(scene, &probe, 1, dt, contacts, contacts_bytes);
 *     double sunk = palpate_scene_given_force_state(scene, 0)->displacement[2]; // m
 *
 * docs/method.md, section 22, has the method.
 */
#ifndef PALPATE_FORCE_CONTROL_H
#define PALPATE_FORCE_CONTROL_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A tool of the scene may have a force in place of a position (palpate_given_force). */
typedef struct palpate_force_control_def {
  palpate_part part;
  int32_t force_control; /* default 1; 0: no tool has one, and there is no memory for it */
  int32_t reserved;      /* 0                                                            */
} palpate_force_control_def;
PALPATE_API void palpate_init_force_control_def(palpate_force_control_def* def, size_t struct_bytes);
static inline palpate_force_control_def palpate_default_force_control_def(void) {
  palpate_force_control_def def;
  palpate_init_force_control_def(&def, sizeof def);
  return def;
}

/* The force with which a tool presses the organ. The step moves the tool as a whole, points, grips and reference, until what it presses
 * gives this force; how far it stands from where the host sends it is in palpate_given_force_state. It keeps that from step to step, and
 * forgets it in a step without this part.
 * - A tool that touches nothing goes along its force, by speed times dt in each step. In contact it moves by no more than that either:
 *   what is more waits for the next steps (PALPATE_GIVEN_FORCE_MOVES, MOTION_LIMITED).
 * - Contacts carry what their law allows. A contact without friction carries no force along the surface, one with friction no more than that
 *   times the force across it: the tool then stands still along the surface, with the part of the force that is carried
 *   (PALPATE_GIVEN_FORCE_PART). Nothing is carried by grips along axes that they do not hold.
 * - It is the elastic force on the tissue, before Q and relaxation, which change what the tool feels.
 * - The points that the host sends may move; the tool moves with them.
 * - A tool with a force has no grasp and no needle, and in a world it touches the organ that it names alone. It needs a scene with a
 *   palpate_force_control_def (else: bad input). */
typedef struct palpate_given_force {
  palpate_part part;
  double force[3]; /* default 0: N, of the tool on the organ, in the world, within 1e6 N                              */
  double speed;    /* default 0.25 m/s, above 0: how fast it goes there; no more than max_tool_speed acts             */
} palpate_given_force;
PALPATE_API void palpate_init_given_force(palpate_given_force* force, size_t struct_bytes);
static inline palpate_given_force palpate_default_given_force(void) {
  palpate_given_force force;
  palpate_init_given_force(&force, sizeof force);
  return force;
}

typedef enum palpate_given_force_condition {
  PALPATE_GIVEN_FORCE_FREE = 0,    /* the tool touches nothing, and goes along its force                            */
  PALPATE_GIVEN_FORCE_CARRIED = 1, /* the organ carries the force                                                    */
  PALPATE_GIVEN_FORCE_PART = 2,    /* it carries a part of it: nothing holds the tool along the rest                 */
  PALPATE_GIVEN_FORCE_MOVES = 3    /* the tool is on its way, as fast as it may                                      */
} palpate_given_force_condition;

/* One tool with a force after a touch step; the library fills it. In the world. */
typedef struct palpate_given_force_state {
  palpate_given_force_condition condition;
  int32_t reserved;       /* 0                                                                                  */
  double displacement[3]; /* m: of the tool from where the host sends it                                        */
  double force[3];        /* N, of the tool on the organ, before Q and relaxation                               */
  double missed[3];       /* N: the force that was given, less that                                             */
} palpate_given_force_state;

/* Of the tool with that id, inside the scene and valid until the next step; NULL where no tool has the id, or no tool of the scene may have
 * a force. Of a tool without one all is zero. Call it in the thread of palpate_scene_touch. */
PALPATE_API const palpate_given_force_state* palpate_scene_given_force_state(const palpate_scene* scene, int32_t id);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_FORCE_CONTROL_H */
