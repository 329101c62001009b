/* palpate_world.h - several organs and the tools that touch them, stepped together.
 *
 * A world has organs. Each organ is a scene of palpate.h: a bundle, a pose and effects of its own. The tools are in the world's frame;
 * one call of palpate_world_touch sends them to the organs that they are near. Everything that a scene does an organ does too:
 * palpate_world_scene gives the scene of an organ, for its shape, skin, queries, its own links, report, pose and plan.
 *
 *     palpate_world_organ organs[2] = {palpate_default_world_organ(), palpate_default_world_organ()};
 *     organs[0].bundle = liver, organs[1].bundle = kidney;
 *     palpate_world_def def = palpate_default_world_def();
 *     def.organs = organs, def.organ_count = 2;
 *     palpate_world_create(&def, &world, &error);
 *     palpate_world_touch(world, tools, tool_count, dt, world_contacts, palpate_world_contacts_bytes(world));
 *     const double* force = palpate_world_contacts_tool(world_contacts, 0)->force; // N, on tool 0, of all organs together
 *     palpate_scene_shape(palpate_world_scene(world, 1), palpate_world_contacts_organ(world_contacts, 1), &shape);
 *
 * Cost     An organ that a tool is far from pays a box test for the tool: none of its points is tested. Each organ counts all points of
 *          all tools in palpate_contacts.operations, as its scene does, so that max_operations bounds taking them in, too. An organ is as
 *          costly as its scene, and no organ waits for another one.
 * Bits     A world of one organ gives the same bits as its scene. In a world of several, so does every organ that touches no other one,
 *          apart from palpate_contacts.operations, which count no tests of far tools, and from what a step that has reached
 *          max_operations puts off.
 * Memory, threads, errors and structs as palpate.h states: palpate_world_create takes all memory; palpate_world_touch,
 *          palpate_scene_set_pose and the reset, save and restore of a world belong to one thread; the shapes of the organs may run in
 *          others at the same time.
 */
#ifndef PALPATE_WORLD_H
#define PALPATE_WORLD_H

#include "palpate_pose.h"
#include "palpate_world_contacts.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct palpate_world palpate_world;

#define PALPATE_MAX_ORGANS 32

/* One organ of a world. */
typedef struct palpate_world_organ {
  uint32_t struct_bytes;        /* sizeof(palpate_world_organ)                                                      */
  int32_t reserved;             /* 0                                                                                */
  palpate_bundle* bundle;       /* several organs may stand on one bundle; it must outlive the world                */
  const palpate_scene_def* def; /* default NULL: palpate_default_scene_def()                                        */
  const palpate_pose* pose;     /* default NULL: the organ's frame is the world's                                   */
} palpate_world_organ;
PALPATE_API void palpate_init_world_organ(palpate_world_organ* organ, size_t struct_bytes);
static inline palpate_world_organ palpate_default_world_organ(void) {
  palpate_world_organ organ;
  palpate_init_world_organ(&organ, sizeof organ);
  return organ;
}

typedef struct palpate_world_def {
  uint32_t struct_bytes;             /* sizeof(palpate_world_def)                                                   */
  int32_t organ_count;               /* 1 .. PALPATE_MAX_ORGANS                                                     */
  const palpate_world_organ* organs; /* [organ_count]; palpate_world_create reads them and does not keep them       */
  double force_limit;          /* default 50   N, above 0: largest length of each tool's force, all organs together */
  double force_slew;           /* default 1e4  N/s, above 0: largest change of it; INFINITY: none             */
  double torque_limit;         /* default 5    N m, above 0: the same of each tool's torque; INFINITY: none   */
  double torque_slew;          /* default 1e3  N m/s, above 0; INFINITY: none                                 */
  palpate_allocator allocator; /* default NULL, NULL, NULL: of the world; each scene has its own              */
  double friction; /* default 0    0 .. 100: Coulomb's coefficient between organs                                    */
  int32_t
      max_pairs; /* default 0    [0 .. 1000]: organs pass through one another, and there is neither time nor memory for it; else
                    as many places at most, of all organs together, are held apart, on the bundles' own triangles, also where
                    tools meet a fine_surface. Needs collision DEFORMED of all organs. Each may have a deformation of its own,
                    and a thread of its own for palpate_scene_deform of its scene                                    */
  int32_t
      max_links; /* default 0    [0 .. 1000] links of the world (palpate_world_set_links); 0: none, and neither time nor
                    memory for them; else each organ has room to hold all of them                                          */
} palpate_world_def;
PALPATE_API void palpate_init_world_def(palpate_world_def* def, size_t struct_bytes);
static inline palpate_world_def palpate_default_world_def(void) {
  palpate_world_def def;
  palpate_init_world_def(&def, sizeof def);
  return def;
}

/* Makes a world and the scenes of its organs. max_tools and max_points of all organs must be the same. error may be NULL; its text
 * names the organ. Returns PALPATE_OK, or the reason, in which case *world is NULL. */
PALPATE_API palpate_status palpate_world_create(const palpate_world_def* def, palpate_world** world,
                                                palpate_error* error);
/* Destroys the world and the scenes of its organs. NULL is allowed. */
PALPATE_API void palpate_world_destroy(palpate_world* world);

PALPATE_API int32_t palpate_world_organ_count(const palpate_world* world);
/* The scene of organ 0 .. organ_count - 1; NULL behind the last one. It belongs to the world: palpate_scene_touch refuses it with
 * BAD_INPUT, palpate_scene_save and palpate_scene_restore with an error; do not destroy it. All other functions take it. */
PALPATE_API palpate_scene* palpate_world_scene(const palpate_world* world, int32_t organ);

/* ---- touch ---------------------------------------------------------------------------------------------------------- */

/* Bytes of a palpate_world_contacts with room for all that a step may find. */
PALPATE_API size_t palpate_world_contacts_bytes(const palpate_world* world);
/* The touch step of all organs. tools, tool_count, dt: as palpate_scene_touch takes them, in the world; grips and grasp of a tool
 * hold the organ that palpate_tool.organ names. A tool with a bad number, of whatever organ, keeps all of its last good input.
 * Always fills *contacts, which has contacts_bytes bytes and is 8-byte aligned. If contacts is NULL, not aligned or smaller than
 * palpate_world_contacts_bytes(world), the step does nothing, writes nothing and returns BAD_INPUT. Returns the flags of all organs
 * together. */
PALPATE_API palpate_step_flags palpate_world_touch(palpate_world* world, const palpate_tool* tools, int32_t tool_count,
                                                   double dt, palpate_world_contacts* contacts, size_t contacts_bytes);

/* palpate_scene_reset of all organs. */
PALPATE_API void palpate_world_reset(palpate_world* world);
/* palpate_scene_reset_tool of all organs. */
PALPATE_API void palpate_world_reset_tool(palpate_world* world, int32_t id);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_WORLD_H */
