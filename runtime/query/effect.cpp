#include "runtime/query/effect.h"

#include "runtime/base/host_struct.h"
#include "runtime/query/surface_query.h"
#include "runtime/scene/effect_build.h"
#include "runtime/scene/surface_trees.h"

namespace palpate {
namespace {

constexpr EffectKey kKeys[] = {{PALPATE_EFFECT_KEY(queries_effect, palpate_queries_def, queries), PALPATE_KEY_CHOICE,
                                "", "off, on", 0, PALPATE_QUERIES_ON}};

void add_sections(const palpate_scene_def& def, SectionList& sections) {
  sections.add_rest(def);
}

palpate_status build(EffectBuild& build) {
  const SectionReader& reader = build.reader;
  const palpate_scene& scene = build.scene;
  const palpate_scene_def& def = scene.def;
  SceneMemory& memory = reader.memory();
  auto* const query = memory.make<SurfaceQuery>();
  if (!query) return reader.no_memory("queries");
  build.state = query;
  const BoundSurface* const fine = scene.touch.surface.bound;
  const OffsetRows& motions = scene.touch.offset.rows();
  double reach = 1;
  const bool made =
      build_tree(memory, scene.touch, reader.surface_nodes(), query->tree()) &&
      set_reaches(reader, *scene.touch.body, scene.tensors, scene.touchable, fine, motions, query->tree(), &reach) &&
      query->create(memory, &scene.tensors, scene.touchable, def.max_contact_nodes, fine,
                    scene.touch.body->surface_field() != nullptr, scene.touch.body->added() ? reach : 0, motions,
                    reach);
  return made ? PALPATE_OK : reader.no_memory("queries");
}

}  // namespace

constinit const Effect queries_effect = {
    .name = "queries",
    .order = 8,
    .def = effect_struct<palpate_queries_def, palpate_init_queries_def>("queries_def"),
    .keys = kKeys,
    .needs = {},
    .uses = kUsesRest | kUsesHeldSurface,
    .creates = "surface for queries",
    .pass = {},
    .sections = add_sections,
    .build = build,
};

}  // namespace palpate

void palpate_init_queries_def(palpate_queries_def* def, size_t struct_bytes) {
  palpate_queries_def defaults = {};
  defaults.part.effect = &palpate::queries_effect;
  defaults.queries = PALPATE_QUERIES_ON;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

void palpate_init_surface_hit(palpate_surface_hit* hit, size_t struct_bytes) {
  palpate_surface_hit defaults = {};
  defaults.triangle = -1;
  palpate::write_host_struct(defaults, hit, struct_bytes);
}
