#include "runtime/inside/effect.h"

#include "runtime/base/host_struct.h"
#include "runtime/inside/inside_field.h"
#include "runtime/large/body_reader.h"
#include "runtime/scene/effect_build.h"

namespace palpate {
namespace {

using formats::SectionId;

constexpr EffectKey kKeys[] = {{PALPATE_EFFECT_KEY(inside_effect, palpate_inside_def, inside), PALPATE_KEY_CHOICE, "",
                                "off, on", 0, PALPATE_INSIDE_ON}};
constexpr EffectNeed kNeeds[] = {
    {"shape", 1u << PALPATE_SHAPE_VOLUME,
     "inside needs the displacements of all nodes: take shape VOLUME, or leave inside OFF"}};

void add_sections(const palpate_scene_def& def, SectionList& sections) {
  sections.add({SectionId::nodes, SectionId::tetrahedra, SectionId::region, SectionId::young, SectionId::poisson,
                SectionId::provenance});
  if (key_number(def, "deformation") != 0) sections.add({SectionId::large_stiffening, SectionId::large_law});
  if (def.preload == PALPATE_PRELOAD_ON) sections.add({SectionId::preload_displacement});
}

palpate_pass_work predict(const palpate_scene& scene, const palpate_step_load&) {
  const auto& inside = *static_cast<const InsideField*>(scene.state_of(inside_effect));
  return {0, 0, 50.0 * inside.tetrahedra() + 50.0 * inside.nodes()};
}

palpate_status build_field(const SectionReader& reader, const palpate_scene_def& def, SceneMemory& scratch,
                           InsideField& inside) {
  const SectionReader of_scratch(reader.bundle(), scratch, reader.error());
  const char* const effect = "inside ON";
  const bool large = key_number(def, "deformation") != 0;
  HyperelasticBody body;
  TissueLaw* const laws = scratch.array<TissueLaw>(reader.counts().regions);
  if (!laws) return reader.no_memory("inside");
  const double* preload = nullptr;
  palpate_status status = read_body(reader, effect, &body, laws);
  if (status == PALPATE_OK && large) status = read_laws(reader, effect, laws);
  if (status == PALPATE_OK) status = read_tetrahedra(of_scratch, &body);
  if (status == PALPATE_OK) status = reader.map_preload(def, &preload);
  if (status != PALPATE_OK) return status;
  double gradient[3][3];
  for (std::int32_t e = 0; e < body.tetrahedron_count; ++e)
    if (!(shape_gradients(body, e, gradient) > 0))
      return reader.not_usable(SectionId::tetrahedra, 4 * static_cast<std::uint64_t>(e));
  for (std::int64_t i = 0; preload && i < 3 * static_cast<std::int64_t>(body.node_count); ++i)
    if (!(std::fabs(preload[i]) <= 1e6))
      return reader.not_usable(SectionId::preload_displacement, static_cast<std::uint64_t>(i));
  return inside.create(reader.memory(), body, large, preload) ? PALPATE_OK : reader.no_memory("inside");
}

palpate_status build(EffectBuild& build) {
  auto* const inside = build.reader.memory().make<InsideField>();
  if (!inside) return build.reader.no_memory("inside");
  build.state = inside;
  SceneMemory scratch = build.reader.memory().of_same_host();
  const palpate_status status = build_field(build.reader, build.scene.def, scratch, *inside);
  scratch.release_all();
  return status;
}

}  // namespace

constinit const Effect inside_effect = {
    .name = "inside",
    .order = 11,
    .def = effect_struct<palpate_inside_def, palpate_init_inside_def>("inside_def"),
    .keys = kKeys,
    .needs = kNeeds,
    .creates = "tetrahedra of the inside",
    .pass = {"inside: strain and stress", Half::shape, Pass::positions, predict},
    .sections = add_sections,
    .build = build,
};

}  // namespace palpate

void palpate_init_inside_def(palpate_inside_def* def, size_t struct_bytes) {
  palpate_inside_def defaults = {};
  defaults.part.effect = &palpate::inside_effect;
  defaults.inside = PALPATE_INSIDE_ON;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

void palpate_init_inside_out(palpate_inside_out* out, size_t struct_bytes) {
  palpate::write_host_struct(palpate_inside_out{}, out, struct_bytes);
}
