/* palpate_needles.h - straight, stiff needles that pierce the organ.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_needles_def needles = palpate_default_needles_def(); // of a bundle with a corridor (docs/files.md)
 *     palpate_add_part(&def.parts, &needles.part);
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     palpate_needle needle = palpate_default_needle();
 *     needle.triangle = 7, needle.barycentric[0] = 1;
 *     needle.direction[2] = -1;
 *     needle.radius = 0.0005, needle.friction = 20, needle.cutting_force = 0.3, needle.puncture_force = 0.5;
 *     palpate_tool tool = palpate_default_tool();
 *     palpate_add_part(&tool.parts, &needle.part);
 *     needle.tip[2] -= 0.0001; // in each step
 *     palpate_scene_touch(scene, &tool, 1, dt, contacts, contacts_bytes);
 *     double depth = palpate_scene_needle_state(scene, 0)->depth; // m
 */
#ifndef PALPATE_NEEDLES_H
#define PALPATE_NEEDLES_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Each tool may have a needle (palpate_needle). Needs a bundle with a corridor, and displacements that are stored in f32 or as a
 * compliance in blocks. */
typedef struct palpate_needles_def {
  palpate_part part;
  int32_t needles;       /* default 1; 0: no tool has a needle, and it costs neither time nor memory      */
  int32_t needle_places; /* default 32, 2 .. 64: places of the tissue that each needle holds at most */
} palpate_needles_def;
PALPATE_API void palpate_init_needles_def(palpate_needles_def* def, size_t struct_bytes);
static inline palpate_needles_def palpate_default_needles_def(void) {
  palpate_needles_def def;
  palpate_init_needles_def(&def, sizeof def);
  return def;
}

/* A straight, stiff needle that pierces the organ. The host moves it; the tissue around the shaft follows it.
 * - It enters at a place of the surface, in the first step of the tool with this id. While its tip is in front of that place as the step
 *   deforms it, nothing happens. Then it presses the place along its direction, until the force reaches `puncture_force`.
 * - Inside, its tip pushes the tissue ahead until the force reaches `cutting_force`, and then cuts its way. What is cut stays cut for the
 *   friction of the shaft alone: a tip that was drawn back cuts again.
 * - Each `spacing` of its way it takes hold of one more place of the tissue: that place stays on the axis of the needle, and moves along
 *   it only where the force along it reaches `friction` times `spacing`. Drawn back, it lets go of the places that it has passed.
 * - The places lie in the bundle's corridor. Where the tip would leave it, or holds needle_places already, the tip stays in the tissue and
 *   its force at cutting_force, and the step is flagged NOT_TOUCHABLE or CONTACTS_DROPPED.
 * - It is out once its tip is drawn back to the place where it entered. It enters anew with another id.
 * - The forces of all places are one system with all contacts of the organ. Each place gives way by what a thin shaft of its length does in
 *   tissue that the mesh does not resolve (docs/method.md, section 21).
 * The tool gets the force and, with has_torque, the torque. */
typedef struct palpate_needle {
  palpate_part part;
  int32_t id;            /* default 0: of this piercing                                                              */
  int32_t triangle;      /* 0 .. F-1: where it enters                                                                */
  double barycentric[3]; /* weights of the triangle's vertices, 0 .. 1, that sum to 1                                */
  double tip[3];         /* m, in the world, within 1e6 m                                                            */
  double direction[3];   /* in the world, of length 1: from the handle to the tip                                    */
  double radius;         /* m, above 0 .. 0.01: of the shaft                                                         */
  double friction;       /* default 0 N/m, 0 .. 1e6: along the shaft, for its length in the tissue                   */
  double cutting_force;  /* default 0 N, 0 .. 1e6                                                                    */
  double puncture_force; /* default 0 N, 0 .. 1e6                                                                    */
  double spacing;        /* default 5e-3 m, 1e-4 .. 1: of the places that it holds                                   */
} palpate_needle;
PALPATE_API void palpate_init_needle(palpate_needle* needle, size_t struct_bytes);
static inline palpate_needle palpate_default_needle(void) {
  palpate_needle needle;
  palpate_init_needle(&needle, sizeof needle);
  return needle;
}

typedef enum palpate_needle_condition {
  PALPATE_NEEDLE_NONE = 0,    /* the tool has no needle                                                             */
  PALPATE_NEEDLE_OUTSIDE = 1, /* it does not touch the tissue: before it enters, or after it came out               */
  PALPATE_NEEDLE_PRESSES = 2, /* its tip presses the surface and has not pierced it                                 */
  PALPATE_NEEDLE_INSIDE = 3,  /* it is in the tissue, and its tip does not cut                                      */
  PALPATE_NEEDLE_CUTS = 4,    /* its tip cut in this step                                                           */
  PALPATE_NEEDLE_STUCK = 5    /* its tip would cut where it may not: outside of the corridor, or without a place left */
} palpate_needle_condition;

/* The needle of one tool after a touch step; the library fills it. In the world, forces on the tool, before Q, relaxation and limits. */
typedef struct palpate_needle_state {
  palpate_needle_condition condition; /* in this step                                                               */
  int32_t places;                     /* of the tissue that it holds, without the tip                               */
  int32_t slipping;                   /* of these, places along which it slid in this step                          */
  int32_t reserved;                   /* 0                                                                          */
  double force[3];                    /* N, of the needle alone                                                     */
  double torque[3];                   /* N m, the same about the tool's reference                                   */
  double tip_force;                   /* N, 0 or more: what the tissue ahead of the tip resists                     */
  double shaft_force;    /* N, along the shaft: above 0 where friction holds the needle back from advancing */
  double depth;          /* m: the way of the tip in the tissue at rest, from where it entered         */
  double tip_at_rest[3]; /* m, in the organ's frame: the tissue at the tip, where it is at rest        */
} palpate_needle_state;

/* Of the tool with that id, inside the scene and valid until the next step; NULL where no tool has the id, or no tool may have a needle.
 * Call it in the thread of palpate_scene_touch. */
PALPATE_API const palpate_needle_state* palpate_scene_needle_state(const palpate_scene* scene, int32_t id);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_NEEDLES_H */
