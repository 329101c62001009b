// The C API of a world: creation, plan, and the touch step, which world_touch.cpp computes.
#include "runtime/world/world.h"

#include <new>

#include "runtime/base/aligned_memory.h"
#include "runtime/base/alignment.h"
#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"
#include "runtime/scene/build_scene.h"

namespace palpate {
namespace {

palpate_status check_world_def(const palpate_world_def& def, palpate_error* error) {
  const auto bad = [&](const char* what) {
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_world_def: %s", what);
  };
  if (def.organ_count < 1 || def.organ_count > PALPATE_MAX_ORGANS)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_world_def: expected an organ_count of 1 .. %d, found %d",
                PALPATE_MAX_ORGANS, static_cast<int>(def.organ_count));
  if (!def.organs || !is_aligned(def.organs)) return bad("organs must be an array of palpate_world_organ");
  if (!(def.force_limit > 0)) return bad("force_limit must be above 0 N");
  if (!(def.force_slew > 0)) return bad("force_slew must be above 0 N/s");
  if (!(def.torque_limit > 0)) return bad("torque_limit must be above 0 N m");
  if (!(def.torque_slew > 0)) return bad("torque_slew must be above 0 N m/s");
  if (def.max_pairs < 0 || def.max_pairs > 1000) return bad("max_pairs must be 0 .. 1000");
  if (!(def.friction >= 0 && def.friction <= 100)) return bad("friction must be 0 .. 100");
  if (def.max_links < 0 || def.max_links > 1000) return bad("max_links must be 0 .. 1000");
  if (def.max_links > 0 && !kHasEffects)
    return fail(error, PALPATE_ERROR_EFFECT, 0,
                "palpate_world_def: this library was built with PALPATE_WITHOUT_EFFECTS; leave max_links at 0");
  if ((def.allocator.allocate == nullptr) != (def.allocator.release == nullptr))
    return bad("the allocator needs both allocate and release, or neither");
  return PALPATE_OK;
}

// Puts the organ's number in front of what went wrong with its scene.
palpate_status of_organ(std::int32_t k, const palpate_error& from, palpate_error* error) {
  return fail(error, from.status, from.byte_offset, "organ %d: %s", static_cast<int>(k), from.text);
}

palpate_status read_organ(const palpate_world_def& def, std::int32_t k, palpate_world_organ* organ,
                          palpate_error* error) {
  const std::uint32_t stride = struct_bytes_of(def.organs);
  const auto* const from = reinterpret_cast<const palpate_world_organ*>(
      reinterpret_cast<const unsigned char*>(def.organs) + static_cast<std::size_t>(k) * stride);
  palpate_error found = {};
  if (read_host_struct("world_organ", from, organ, &found) != PALPATE_OK) return of_organ(k, found, error);
  if (from->struct_bytes != stride)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "organ %d: all organs must have the same struct_bytes",
                static_cast<int>(k));
  if (!organ->bundle)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "organ %d: bundle must not be NULL", static_cast<int>(k));
  return PALPATE_OK;
}

// Organs that touch need the surface as it deforms.
palpate_status check_touching_organ(const palpate_scene_def& def, std::int32_t k, palpate_error* error) {
  if (def.collision == PALPATE_COLLISION_DEFORMED) return PALPATE_OK;
  return fail(
      error, PALPATE_ERROR_ARGUMENT, 0,
      "organ %d: organs that touch (max_pairs above 0) need collision DEFORMED; change it, or set max_pairs to 0",
      static_cast<int>(k));
}

// For the rows between organs, of which each organ has its part.
ReservedRows reserved_rows(const palpate_world_def& world, const palpate_scene_def& organ) {
  constexpr std::int32_t nodes_of_pair = 3;
  ReservedRows rows;
  rows.constraints = world.max_pairs + world.max_links;
  rows.nodes = nodes_of_pair * world.max_pairs + nodes_of_a_link(organ) * world.max_links;
  if (world.max_pairs > 0) rows.uses |= kUsesNodeReach;
  if (world.max_links > 0) rows.uses |= kUsesRest | kUsesSurface | kUsesDisplacements;
  return rows;
}

