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
 *     palpate_world_touch(world, tools, tool_count, dt, contacts, palpate_world_contacts_bytes(world));
 *     palpate_world_contacts_tool(contacts, 0)->force                         the force on tool 0, of all organs together
 *     palpate_scene_shape(palpate_world_scene(world, 1), palpate_world_contacts_organ(contacts, 1), &out);
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

#include "palpate.h"

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
                    as many places at most, of all organs together, are held apart. Needs collision DEFORMED and deformation
                    LINEAR of all organs, and no fine_surface                                                        */
  int32_t
      max_links; /* default 0    [0 .. 1000] links of the world (palpate_world_set_links); 0: none, and neither time nor
                    memory for them; else each organ has room to hold all of them. Needs deformation LINEAR of all organs */
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

/* The passes of all organs in order, those of organ 0 first, and behind them those of the world itself; NULL behind the last one.
 * *organ: whose pass it is, -1 for one of the world; may be NULL. What a step costs is the sum. */
PALPATE_API const palpate_plan_pass* palpate_world_plan(const palpate_world* world, int32_t pass, int32_t* organ);
/* palpate_predict_pass of a pass of palpate_world_plan. load: of the organ whose pass it is, without rows, sweeps and Newton steps where
 * its contacts are solved together with those of others. For a pass of the world: contacts are the pairs, slips those of them that press and
 * slip, nodes those of all organs that have a force, rows those of pairs that press, once, and of all other contacts; all else is that of
 * all organs together, sweeps and Newton steps of the joint systems. */
PALPATE_API palpate_pass_work palpate_world_predict_pass(const palpate_world* world, int32_t pass,
                                                         const palpate_step_load* load);
/* palpate_watch_passes of all organs and the world; pass: the index in palpate_world_plan. */
PALPATE_API void palpate_world_watch_passes(palpate_world* world, palpate_pass_watcher watcher, void* user);

/* Organs that touch (max_pairs above 0): the vertices of each organ may not pass through the surface of another one. They press without pulling, with friction where there is some, and all contacts of organs that touch, those of tools too,
 * are solved as one system.
 * - Where organs overlap as they stand when the world is created, as organs of one image do by a voxel or two, the overlap counts as
 *   touching until they part there. The log of the organ's bundle tells it, and so does palpate_world_pair.overlap.
 * - A vertex without a tensor column (a fixed one) presses the other organ like a rigid body. It may sink in by 5 % of what its own force
 *   presses, and by more near the other organ's fixed part. Where fixed parts of both organs come into one another by more than a quarter
 *   of an edge, there is no force, and the step says so (NOT_TOUCHABLE).
 * - More vertices than max_pairs that are near: those that are farther away are not held (CONTACTS_DROPPED).
 * - Links and grasps of a scene hold their organ as in a scene; their rows are part of the one system. Motions move it as in a scene, and volumes
 *   that are held are followed.
 * - The contact nodes of pairs have the source ORGAN in the palpate_contacts of both organs.
 * - The search for pairs, their rows and the one system come on top of palpate_scene_most_operations(). */

/* ---- links between organs ------------------------------------------------------------------------------------------- */

/* A link of palpate.h whose ends are on two organs, on one, or on one and at a point of the world: a suture or a ligament from organ to
 * organ. Fields without a comment are those of palpate_link. */
typedef struct palpate_world_link {
  uint32_t struct_bytes; /* sizeof(palpate_world_link)                                                               */
  palpate_link_kind kind;
  int32_t id;       /* 0 or more, another one for each link of the world; default -1: its index in the list  */
  int32_t runs_on;  /* a thread may run on from organ to organ                                               */
  int32_t organ[2]; /* default -1, -1: of each end that is a SURFACE_POINT the organ, 0 .. organ_count - 1; of an
                               end at a point of the WORLD it is not read                                            */
  palpate_link_end ends[2]; /* at least one of them is a SURFACE_POINT                                               */
  double rest_length;       /* m    */
  double stiffness;         /* N/m  */
  double breaking_force;    /* N    */
  double radius;            /* m; above 0 it needs contact PATCH of each organ that the link holds                   */
} palpate_world_link;
PALPATE_API void palpate_init_world_link(palpate_world_link* link, size_t struct_bytes);
static inline palpate_world_link palpate_default_world_link(void) {
  palpate_world_link link;
  palpate_init_world_link(&link, sizeof link);
  return link;
}

