/* palpate_world_plan.h - what a world will cost, before it runs and while it does.
 *
 *     int32_t organ;
 *     for (int32_t p = 0; palpate_world_plan(world, p, &organ); ++p)
 *       mapped_bytes += palpate_world_plan(world, p, &organ)->mapped_bytes;
 */
#ifndef PALPATE_WORLD_PLAN_H
#define PALPATE_WORLD_PLAN_H

#include "palpate_plan.h"
#include "palpate_world.h"

#ifdef __cplusplus
extern "C" {
#endif

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

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_WORLD_PLAN_H */
