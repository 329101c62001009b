#include "runtime/links/effect.h"

#include "runtime/base/host_struct.h"
#include "runtime/links/links.h"
#include "runtime/scene/effect_build.h"

namespace palpate {
namespace {

// nullptr where the scene may have none.
Links* links_of(const palpate_scene* scene) {
  return scene ? static_cast<Links*>(scene->state_of(links_effect)) : nullptr;
}

constexpr EffectKey kKeys[] = {
    {PALPATE_EFFECT_KEY(links_effect, palpate_links_def, max_links), PALPATE_KEY_COUNT, "", "", 0, 1000}};

std::int32_t most_links(const palpate_scene_def& def) {
  return part_of<palpate_links_def>(def, links_effect).max_links;
}

RowBudget rows(const palpate_scene_def& def) {
  const std::int32_t links = most_links(def);
  return {links, links * nodes_of_a_link(def), links};
}

void add_sections(const palpate_scene_def&, SectionList& sections) {
  sections.add_contacts();
}

// Every link as if it were slack and measured: the displacements of the nodes of both its ends by all contact nodes.
palpate_pass_work predict(const palpate_scene& scene, const palpate_step_load& load) {
  return {0, 0, links_of(&scene)->count() * (20 + 6.0 * nodes_of_a_link(scene.def) * load.nodes)};
}

double most_operations(const palpate_scene& scene, double) {
  return most_links(scene.def) * (40 + 8.0 * nodes_of_a_link(scene.def) * scene.def.max_contact_nodes);
}

palpate_status build(EffectBuild& build) {
  palpate_scene& scene = build.scene;
  SceneMemory& memory = build.reader.memory();
  auto* const links = memory.make<Links>();
  if (!links) return build.reader.no_memory("links");
  build.state = links;
  scene.touch.parts.ask(links);
  const LinkedOrgan organ = linked_organ(scene.def, scene.touch, scene.tensors.stiffness);
  return links->create(memory, organ, most_links(scene.def), build.pass) ? PALPATE_OK : build.reader.no_memory("links");
}

}  // namespace

constinit const Effect links_effect = {
    .name = "links",
    .order = 5,
    .def = effect_struct<palpate_links_def, palpate_init_links_def>("links_def"),
    .keys = kKeys,
    .needs = {},
    .uses = kUsesSurface | kUsesRest | kUsesDisplacements,
    .rows = rows,
    .pass = {"links", Half::touch, Pass::contact, predict, most_operations},
    .sections = add_sections,
    .build = build,
};

}  // namespace palpate

void palpate_init_links_def(palpate_links_def* def, size_t struct_bytes) {
  palpate_links_def defaults = {};
  defaults.part.effect = &palpate::links_effect;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

palpate_status palpate_scene_set_links(palpate_scene* scene, const palpate_link* links, int32_t count,
                                       palpate_error* error) {
  if (!scene) return palpate::fail(error, PALPATE_ERROR_ARGUMENT, 0, "scene must not be NULL");
  palpate::Links without;
  palpate::Links* const of_scene = palpate::links_of(scene);
  return (of_scene ? *of_scene : without).set(links, count, error);
}

const palpate_link_state* palpate_scene_link_state(const palpate_scene* scene, int32_t link) {
  const palpate::Links* const links = palpate::links_of(scene);
  return links ? links->state(link) : nullptr;
}

void palpate_init_link(palpate_link* link, size_t struct_bytes) {
  palpate_link defaults = {};
  defaults.id = -1;
  defaults.stiffness = defaults.breaking_force = INFINITY;
  palpate::write_host_struct(defaults, link, struct_bytes);
}
