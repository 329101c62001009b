/* palpate_obstacles.h - rigid surfaces that the organ does not enter: tables, ribs, plates that the host moves.
 *
 *     palpate_obstacle table = palpate_default_obstacle();
 *     table.kind = PALPATE_OBSTACLE_RECTANGLE;
 *     table.size[0] = table.size[1] = 0.3; // m
 *     table.position[2] = -0.01, table.friction = 0.3; // its upper side looks along z
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_obstacles_def obstacles = palpate_default_obstacles_def();
 *     obstacles.count = 1, obstacles.list = &table;
 *     palpate_add_part(&def.parts, &obstacles.part);
 *     def.collision = PALPATE_COLLISION_DEFORMED;
 *     palpate_scene_create(bundle, &def, &scene, &error);
 *     palpate_scene_touch(scene, tools, tool_count, dt, contacts, contacts_bytes);
 *     double borne = palpate_scene_obstacle_state(scene, 0)->force[2]; // N
 *
 * docs/method.md, section 23, has the method.
 */
#ifndef PALPATE_OBSTACLES_H
#define PALPATE_OBSTACLES_H

#include "palpate.h"
#include "palpate_pose.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum palpate_obstacle_kind {
  PALPATE_OBSTACLE_UNSAID = 0,    /* refused: an obstacle must say what it is                                       */
  PALPATE_OBSTACLE_RECTANGLE = 1, /* about the origin of its frame, across z; the organ is on the side of z         */
  PALPATE_OBSTACLE_DISC = 2,      /* the same; its edge has 48 corners                                              */
  PALPATE_OBSTACLE_MESH = 3       /* triangles; the organ is on their outer side                                    */
} palpate_obstacle_kind;

/* One rigid surface. */
typedef struct palpate_obstacle {
  uint32_t struct_bytes;      /* sizeof(palpate_obstacle)                                                           */
  palpate_obstacle_kind kind; /* default UNSAID                                                                     */
  double size[2];     /* m, above 0 .. 1e3: of a RECTANGLE the lengths along x and y; of a DISC the radius, size[0]  */
  double friction;    /* default 0, 0 or more: the largest tangential force over the normal force           */
  double depth;       /* default 0.01 m, above 0 .. 1e3: a node that is farther inside is not held          */
  double position[3]; /* default 0 m, in the world, within 1e6 m: of its frame, when the scene begins       */
  double orientation[4];    /* default 1 0 0 0: quaternion w x y z of length 1                                    */
  const float* positions;   /* [vertex_count][3] m, of a MESH, in its frame                                       */
  const int32_t* triangles; /* [triangle_count][3] vertices, counter-clockwise from outside; each edge in one or two */
  int32_t vertex_count;     /* 3 .. 1 million                                                                     */
  int32_t triangle_count;   /* 1 .. 2 million                                                                     */
} palpate_obstacle;
PALPATE_API void palpate_init_obstacle(palpate_obstacle* obstacle, size_t struct_bytes);
static inline palpate_obstacle palpate_default_obstacle(void) {
  palpate_obstacle obstacle;
  palpate_init_obstacle(&obstacle, sizeof obstacle);
  return obstacle;
}

/* The obstacles of a scene. Creating the scene copies them. Needs collision DEFORMED. */
#define PALPATE_MAX_OBSTACLES 16
typedef struct palpate_obstacles_def {
  palpate_part part;
  int32_t count;                /* default 0: none; to PALPATE_MAX_OBSTACLES                                        */
  int32_t max_nodes;            /* default 256 [1 .. 2048]: nodes that all of them may hold at once                 */
  const palpate_obstacle* list; /* [count] with one struct_bytes, read by palpate_scene_create                      */
} palpate_obstacles_def;
PALPATE_API void palpate_init_obstacles_def(palpate_obstacles_def* def, size_t struct_bytes);
static inline palpate_obstacles_def palpate_default_obstacles_def(void) {
  palpate_obstacles_def def;
  palpate_init_obstacles_def(&def, sizeof def);
  return def;
}

/* Says where obstacle 0 .. count - 1 is at the next touch step, as palpate_scene_set_pose does for the organ: an obstacle with velocities
 * moves on by itself.
 * - The nodes of the organ's surface that have a column are held outside, and pushed away with the friction of the obstacle, whatever the law
 *   of the scene's tools. Between two nodes an edge or a corner of the obstacle can be in the tissue, so its parts should be larger than the
 *   mesh's edges.
 * - What of the organ is inside when the scene begins, or comes inside by the edge of an open surface, stays there without a force, and cannot go
 *   deeper. It is free of that as it comes out.
 * - A node that lies deeper than `depth`, as after an obstacle that jumps, is no longer held (TRACKING_LOST).
 * - Friction begins in the step after a node has come to press.
 * - Where there are more nodes near than max_nodes, the farthest are left out (CONTACTS_DROPPED).
 * - palpate_scene_reset does not change the poses.
 * Refused with PALPATE_ERROR_ARGUMENT, and the obstacle keeps its pose: another obstacle, and what palpate_scene_set_pose refuses. error may be
 * NULL. Never allocates or locks. Call it in the thread of palpate_scene_touch. */
PALPATE_API palpate_status palpate_scene_set_obstacle_pose(palpate_scene* scene, int32_t obstacle,
                                                           const palpate_pose* pose, palpate_error* error);

/* One obstacle after a touch step; the library fills it. In the world. */
typedef struct palpate_obstacle_state {
  double force[3];       /* N, on the obstacle                                                                      */
  double torque[3];      /* N m, on it, about its position                                                          */
  double position[3];    /* m: where it was in this step                                                            */
  double orientation[4]; /* quaternion w x y z                                                                      */
  double deepest;        /* m: how far a node that presses is inside; what was inside without a force does not count */
  int32_t nodes;         /* that press                                                                              */
  int32_t slips;         /* of these: that slide with friction                                                      */
} palpate_obstacle_state;
/* Of obstacle 0 .. count - 1, inside the scene and valid until the next step; NULL behind the last one, and for a scene without obstacles.
 * Call it in the thread of palpate_scene_touch. */
PALPATE_API const palpate_obstacle_state* palpate_scene_obstacle_state(const palpate_scene* scene, int32_t obstacle);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_OBSTACLES_H */
