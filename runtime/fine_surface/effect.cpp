#include "runtime/fine_surface/effect.h"

#include "runtime/base/host_struct.h"
#include "runtime/fine_surface/fine_surface.h"
#include "runtime/scene/effect_build.h"

namespace palpate {
namespace {

constexpr EffectKey kKeys[] = {{"fine_surface", &fine_surface_effect, offsetof(palpate_fine_surface, positions),
                                sizeof(palpate_fine_surface::positions), PALPATE_KEY_POINTER, "", "", 0, 1}};

const char* check(const palpate_scene_def& def) {
  return def.collision == PALPATE_COLLISION_OFF && key_number(def, "queries") == 0
             ? "tools and queries meet the fine_surface, and collision and queries are OFF"
             : nullptr;
}

void add_sections(const palpate_scene_def& def, SectionList& sections) {
  sections.add_rest(def);
}

palpate_status bind(const SectionReader& reader, const palpate_scene_def& def, SceneMemory& scratch,
                    TouchState& touch) {
  FineSurface::Mesh mesh = {nullptr, nullptr, touch.surface.triangles, reader.surface_nodes(), reader.triangles()};
  const double* position = nullptr;
  if (const palpate_status status = reader.map(formats::SectionId::nodes, &position)) return status;
  if (const palpate_status status = reader.map_preload(def, &mesh.preload)) return status;
  if (const palpate_status status =
          reader.sum_positions(position, nullptr, reader.counts().surface_nodes, scratch, &mesh.nodes))
    return status;
  auto* const fine = reader.memory().make<FineSurface>();
  if (!fine) return reader.no_memory("fine surface");
  touch.surface.bound = fine;
  return fine->bind(reader.memory(), scratch, part_of<palpate_fine_surface>(def, fine_surface_effect), mesh,
                    touch.surface.rest, reader.error());
}

palpate_status prepare(EffectBuild& build) {
  SceneMemory scratch = build.reader.memory().of_same_host();
  const palpate_status status = bind(build.reader, build.scene.def, scratch, build.scene.touch);
  scratch.release_all();
  return status;
}

}  // namespace

constinit const Effect fine_surface_effect = {
    .name = "fine surface",
    .order = 1,
    .def = effect_struct<palpate_fine_surface, palpate_init_fine_surface>("fine_surface"),
    .keys = kKeys,
    .needs = {},
    .check = check,
    .uses = kUsesRest,
    .creates = "fine surface on the mesh",
    .pass = {},
    .sections = add_sections,
    .prepare = prepare,
};

}  // namespace palpate

void palpate_init_fine_surface(palpate_fine_surface* surface, size_t struct_bytes) {
  palpate_fine_surface defaults = {};
  defaults.part.effect = &palpate::fine_surface_effect;
  palpate::write_host_struct(defaults, surface, struct_bytes);
}
