// The C API of a scene: creation, plan, and the steps, which the rooms contact/ and shape/ compute.
#include "runtime/scene/scene.h"

#include <algorithm>
#include <initializer_list>
#include <new>

#include "runtime/base/aligned_memory.h"
#include "runtime/base/alignment.h"
#include "runtime/base/contact_nodes.h"
#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"
#include "runtime/scene/build_scene.h"
#include "runtime/shape/vertex_normals.h"

palpate_status palpate::create_scene(palpate_bundle* bundle, const palpate_scene_def* def, const ReservedRows& reserved,
                                     palpate_scene** scene, palpate_error* error) {
  if (scene) *scene = nullptr;
  if (!bundle || !def || !scene)
    return palpate::fail(error, PALPATE_ERROR_ARGUMENT, 0, "bundle, def and scene must not be NULL");
  palpate_error local = {};
  if (!error) error = &local;
  *error = palpate_error{};
  palpate_scene_def wanted = palpate_default_scene_def();
  if (const palpate_status status = palpate::read_host_struct("scene_def", def, &wanted, error)) return status;
  wanted.struct_bytes = sizeof wanted;  // it has all fields, whatever the host's has
  EffectsOfScene parts;
  if (const palpate_status status = parts.take(wanted.parts, error)) return status;
  wanted.parts = parts.chain();
  const EffectList effects = parts.list();
  if (const palpate_status status = palpate::check_scene_def(wanted, effects, error)) return status;
  const RowBudget rows = palpate::rows_of(wanted, effects);
  wanted.max_contact_nodes = palpate::contact_nodes_for(wanted, rows) + reserved.nodes;
  palpate::SceneMemory own(wanted.allocator);
  void* memory =
      own.array<std::max_align_t>((sizeof(palpate_scene) + sizeof(std::max_align_t) - 1) / sizeof(std::max_align_t));
  if (!memory) return palpate::fail(error, PALPATE_ERROR_MEMORY, 0, "the allocator has no memory for the scene");
  palpate_scene* created = new (memory) palpate_scene(wanted, parts, *bundle);
  created->rows = rows, created->reserved = reserved, created->uses = reserved.uses;
  created->touch.most_constraints =
      std::min(wanted.max_contact_nodes, constraints_of_point(wanted) * wanted.max_points + rows.constraints) +
      reserved.constraints;
  for (const Effect* effect : effects) {
    created->effects[created->effect_count++].effect = effect;
    created->uses |= effect->uses;
  }
  const palpate_status status = palpate::build_scene(*created, error);
  if (status != PALPATE_OK) {
    palpate_scene_destroy(created);
    return status;
  }
  *scene = created;
  return palpate::succeed(error);
}

palpate_status palpate_scene_create(palpate_bundle* bundle, const palpate_scene_def* def, palpate_scene** scene,
                                    palpate_error* error) {
  return palpate::create_scene(bundle, def, {}, scene, error);
}

void palpate_scene_destroy(palpate_scene* scene) {
  if (!scene) return;
  const palpate_allocator host = scene->def.allocator;
  scene->memory.release_all();
  scene->~palpate_scene();
  if (host.allocate)
    host.release(host.user, scene);
  else
    palpate::release_aligned(scene);
}

const palpate_plan_pass* palpate_scene_plan(const palpate_scene* scene, int32_t pass) {
  return scene && pass >= 0 && pass < scene->plan.count ? scene->plan.pass + pass : nullptr;
}

void palpate_watch_passes(palpate_scene* scene, palpate_pass_watcher watcher, void* user) {
  if (!scene) return;
  scene->watch.watcher = watcher, scene->watch.user = user, scene->watch.first = 0;
}

size_t palpate_contacts_bytes(const palpate_scene* scene) {
  return palpate::bytes_of_contacts(PALPATE_MAX_TOOLS, scene ? scene->def.max_contact_nodes : 0,
                                    scene ? scene->touch.held.nodes : 0, scene ? scene->touch.offset.count() : 0);
}

palpate_step_flags palpate_scene_touch(palpate_scene* scene, const palpate_tool* tools, int32_t tool_count, double dt,
                                       palpate_contacts* contacts, size_t contacts_bytes) {
  if (!scene || scene->not_alone || !contacts || !palpate::is_aligned(contacts) ||
      contacts_bytes < palpate_contacts_bytes(scene))
    return PALPATE_STEP_BAD_INPUT;
  return palpate::touch_step(scene->context, scene->touch, tools, tool_count, dt, *contacts);
}

void palpate_scene_reset(palpate_scene* scene) {
  if (scene) palpate::reset_touch(scene->def, scene->touch);
}

void palpate_scene_reset_tool(palpate_scene* scene, int32_t id) {
  if (scene) palpate::reset_tool(scene->def, scene->touch, id);
}

palpate_step_flags palpate_scene_shape(palpate_scene* scene, const palpate_contacts* contacts, palpate_shape_out* out) {
  palpate_shape_out wanted = {};
  if (!scene || !palpate::read_host_struct(out, &wanted)) return PALPATE_STEP_BAD_INPUT;
  out->node_count = wanted.node_count = 0;
  if (scene->def.shape == PALPATE_SHAPE_OFF || wanted.node_capacity < 0) return PALPATE_STEP_BAD_INPUT;
  if (!palpate::is_aligned(wanted.displacements) || !palpate::is_aligned(wanted.positions))
    return PALPATE_STEP_BAD_INPUT;
  if (!wanted.displacements && !wanted.positions) return 0;
  palpate::Compliance* compliance = scene->tensors.compliance ? &scene->compliance : nullptr;
  const palpate_step_flags flags = palpate::shape_step(scene->context, scene->shape, compliance, contacts, wanted);
  out->node_count = wanted.node_count;
  return flags;
}

palpate_step_flags palpate_scene_normals(palpate_scene* scene, const palpate_shape_out* shape, float* normals,
                                         int32_t node_capacity) {
  palpate_shape_out shaped = {};
  if (!scene || !scene->shape.surface.triangles || !palpate::read_host_struct(shape, &shaped))
    return PALPATE_STEP_BAD_INPUT;
  const std::int32_t nodes = scene->tensors.surface_nodes;
  if (!shaped.positions || !normals || shaped.node_count < nodes || node_capacity < nodes)
    return PALPATE_STEP_BAD_INPUT;
  if (!palpate::is_aligned(shaped.positions) || !palpate::is_aligned(normals)) return PALPATE_STEP_BAD_INPUT;
  const palpate::ShapedSurface& of = scene->shape.surface;
  const bool all_finite =
      palpate::find_vertex_normals(shaped.positions, nodes, of.triangles, of.triangle_count, of.active, normals);
  return all_finite ? 0 : PALPATE_STEP_BAD_INPUT;
}
