// The C API of a scene: creation, plan, and the steps, which the rooms contact/ and shape/ compute.
#include "runtime/scene/scene.h"

#include <cstdlib>
#include <initializer_list>
#include <new>

#include "runtime/base/alignment.h"
#include "runtime/base/contact_nodes.h"
#include "runtime/base/error_text.h"
#include "runtime/scene/build_scene.h"

palpate_scene_def palpate_default_scene_def(void) {
  palpate_scene_def def = {};
  def.collision = PALPATE_COLLISION_REST;
  def.contact = PALPATE_CONTACT_PATCH;
  def.law = PALPATE_LAW_STICKING;
  def.force = PALPATE_FORCE_LINEAR;
  def.shape = PALPATE_SHAPE_SURFACE;
  def.radial = PALPATE_RADIAL_OFF;
  def.preload = PALPATE_PRELOAD_OFF;
  def.relaxation.model = PALPATE_RELAXATION_OFF;
  def.max_tools = 4;
  def.max_points = 64;
  def.max_contact_nodes = 192;
  def.force_limit = 50;
  def.force_slew = 1e4;
  return def;
}

palpate_status palpate_scene_create(palpate_bundle* bundle, const palpate_scene_def* def, palpate_scene** scene,
                                    palpate_error* error) {
  if (scene) *scene = nullptr;
  if (!bundle || !def || !scene)
    return palpate::fail(error, PALPATE_ERROR_ARGUMENT, 0, "bundle, def and scene must not be NULL");
  palpate_error local = {};
  if (!error) error = &local;
  *error = palpate_error{};
  if (const palpate_status status = palpate::check_scene_def(*def, error)) return status;
  palpate::SceneMemory own(def->allocator);
  void* memory =
      own.array<std::max_align_t>((sizeof(palpate_scene) + sizeof(std::max_align_t) - 1) / sizeof(std::max_align_t));
  if (!memory) return palpate::fail(error, PALPATE_ERROR_MEMORY, 0, "the allocator has no memory for the scene");
  palpate_scene* created = new (memory) palpate_scene(*def, *bundle);
  const palpate_status status = palpate::build_scene(*created, error);
  if (status != PALPATE_OK) {
    palpate_scene_destroy(created);
    return status;
  }
  created->def.render_mesh = nullptr;  // the host may release its arrays now
  *scene = created;
  return palpate::succeed(error);
}

void palpate_scene_destroy(palpate_scene* scene) {
  if (!scene) return;
  const palpate_allocator host = scene->def.allocator;
  scene->memory.release_all();
  scene->~palpate_scene();
  if (host.allocate)
    host.release(host.user, scene);
  else
    std::free(scene);
}

const palpate_plan_pass* palpate_scene_plan(const palpate_scene* scene, int32_t* count) {
  if (count) *count = scene ? scene->plan.count : 0;
  return scene ? scene->plan.pass : nullptr;
}

void palpate_watch_passes(palpate_scene* scene, palpate_pass_watcher watcher, void* user) {
  if (!scene) return;
  scene->watch.watcher = watcher, scene->watch.user = user;
}

size_t palpate_contacts_bytes(const palpate_scene* scene) {
  if (!scene) return sizeof(palpate_contacts);
  return sizeof(palpate_contacts) + static_cast<size_t>(scene->def.max_contact_nodes) * sizeof(palpate_contact_node);
}

const palpate_contact_node* palpate_contacts_nodes(const palpate_contacts* contacts) {
  return palpate::nodes_behind(*contacts);
}

palpate_step_flags palpate_scene_touch(palpate_scene* scene, const palpate_tool* tools, int32_t tool_count, double dt,
                                       palpate_contacts* contacts) {
  if (!scene || !contacts || !palpate::is_aligned(contacts)) return PALPATE_STEP_BAD_INPUT;
  return palpate::touch_step(scene->context, scene->touch, tools, tool_count, dt, *contacts);
}

void palpate_scene_reset(palpate_scene* scene) {
  if (scene) palpate::reset_touch(scene->def, scene->touch);
}

palpate_step_flags palpate_scene_shape(palpate_scene* scene, const palpate_contacts* contacts, palpate_shape_out* out) {
  if (!scene || !out) return PALPATE_STEP_BAD_INPUT;
  out->node_count = 0;
  if (scene->def.shape == PALPATE_SHAPE_OFF || out->node_capacity < 0) return PALPATE_STEP_BAD_INPUT;
  if (!palpate::is_aligned(out->displacements) || !palpate::is_aligned(out->positions)) return PALPATE_STEP_BAD_INPUT;
  if (!out->displacements && !out->positions) return 0;
  palpate::Compliance* compliance = scene->tensors.compliance ? &scene->compliance : nullptr;
  return palpate::shape_step(scene->context, scene->shape, compliance, contacts, *out);
}

palpate_step_flags palpate_scene_skin(palpate_scene* scene, const palpate_shape_out* shape, palpate_skin_out* out) {
  if (!out) return PALPATE_STEP_BAD_INPUT;
  out->vertex_count = 0;
  if (!scene || !shape || !scene->skin.bound() || out->vertex_capacity < 0) return PALPATE_STEP_BAD_INPUT;
  if (!shape->displacements || shape->node_count < scene->skin.node_count()) return PALPATE_STEP_BAD_INPUT;
  for (const float* array : {static_cast<const float*>(shape->displacements), static_cast<const float*>(out->positions),
                             static_cast<const float*>(out->normals)})
    if (!palpate::is_aligned(array)) return PALPATE_STEP_BAD_INPUT;
  if (out->normals && !scene->skin.has_normals()) return PALPATE_STEP_BAD_INPUT;
  const palpate_step_flags flags = scene->skin.move(shape->displacements, out);
  scene->watch.ended(palpate::Pass::skin);
  return flags;
}
