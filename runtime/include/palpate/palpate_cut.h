/* palpate_cut.h - an organ that is cut while it is touched: blades that the host moves, and tissue that is removed.
 *
 *     palpate_scene_def def = palpate_default_scene_def();
 *     palpate_cut_def cut = palpate_default_cut_def();
 *     palpate_add_part(&def.parts, &cut.part);
 *     def.collision = PALPATE_COLLISION_DEFORMED;
 *     palpate_scene_create(bundle, &def, &scene, &error); // a bundle with [cut] in its boundary file
 *     const double edge[6] = {0.01, 0.02, 0.05, 0.01, 0.02, 0.03}; // m, in the world: from heel to tip
 *     palpate_blade blade = palpate_default_blade();
 *     blade.points = edge, blade.point_count = 2;
 *     palpate_scene_set_blade(scene, 0, &blade, &error); // in each step
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
 * left deforms as the mesh that is left would, exactly (linear elasticity), or by the method of large deformation. The lips of a cut are surface: they are touched and drawn, and do not pass through one another. */
typedef enum palpate_cut {
  PALPATE_CUT_OFF, /* no cut, and neither memory nor time for it                                                 */
  PALPATE_CUT_ON   /* Needs a bundle with a region that can be cut, and collision DEFORMED                       */
} palpate_cut;
typedef struct palpate_cut_def {
  palpate_part part;
  palpate_cut cut;        /* default ON                                                                           */
  int32_t cut_nodes;      /* default 0 [0 .. 100000]: new nodes at most; 0: as many as the bundle reserves        */
  int32_t cut_rank;       /* default 600 [16 .. 4096]: rank of what all cuts may add to the compliance: 3 a split node,
                             5 of p1-anp; up to 12 a removed tetrahedron. Memory: 8 rank^2 + 24 rank Ns bytes      */
  int32_t cut_operations; /* default 100000 [1000 .. 1000000000]: counted operations of a step for the compliance of
                             what was cut; what is left of it comes in the next steps                             */
  int32_t cut_points;     /* default 12 [2 .. 16]: points of an edge with toughness, at equal distances, at which
                             tissue holds it                                                                      */
  int32_t cut_lips;       /* default 64 [0 .. 1000]: pairs of nodes, across from one another on the lips of a cut, that
                             may press on one another in a step, without friction. Where more would, the nearest do
                             (PALPATE_STEP_CONTACTS_DROPPED). 0: lips pass through one another, without cost       */
  int32_t cut_rebase;     /* default 0 [0 .. 4096]: from this rank on, below cut_rank, steps re-base the compliance: the
                             cuts so far become a part of it, within cut_operations of each step, and the rank begins at
                             zero: it bounds the time of a step, not what can be cut. 0: never. LINEAR alone. Memory:
                             144 bytes a pair of surface nodes that move, and cut_rank's twice                     */
  int32_t reserved;       /* 0                                                                                    */
} palpate_cut_def;
PALPATE_API void palpate_init_cut_def(palpate_cut_def* def, size_t struct_bytes);
static inline palpate_cut_def palpate_default_cut_def(void) {
  palpate_cut_def def;
  palpate_init_cut_def(&def, sizeof def);
  return def;
}

/* A blade, as it is at the next touch step: the line of its edge, and how tissue resists it. */
#define PALPATE_MAX_BLADES 4
#define PALPATE_MAX_BLADE_POINTS 16
typedef struct palpate_blade {
  uint32_t struct_bytes; /* sizeof(palpate_blade)                                                                  */
  int32_t point_count;   /* default 0: the blade is withdrawn; 2 .. PALPATE_MAX_BLADE_POINTS                       */
  const double* points;  /* [point_count][3] m, in the world, within 1e6 m: along the edge. Read by the call       */
  double direction[3];   /* default 0 0 0: not needed without toughness; else where the edge looks, in the world, of
                            length 1                                                                              */
  double toughness; /* default 0 J/m^2, 0 .. 1e6: the work that a new area of cut takes. 0: the blade feels nothing */
  double
      friction; /* default 0 Pa, 0 .. 1e6: the shear stress at which tissue slides along the blade's flanks. Above 0 it needs
                       toughness and width                                                                         */
  double width; /* default 0 m, 0 .. 1e6: of the flanks behind the edge, against the direction                  */
} palpate_blade;
PALPATE_API void palpate_init_blade(palpate_blade* blade, size_t struct_bytes);
static inline palpate_blade palpate_default_blade(void) {
  palpate_blade blade;
  palpate_init_blade(&blade, sizeof blade);
  return blade;
}