/* Gives the world its links, in place of those that it had, as palpate_scene_set_links gives a scene its own: links: [count], count
 * 0 .. max_links; the call copies them; a link is known by its id, and keeps its state where kind, organs and ends are the same.
 * - The organs that a link with a force joins are solved as one system, those of tools and pairs included, whether they touch or not.
 * - Each organ has its pose: the line between the ends is that in the world, and turns with the poses and the tissue.
 * - A link that breaks raises LINK_BROKE in the flags of the world's step, not in those of an organ. Its organs' reports tell nothing of it.
 * - The contact nodes of these links have the source WORLD_LINK in the palpate_contacts of their organ.
 * Refused with PALPATE_ERROR_ARGUMENT, and the world keeps its links: what palpate_scene_set_links refuses; an organ that the world does
 * not have. error may be NULL. Never allocates or locks. Call it in the thread of palpate_world_touch.
 * Cost     A link with a force is one row of the joint system (a clip three). Each link, a slack one too, costs a step 9 multiply-adds for
 *          each of its nodes and each contact node of the organ. All this comes on top of palpate_scene_most_operations(). */
PALPATE_API palpate_status palpate_world_set_links(palpate_world* world, const palpate_world_link* links, int32_t count,
                                                   palpate_error* error);
/* The state of link 0 .. count - 1 of the list, inside the world and valid until the next step; NULL behind the last one. Places and
 * forces are in the world; broken counts the steps of the world. Call it in the thread of palpate_world_touch. */
PALPATE_API const palpate_link_state* palpate_world_link_state(const palpate_world* world, int32_t link);

/* ---- touch ---------------------------------------------------------------------------------------------------------- */

/* What a step found out about one tool, in the world. */
typedef struct palpate_world_tool_state {
  double force[3]; /* N, on the tool, of all organs together, within force_limit and force_slew: send it to a device */
  double force_raw[3];   /* N, the sum of the organs' force_raw (palpate_tool_state)                                */
  double torque[3];      /* N m, about the tool's reference, within torque_limit and torque_slew                    */
  double torque_raw[3];  /* N m, the sum of the organs' torque_raw                                                  */
  int32_t id;            /* of the tool; its index where the host gave none                                         */
  int32_t organ_count;   /* organs that the tool is in contact with                                                 */
  int32_t contact_count; /* the sum of the organs'                                                                  */
  int32_t slip_count;    /* the same                                                                                */
  int32_t release_count; /* the same                                                                                */
  uint32_t flags;        /* the step flags that concern this tool, of all organs                                    */
} palpate_world_tool_state;

/* What a step found out about one organ, in the world. */
typedef struct palpate_world_organ_state {
  uint64_t contacts_offset; /* of its palpate_contacts, from the begin of the head                                  */
  uint32_t flags;           /* of its step                                                                          */
  int32_t near_tools;       /* tools that were not far from it                                                      */
  double force[3];          /* N, in the world, on the organ, by all tools: the sum of its nodes' forces            */
  double torque[3]; /* N m, in the world, of these forces at the rest places, about the origin of the organ's frame;
                               zero in a scene that has no positions (contact NODE without collision)               */
  double
      pressed[3]; /* N, in the world, on the organ, by all other organs that it touches, without the forces of links */
} palpate_world_organ_state;

/* A place where two organs touch or may touch: a vertex of one and a place on the other. */
typedef struct palpate_world_pair {
  int32_t organ[2];      /* of the vertex; of the place                                                             */
  int32_t node;          /* of organ[0]                                                                             */
  int32_t triangle;      /* of organ[1]                                                                             */
  double barycentric[3]; /* weights of the triangle's vertices                                                      */
  double place[3];       /* m, in the world: where the place on organ[1] rests                                      */
  double normal[3];      /* unit, in the world: outward from organ[1]                                               */
  double force[3];       /* N, in the world, on organ[0]; organ[1] has the opposite. Zero where they do not touch   */
  double pressure; /* Pa: the force along the normal over the vertex's share of its organ's surface; where vertices of
                            both organs press, each pair has a part of the pressure                                  */
  double gap;      /* m: between the two along the normal after this step; 0 where they press, but for rounding */
  double overlap;  /* m, by which the organs overlap there where they rest, and which counts as touching      */
} palpate_world_pair;

/* The result of a touch step: plain data without pointers, as palpate_contacts is. In memory the head is followed by tool_count
 * palpate_world_tool_state, organ_count palpate_world_organ_state and the palpate_contacts of each organ. Find them with the
 * functions below. Copy used_bytes of it through a socket; through a palpate_mailbox of palpate_world_contacts_bytes with a cast. */