palpate_status make_organ(palpate_world& world, const palpate_world_organ& organ, palpate_error* error) {
  const std::int32_t k = world.organ_count;
  palpate_error found = {};
  const palpate_scene_def def = palpate_default_scene_def();
  palpate_scene* scene = nullptr;
  palpate_scene_def wanted = def;
  if (organ.def && read_host_struct("scene_def", organ.def, &wanted, &found) != PALPATE_OK)
    return of_organ(k, found, error);
  EffectsOfScene effects;
  if (effects.take(wanted.parts, &found) != PALPATE_OK) return of_organ(k, found, error);
  wanted.parts = effects.chain();
  if (world.def.max_pairs > 0)
    if (const palpate_status status = check_touching_organ(wanted, k, error)) return status;
  if (create_scene(organ.bundle, &wanted, reserved_rows(world.def, wanted), &scene, &found) != PALPATE_OK)
    return of_organ(k, found, error);
  world.organ[world.organ_count++] = scene;
  scene->not_alone = "the scene is an organ of a world; save and restore the world (palpate_world_save)";
  const palpate_scene_def& first = world.organ[0]->def;
  if (scene->def.max_tools != first.max_tools || scene->def.max_points != first.max_points)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "organ %d: expected max_tools %d and max_points %d, as organ 0 has, found %d and %d; the organs of a "
                "world share their tools",
                static_cast<int>(k), static_cast<int>(first.max_tools), static_cast<int>(first.max_points),
                static_cast<int>(scene->def.max_tools), static_cast<int>(scene->def.max_points));
  if (organ.pose && palpate_scene_set_pose(scene, organ.pose, &found) != PALPATE_OK) return of_organ(k, found, error);
  return PALPATE_OK;
}

// Makes the sources of rows between organs, and what solves these. False where there is no memory.
bool join_organs(palpate_world& world) {
  SceneMemory& memory = world.memory;
  std::uint64_t before = 0;
  const auto ended = [&](WorldPass pass) {
    world.pass_bytes[static_cast<std::int32_t>(pass)] = memory.bytes() - before;
    before = memory.bytes();
  };
  ended(WorldPass::input);
  WorldStep& step = world.in_step;
  step.organs = world.organ, step.organ_count = world.organ_count;
  step.sources[step.source_count++] = &world.pairs, step.sources[step.source_count++] = &world.links;
  const std::int32_t most_pairs = world.organ_count > 1 ? world.def.max_pairs : 0, most_links = world.def.max_links;
  bool made =
      most_pairs == 0 || world.pairs.create(memory, world.organ, world.organ_count, most_pairs, world.def.friction);
  ended(WorldPass::search);
  made = made && (most_links == 0 || world.links.create(memory, world.organ, world.organ_count, most_links));
  ended(WorldPass::links);
  const std::int32_t most_joints = most_pairs + most_links;
  made = made && (most_joints == 0 || world.islands.create(memory, world.organ, world.organ_count, most_joints));
  ended(WorldPass::solve);
  step.joints = world.islands.joints();
  return made;
}

palpate_status build_world(palpate_world& world, palpate_error* error) {
  InputLimits limits[PALPATE_MAX_ORGANS];
  for (std::int32_t k = 0; k < world.def.organ_count; ++k) {
    palpate_world_organ organ = palpate_default_world_organ();
    if (const palpate_status status = read_organ(world.def, k, &organ, error)) return status;
    if (const palpate_status status = make_organ(world, organ, error)) return status;
    limits[k] = world.organ[k]->touch.input.limits();
    world.organ_input[k].create(*world.organ[k], &world.input.in_world());
  }
  world.memory.keep(world.step);
  world.memory.keep(world.sent);
  if (!world.input.create(world.memory, limits, world.organ_count, world.organ_count > 1))
    return fail(error, PALPATE_ERROR_MEMORY, 0, "the allocator has no memory for the world");
  if (!join_organs(world))
    return fail(error, PALPATE_ERROR_MEMORY, 0, "the allocator has no memory for organs that touch or are linked");
  world.plan = make_world_plan(world);
  world.definition = definition_of(world);
  return PALPATE_OK;
}

}  // namespace
}  // namespace palpate

