#include "runtime/crossings/effect.h"

#include <algorithm>

#include "runtime/base/alignment.h"
#include "runtime/crossings/crossing_check.h"
#include "runtime/scene/effect_build.h"

namespace palpate {
namespace {

#define PALPATE_CROSSINGS_KEY(field) PALPATE_EFFECT_KEY(crossings_effect, palpate_crossings_def, field)
constexpr EffectKey kKeys[] = {
    {PALPATE_CROSSINGS_KEY(crossings), PALPATE_KEY_CHOICE, "", "off, on", 0, PALPATE_CROSSINGS_ON},
    {PALPATE_CROSSINGS_KEY(crossings_calls), PALPATE_KEY_COUNT, "", "", 1, 1'000'000},
    {PALPATE_CROSSINGS_KEY(crossings_operations), PALPATE_KEY_COUNT, "", "", 1000, 1'000'000'000},
};
constexpr EffectNeed kNeeds[] = {
    {"shape", 1u << PALPATE_SHAPE_SURFACE | 1u << PALPATE_SHAPE_VOLUME,
     "crossings are those of a shape: take shape SURFACE or VOLUME, or leave crossings OFF"}};

CrossingCheck* check_of(const palpate_scene* scene) {
  return scene ? static_cast<CrossingCheck*>(scene->state_of(crossings_effect)) : nullptr;
}

void add_sections(const palpate_scene_def&, SectionList& sections) {
  sections.add_surface();
}

palpate_pass_work predict(const palpate_scene& scene, const palpate_step_load&) {
  return {0, 0, static_cast<double>(check_of(&scene)->operations())};
}

palpate_status build(EffectBuild& build) {
  SceneMemory& memory = build.reader.memory();
  auto* const check = memory.make<CrossingCheck>();
  build.state = check;
  const TouchedSurface& surface = build.scene.touch.surface;
  return check && check->create(memory, surface.rest, build.reader.surface_nodes(), build.scene.shape.surface,
                                part_of<palpate_crossings_def>(build.scene.def, crossings_effect))
             ? PALPATE_OK
             : build.reader.no_memory("crossings");
}

}  // namespace

constinit const Effect crossings_effect = {
    .name = "crossings",
    .order = 15,
    .def = effect_struct<palpate_crossings_def, palpate_init_crossings_def>("crossings_def"),
    .keys = kKeys,
    .needs = kNeeds,
    .uses = kUsesRest,
    .pass = {"crossings: surface against itself", Half::shape, Pass::positions, predict},
    .sections = add_sections,
    .build = build,
};

}  // namespace palpate

void palpate_init_crossings_def(palpate_crossings_def* def, size_t struct_bytes) {
  palpate_crossings_def defaults = {};
  defaults.part.effect = &palpate::crossings_effect;
  defaults.crossings = PALPATE_CROSSINGS_ON;
  defaults.crossings_calls = 60, defaults.crossings_operations = 60'000;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

void palpate_init_crossings_out(palpate_crossings_out* out, size_t struct_bytes) {
  palpate::write_host_struct(palpate_crossings_out{}, out, struct_bytes);
}

palpate_step_flags palpate_scene_crossings(palpate_scene* scene, const palpate_shape_out* shape,
                                           palpate_crossings_out* out) {
  palpate_crossings_out wanted = {};
  if (out && !palpate::read_host_struct(out, &wanted)) return PALPATE_STEP_BAD_INPUT;
  if (out) out->count = 0;
  palpate::CrossingCheck* const check = palpate::check_of(scene);
  if (!check || wanted.capacity < 0 || !palpate::is_aligned(wanted.crossings)) return PALPATE_STEP_BAD_INPUT;
  palpate_shape_out shaped = {};
  if (!palpate::read_host_struct(shape, &shaped) || shaped.node_count < check->nodes() || !shaped.positions ||
      !palpate::is_aligned(shaped.positions))
    return PALPATE_STEP_BAD_INPUT;
  palpate_step_flags flags = check->go_on(shaped.positions) ? 0 : PALPATE_STEP_BAD_INPUT;
  if (check->pairs() > 0) flags |= PALPATE_STEP_SURFACE_CROSSES;
  if (out) {
    out->pairs = check->pairs(), out->checks = check->checks();
    if (wanted.crossings) out->count = std::min({check->pairs(), check->kMostKept, wanted.capacity});
    std::copy_n(check->kept(), out->count, wanted.crossings);
  }
  scene->watch.ended(scene->pass_of(palpate::crossings_effect));
  return flags;
}
