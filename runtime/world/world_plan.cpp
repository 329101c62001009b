#include "runtime/world/world_plan.h"

#include "runtime/base/host_struct.h"
#include "runtime/include/palpate/palpate_world_plan.h"
#include "runtime/world/world.h"

namespace palpate {
namespace {

// As plan_cost.cpp does for the passes of an organ. The factors are of three scenes of livers, of which this tells joint solve and output
// within a factor of 2.5. The search is that of a world at rest: a load does not say how many vertices are looked for anew because
// they have moved.
palpate_pass_work work_of(WorldPass pass, const palpate_world& world, const palpate_step_load& load) {
  // Pairs that do not press have one row, and no part in a step of Newton's method.
  const double pairs = load.contacts, pressing = load.rows, rows = pressing + pairs, newton = load.newton_steps;
  switch (pass) {
    case WorldPass::input:
      return {0, 0, 40 + 8.0 * load.tools + 1.5 * load.points};
    case WorldPass::search:
      // Each vertex is asked whether it is due. A pair that presses and slips is looked for anew, where it is and where it was.
      return {48.0 * world.pairs.vertices(), 0,
              50 + 2.5 * world.pairs.vertices() + 250 * pairs + load.slips * (600 + 40.0 * load.nodes)};
    case WorldPass::solve:
      // As the solve of one organ; the matrices of both sides are added first.
      return {
          0,
          2 * rows * (4 * rows + pressing * (load.sweeps + 3 * newton)) + newton * pressing * pressing * pressing / 3,
          60 + 20.0 * load.nodes + 120 * pairs * (1 + load.sweeps + 2 * newton)};
    case WorldPass::links:
      // As of the links of an organ: the displacements of the nodes of both ends by all contact nodes.
      return {0, 0, world.links.count() * (20 + 12.0 * world.links.most_nodes_of_an_end() * load.nodes)};
    case WorldPass::output:
      return {0, 0, 40 + 25 * pairs + 6.0 * load.nodes + 10.0 * load.tools};
    case WorldPass::count:
      break;
  }
  return {};
}

// The organ whose pass this is; *pass is then its index in the organ's own plan. -1: it is one of the world, *pass its index there.
std::int32_t organ_of_pass(const palpate_world& world, std::int32_t* pass) {
  for (std::int32_t k = 0; k < world.organ_count; ++k) {
    if (*pass < world.organ[k]->plan.count) return k;
    *pass -= world.organ[k]->plan.count;
  }
  return -1;
}

}  // namespace

WorldPlan make_world_plan(const palpate_world& world) {
  WorldPlan plan;
  for (std::int32_t k = 0; k < world.organ_count; ++k) plan.first += world.organ[k]->plan.count;
  constexpr const char* names[] = {"world: input", "world: search of pairs", "world: joint solve", "world: links",
                                   "world: output"};
  for (std::int32_t id = 0; id < kWorldPasses; ++id) {
    plan.index[id] = -1;
    const std::uint64_t bytes = world.pass_bytes[id];
    if (bytes == 0 && static_cast<WorldPass>(id) != WorldPass::output) continue;
    plan.index[id] = plan.count;
    plan.pass[plan.count++] = {names[id], "touch", "", 0, bytes, 0};
  }
  return plan;
}

}  // namespace palpate

const palpate_plan_pass* palpate_world_plan(const palpate_world* world, int32_t pass, int32_t* organ) {
  if (organ) *organ = -1;
  if (!world || pass < 0) return nullptr;
  const std::int32_t k = palpate::organ_of_pass(*world, &pass);
  if (organ) *organ = k;
  if (k >= 0) return world->organ[k]->plan.pass + pass;
  return pass < world->plan.count ? world->plan.pass + pass : nullptr;
}

palpate_pass_work palpate_world_predict_pass(const palpate_world* world, int32_t pass, const palpate_step_load* load) {
  palpate_step_load sent = {};
  if (!world || pass < 0 || !palpate::read_host_struct(load, &sent)) return {};
  if (const std::int32_t k = palpate::organ_of_pass(*world, &pass); k >= 0)
    return palpate_predict_pass(world->organ[k], pass, load);
  for (std::int32_t id = 0; id < palpate::kWorldPasses; ++id)
    if (world->plan.index[id] == pass) return palpate::work_of(static_cast<palpate::WorldPass>(id), *world, sent);
  return {};
}

void palpate_world_watch_passes(palpate_world* world, palpate_pass_watcher watcher, void* user) {
  if (!world) return;
  std::int32_t first = 0;
  for (std::int32_t k = 0; k < world->organ_count; ++k) {
    palpate::PassWatch& watch = world->organ[k]->watch;
    watch.watcher = watcher, watch.user = user, watch.first = first;
    first += world->organ[k]->plan.count;
  }
  world->plan.watcher = watcher, world->plan.user = user;
}