/* Says where blade 0 .. PALPATE_MAX_BLADES - 1 is at the next touch step. It cuts what lies between its line in the step before and this one, in the
 * organ as it is then deformed; a blade that comes, with other points or behind point_count 0, cuts nothing in its first step. Tissue that moves past
 * a blade that stands still is cut too.
 * - Only faces of the region that the bundle's boundary file names are cut.
 * - A cut begins at the surface or at another cut.
 * - With toughness, tissue holds the edge: each of cut_points points along it that is in the region pushes the tissue along `direction` with at most toughness times the
 *   length of edge that it stands for, and cuts where it would take more; it does not leave the plane of the cut.
 * - With friction, tissue also holds the flanks behind each such point, on both sides, as far as the point has come into the tissue and the blade is wide:
 *   forwards, backwards and along the edge, each by itself.
 * - While the compliance of an earlier step's cut is not whole (palpate_cut_state.left), blades wait: what they pass is cut after that, along the straight
 *   way between.
 * Refused with PALPATE_ERROR_ARGUMENT: another blade, a scene that does not cut, and what palpate_blade does not allow. error may be NULL. Never
 * allocates or locks. Call it in the thread of palpate_scene_touch. */
PALPATE_API palpate_status palpate_scene_set_blade(palpate_scene* scene, int32_t blade, const palpate_blade* now,
                                                   palpate_error* error);

/* A blade after a touch step; the library fills it. In the world. */
typedef struct palpate_blade_state {
  double force[3];  /* N, on the blade                                                                            */
  double torque[3]; /* N m, on it, about the first of its points                                                  */
  double work;      /* J, that cutting has taken from it since it came                                            */
  double area;      /* m^2, that its edge has swept in tissue since it came, where it feels it                    */
  int32_t in_tissue, cuts; /* of its points: that are in the region; that cut in this step                        */
  double friction_work;    /* J, that friction on its flanks has taken from it since it came                      */
} palpate_blade_state;
/* Of blade 0 .. PALPATE_MAX_BLADES - 1, inside the scene and valid until the next step; NULL for another, and for a scene that does not cut. */
PALPATE_API const palpate_blade_state* palpate_scene_blade_state(const palpate_scene* scene, int32_t blade);

/* At the next touch step, removes the tetrahedra of the region whose middle lies within `radius` m of `centre`, [3] m in the world, in the organ as
 * it is then deformed: those nearest to the centre first, and only those that leave a surface without edges of more than two triangles. The next call
 * before that step takes the place of this one. With `needed` above 0 they take time, as under the hook of an electrosurgical instrument: each keeps
 * the `held` s that it has been in such a ball in all, and goes once these are `needed` s. A host that calls it in each step gives dt as `held`; 0 and 0:
 * all at once. Refused with PALPATE_ERROR_ARGUMENT: numbers as above, a radius that is not above 0, times below 0 or above 1e6 s. */
PALPATE_API palpate_status palpate_scene_remove_tissue(palpate_scene* scene, const double* centre, double radius,
                                                       double held, double needed, palpate_error* error);

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
  int32_t rank;     /* of what the cuts add to the compliance, since it was last re-based                      */
  int32_t is_full;  /* 1: there are no nodes or no rank left, and nothing more is cut                          */
  int32_t rebased;  /* how often the compliance was re-based (cut_rebase)                                      */
  int32_t rebasing; /* 1: it is being re-based                                                                 */
} palpate_cut_state;
/* Inside the scene and valid until the next step; NULL for a scene that does not cut. Call it in the thread of palpate_scene_touch. */
PALPATE_API const palpate_cut_state* palpate_scene_cut_state(const palpate_scene* scene);

/* The surface of what is left, as [count][3] nodes of a shape, counter-clockwise from outside: to draw a shape, in place of the bundle's triangles. Fills
 * `triangles` with the first `capacity` of them, and returns the count; 0 for a scene that does not cut. Where is_lip is not NULL, it gets 1
 * for each triangle of a cut, 0 for each of the bundle's own. Call it in the thread of palpate_scene_touch, when palpate_cut_state.surface has changed. */
PALPATE_API int32_t palpate_scene_cut_surface(const palpate_scene* scene, int32_t* triangles, uint8_t* is_lip,
                                              int32_t capacity);

/* The nodes that cuts have made, as [count][2] nodes of a shape: the new one, and the bundle's that it comes from, at whose place it lies at rest. Fills
 * `nodes` with the first `capacity` pairs, and returns the count; 0 for a scene that does not cut. A shape gives the displacement of a new node from where
 * the bundle has it, which is no place of the organ; its position is right. Call it in the thread of palpate_scene_touch. */
PALPATE_API int32_t palpate_scene_cut_nodes(const palpate_scene* scene, int32_t* nodes, int32_t capacity);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_CUT_H */