palpate_status palpate_world_create(const palpate_world_def* def, palpate_world** world, palpate_error* error) {
  if (world) *world = nullptr;
  if (!def || !world) return palpate::fail(error, PALPATE_ERROR_ARGUMENT, 0, "def and world must not be NULL");
  palpate_error local = {};
  if (!error) error = &local;
  *error = palpate_error{};
  palpate_world_def wanted = palpate_default_world_def();
  if (const palpate_status status = palpate::read_host_struct("world_def", def, &wanted, error)) return status;
  if (const palpate_status status = palpate::check_world_def(wanted, error)) return status;
  palpate::SceneMemory own(wanted.allocator);
  void* memory =
      own.array<std::max_align_t>((sizeof(palpate_world) + sizeof(std::max_align_t) - 1) / sizeof(std::max_align_t));
  if (!memory) return palpate::fail(error, PALPATE_ERROR_MEMORY, 0, "the allocator has no memory for the world");
  palpate_world* created = new (memory) palpate_world(wanted);
  const palpate_status status = palpate::build_world(*created, error);
  if (status != PALPATE_OK) {
    palpate_world_destroy(created);
    return status;
  }
  created->def.organs = nullptr;  // the host may release its array now
  *world = created;
  return palpate::succeed(error);
}

void palpate_world_destroy(palpate_world* world) {
  if (!world) return;
  for (std::int32_t k = 0; k < world->organ_count; ++k) palpate_scene_destroy(world->organ[k]);
  const palpate_allocator host = world->def.allocator;
  world->memory.release_all();
  world->~palpate_world();
  if (host.allocate)
    host.release(host.user, world);
  else
    palpate::release_aligned(world);
}

int32_t palpate_world_organ_count(const palpate_world* world) {
  return world ? world->organ_count : 0;
}

palpate_scene* palpate_world_scene(const palpate_world* world, int32_t organ) {
  return world && organ >= 0 && organ < world->organ_count ? world->organ[organ] : nullptr;
}

size_t palpate_world_contacts_bytes(const palpate_world* world) {
  return world ? palpate::bytes_of_world_contacts(*world) : 0;
}

palpate_step_flags palpate_world_touch(palpate_world* world, const palpate_tool* tools, int32_t tool_count, double dt,
                                       palpate_world_contacts* contacts, size_t contacts_bytes) {
  if (!world || !contacts || !palpate::is_aligned(contacts) || contacts_bytes < palpate_world_contacts_bytes(world))
    return PALPATE_STEP_BAD_INPUT;
  return palpate::touch_world(*world, tools, tool_count, dt, *contacts);
}

palpate_status palpate_world_set_links(palpate_world* world, const palpate_world_link* links, int32_t count,
                                       palpate_error* error) {
  if (!world) return palpate::fail(error, PALPATE_ERROR_ARGUMENT, 0, "world must not be NULL");
  return world->links.set(links, count, error);
}

const palpate_link_state* palpate_world_link_state(const palpate_world* world, int32_t link) {
  return world ? world->links.state(link) : nullptr;
}

void palpate_world_reset(palpate_world* world) {
  if (!world) return;
  for (std::int32_t k = 0; k < world->organ_count; ++k) palpate_scene_reset(world->organ[k]);
  world->input.forget();
  for (std::int32_t s = 0; s < world->in_step.source_count; ++s) world->in_step.sources[s]->forget();
  for (palpate::SentForce& sent : world->sent) sent = {};
  world->step = 0;
}

void palpate_world_reset_tool(palpate_world* world, int32_t id) {
  if (!world) return;
  for (std::int32_t k = 0; k < world->organ_count; ++k) palpate_scene_reset_tool(world->organ[k], id);
  if (const std::int32_t t = world->input.place_of(id); t >= 0) world->sent[t] = {};
  world->input.forget_tool(id);
}

void palpate_init_world_organ(palpate_world_organ* organ, size_t struct_bytes) {
  palpate::write_host_struct(palpate_world_organ{}, organ, struct_bytes);
}

void palpate_init_world_def(palpate_world_def* def, size_t struct_bytes) {
  palpate_world_def defaults = {};
  defaults.force_limit = 50;
  defaults.force_slew = 1e4;
  defaults.torque_limit = 5;
  defaults.torque_slew = 1e3;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

void palpate_init_world_link(palpate_world_link* link, size_t struct_bytes) {
  palpate_world_link defaults = {};
  defaults.id = defaults.organ[0] = defaults.organ[1] = -1;
  defaults.stiffness = defaults.breaking_force = INFINITY;
  palpate::write_host_struct(defaults, link, struct_bytes);
}