typedef struct palpate_world_contacts {
  uint32_t struct_bytes;      /* of this head; the tool states begin behind it                                      */
  uint32_t flags;             /* of all organs and the world, as palpate_world_touch returned them                  */
  uint64_t used_bytes;        /* of the head and all that follows it                                                */
  uint64_t step;              /* touch steps since creation or reset: 1, 2, ...                                     */
  int32_t tool_count;         /* tools of this step                                                                 */
  int32_t organ_count;        /* organs of the world                                                                */
  uint32_t tool_state_bytes;  /* from one tool state to the next                                                    */
  uint32_t organs_offset;     /* of the first organ state, from the begin of the head                               */
  uint32_t organ_state_bytes; /* from one organ state to the next                                                   */
  uint32_t pair_bytes;        /* from one pair to the next                                                          */
  uint64_t pairs_offset;      /* of the first pair, from the begin of the head                                      */
  int32_t pair_count;         /* pairs that the step held, those without a force too                                */
  int32_t pair_sweeps;        /* of projected Gauss-Seidel and Newton's method, that the joint systems took         */
} palpate_world_contacts;

/* Bytes of a palpate_world_contacts with room for all that a step may find. */
PALPATE_API size_t palpate_world_contacts_bytes(const palpate_world* world);
/* The state of tool 0 .. tool_count - 1, inside *contacts. */
static inline const palpate_world_tool_state* palpate_world_contacts_tool(const palpate_world_contacts* contacts,
                                                                          int32_t tool) {
  return (const palpate_world_tool_state*)(const void*)((const char*)contacts + contacts->struct_bytes +
                                                        (size_t)tool * contacts->tool_state_bytes);
}
/* The state of organ 0 .. organ_count - 1, inside *contacts. */
static inline const palpate_world_organ_state* palpate_world_contacts_state(const palpate_world_contacts* contacts,
                                                                            int32_t organ) {
  return (const palpate_world_organ_state*)(const void*)((const char*)contacts + contacts->organs_offset +
                                                         (size_t)organ * contacts->organ_state_bytes);
}
/* What the step of organ 0 .. organ_count - 1 found, inside *contacts: for palpate_scene_shape and the queries of that organ. */
static inline const palpate_contacts* palpate_world_contacts_organ(const palpate_world_contacts* contacts,
                                                                   int32_t organ) {
  return (const palpate_contacts*)(const void*)((const char*)contacts +
                                                palpate_world_contacts_state(contacts, organ)->contacts_offset);
}

/* Pair 0 .. pair_count - 1, inside *contacts. */
static inline const palpate_world_pair* palpate_world_contacts_pair(const palpate_world_contacts* contacts,
                                                                    int32_t pair) {
  return (const palpate_world_pair*)(const void*)((const char*)contacts + contacts->pairs_offset +
                                                  (size_t)pair * contacts->pair_bytes);
}

/* The touch step of all organs. tools, tool_count, dt: as palpate_scene_touch takes them, in the world; grips and grasp of a tool
 * hold the organ that palpate_tool.organ names. A tool with a bad number, of whatever organ, keeps all of its last good input.
 * Always fills *contacts, which has contacts_bytes bytes and is 8-byte aligned. If contacts is NULL, not aligned or smaller than
 * palpate_world_contacts_bytes(world), the step does nothing, writes nothing and returns BAD_INPUT. Returns the flags of all organs
 * together. */
PALPATE_API palpate_step_flags palpate_world_touch(palpate_world* world, const palpate_tool* tools, int32_t tool_count,
                                                   double dt, palpate_world_contacts* contacts, size_t contacts_bytes);

/* ---- reset and state ------------------------------------------------------------------------------------------------ */

/* palpate_scene_reset of all organs. */
PALPATE_API void palpate_world_reset(palpate_world* world);
/* palpate_scene_reset_tool of all organs. */
PALPATE_API void palpate_world_reset_tool(palpate_world* world, int32_t id);

/* What the touch steps have left in a world, as palpate_scene_save states it for a scene. */
PALPATE_API size_t palpate_world_state_bytes(const palpate_world* world);
PALPATE_API palpate_status palpate_world_save(const palpate_world* world, void* state, size_t state_bytes,
                                              palpate_error* error);
/* A state that is refused leaves all organs as they were. */
PALPATE_API palpate_status palpate_world_restore(palpate_world* world, const void* state, size_t state_bytes,
                                                 palpate_error* error);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_WORLD_H */
