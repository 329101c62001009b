/* palpate_plan.h - what a scene will cost, before it runs and while it does.
 *
 *     for (int32_t p = 0; palpate_scene_plan(scene, p); ++p)
 *       mapped_bytes += palpate_scene_plan(scene, p)->mapped_bytes;
 *     palpate_step_load load = palpate_default_step_load();
 *     load.tools = 1, load.points = 10, load.contacts = 10, load.rows = 30, load.nodes = 120;
 *     palpate_pass_work work = palpate_predict_pass(scene, 0, &load);
 *     double seconds = work.bytes / 10e9 + work.steps / 1e9; // of a machine that reads 10 GB/s
 *
 * docs/speed.md says how well the predictions hold.
 */
#ifndef PALPATE_PLAN_H
#define PALPATE_PLAN_H

#include "palpate.h"

#ifdef __cplusplus
extern "C" {
#endif

/* One pass of the plan: a piece of work that a step does, or that creating the scene did. */
typedef struct palpate_plan_pass {
  const char* name;        /* "collision: deformed", "superposition: surface", ...          */
  const char* half;        /* who runs it: "create", "touch", "deform" or "shape"           */
  const char* sections;    /* the bundle sections it reads: "tensors/force mesh/nodes"      */
  uint64_t mapped_bytes;   /* of those sections                                             */
  uint64_t memory_bytes;   /* that the scene has taken for this pass                        */
  int64_t most_operations; /* that a step may count in this pass, whatever the tools do; 0: nothing is counted */
} palpate_plan_pass;
/* The passes in order, pass 0 first; NULL behind the last one. Valid until the scene is destroyed. */
PALPATE_API const palpate_plan_pass* palpate_scene_plan(const palpate_scene* scene, int32_t pass);

/* That a whole touch step may count, whatever the tools do: operations of palpate_contacts never exceeds it. max_operations, and what
 * comes on top of it: links, grasps that close, needles, normals of a fine surface, the body under LARGE. No report is counted. */
PALPATE_API int64_t palpate_scene_most_operations(const palpate_scene* scene);

/* How many counted operations this machine does in that time, for max_operations. Measures for some milliseconds (up to a
 * second where the clock is coarse), so two calls differ; store the number if runs are to be the same to the bit. 0 where
 * the time is not above 0, or there is no memory or no clock (the browser's module). */
PALPATE_API int64_t palpate_operations_in(double microseconds);

/* The quantities of a step that its cost depends on. */
typedef struct palpate_step_load {
  uint32_t struct_bytes;        /* sizeof(palpate_step_load)                                                */
  int32_t tools, points, grips; /* sent to the step; points and grips of all tools together                 */
  int32_t contacts;             /* made by the step                                                         */
  int32_t rows;                 /* imposed directions: 3 of each contact, 1 where it slides, a grip's axes   */
  int32_t nodes;                /* under contact: node_count of palpate_contacts                            */
  int32_t slips;                /* contacts that slip                                                       */
  int32_t sweeps, newton_steps; /* of palpate_contacts                                                      */
} palpate_step_load;
PALPATE_API void palpate_init_step_load(palpate_step_load* load, size_t struct_bytes);
static inline palpate_step_load palpate_default_step_load(void) {
  palpate_step_load load;
  palpate_init_step_load(&load, sizeof load);
  return load;
}

/* The work of one pass in such a step. A machine that reads b bytes, does f flops and runs s steps of scalar code in a second
 * takes about max(bytes / b, flops / f) + steps / s seconds. */
typedef struct palpate_pass_work {
  double bytes; /* read from memory in long runs                                                              */
  double flops; /* in loops over long runs: a multiply-add counts 2                                           */
  double steps; /* of scalar code; the unit is one multiply-add that waits for the one before; measured       */
} palpate_pass_work;
/* pass: its index in the plan. All zero for a pass of creation, and for a load that is NULL or refused. */
PALPATE_API palpate_pass_work palpate_predict_pass(const palpate_scene* scene, int32_t pass,
                                                   const palpate_step_load* load);

/* For measuring. A step calls the watcher, in its own thread, each time that it has finished a part of a pass; pass: the
 * index in the plan. The time since the watcher's last call, or since the step began, belongs to that pass. A pass may come
 * several times in a step. NULL, the default, calls nothing. Do not change the watcher while a step runs. */
typedef void (*palpate_pass_watcher)(void* user, int32_t pass);
PALPATE_API void palpate_watch_passes(palpate_scene* scene, palpate_pass_watcher watcher, void* user);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_PLAN_H */
