#include "runtime/links/effect.h"

#include "runtime/links/links.h"
#include "runtime/scene/effect_build.h"

namespace palpate {
namespace {

// nullptr where the scene may have none.
Links* links_of(const palpate_scene* scene) {
  return scene ? static_cast<Links*>(scene->state_of(links_effect)) : nullptr;
}

constexpr EffectKey kKeys[] = {{PALPATE_KEY(max_links), PALPATE_KEY_COUNT, "", "", 0, 1000}};
constexpr EffectNeed kNeeds[] = {
    {PALPATE_NEEDS(deformation), 1u << PALPATE_DEFORMATION_LINEAR,
     "links hold an organ of deformation LINEAR alone; leave max_links at 0, or take LINEAR"}};

RowBudget rows(const palpate_scene_def& def) {
  return {def.max_links, def.max_links * nodes_of_a_link(def), def.max_links};
}

void add_sections(const palpate_scene_def&, SectionList& sections) {
  sections.add_contacts();
}

// Every link as if it were slack and measured: the displacements of the nodes of both its ends by all contact nodes.
palpate_pass_work predict(const palpate_scene& scene, const palpate_step_load& load) {
  return {0, 0, links_of(&scene)->count() * (20 + 6.0 * nodes_of_a_link(scene.def) * load.nodes)};
}

double most_operations(const palpate_scene& scene, double) {
  return scene.def.max_links * (40 + 8.0 * nodes_of_a_link(scene.def) * scene.def.max_contact_nodes);
}

palpate_status build(EffectBuild& build) {
  palpate_scene& scene = build.scene;
  SceneMemory& memory = build.reader.memory();
  auto* const links = memory.make<Links>();
  if (!links) return build.reader.no_memory("links");
  build.state = links;
  const Links::Source source = {link_surface_of(scene.def, scene.touch, build.reader.triangles()),
                                scene.tensors.stiffness, &scene.touch.displacement, &scene.touch.offset, build.pass};
  scene.touch.ask(links);
  return links->create(memory, source, scene.def.max_links) ? PALPATE_OK : build.reader.no_memory("links");
}

}  // namespace

constinit const Effect links_effect = {
    .name = "links",
    .order = 5,
    .keys = kKeys,
    .needs = kNeeds,
    .uses = kUsesSurface | kUsesRest | kUsesDisplacements,
    .rows = rows,
    .pass = {"links", Half::touch, Pass::contact, predict, most_operations},
    .sections = add_sections,
    .build = build,
};

}  // namespace palpate

const palpate_effect* palpate_links_effect(void) {
  return &palpate::links_effect;
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
