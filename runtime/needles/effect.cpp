#include "runtime/needles/effect.h"

#include "runtime/base/host_struct.h"
#include "runtime/large/body_reader.h"
#include "runtime/needles/needle.h"
#include "runtime/scene/effect_build.h"
#include "runtime/scene/needs.h"

namespace palpate {
namespace {

using formats::SectionId;

constexpr EffectKey kKeys[] = {
    {PALPATE_EFFECT_KEY(needles_effect, palpate_needles_def, needles), PALPATE_KEY_FLAG, "", "", 0, 1},
    {PALPATE_EFFECT_KEY(needles_effect, palpate_needles_def, needle_places), PALPATE_KEY_COUNT, "", "", 2,
     NeedleInTissue::kMostPlaces},
};

std::int32_t places_of(const palpate_scene_def& def) {
  return part_of<palpate_needles_def>(def, needles_effect).needle_places;
}

RowBudget rows(const palpate_scene_def& def) {
  return {def.max_tools * Needles::constraints_of_one(places_of(def)),
          def.max_tools * Needles::nodes_of_one(places_of(def)), 0};
}

void add_sections(const palpate_scene_def&, SectionList& sections) {
  sections.add({SectionId::nodes, SectionId::tetrahedra, SectionId::region, SectionId::young, SectionId::poisson,
                SectionId::corridor_nodes, SectionId::corridor_compliance, SectionId::corridor_surface});
}

palpate_pass_work predict(const palpate_scene&, const palpate_step_load& load) {
  return {0, 0, 500 + 50.0 * load.nodes};
}

double most_operations(const palpate_scene& scene, double change) {
  const palpate_scene_def& def = scene.def;
  return change + def.max_tools * static_cast<double>(Needles::operations(places_of(def), def.max_contact_nodes));
}

palpate_status map_corridor_rows(const SectionReader& reader, SectionId id, std::int32_t nodes,
                                 DisplacementRows* rows) {
  const float* numbers = nullptr;
  if (const palpate_status status = reader.map_for("needles", id, &numbers)) return status;
  rows->numbers = numbers, rows->nodes = nodes;
  return PALPATE_OK;
}

// The columns of the bundle's corridor become those of the scene.
palpate_status read_corridor(const SectionReader& reader, const std::int32_t* touchable, Corridor* corridor,
                             ShapeState* interior, Tensors* tensors) {
  const char* const effect = "needles";
  if (!reader.find(SectionId::corridor_nodes))
    return fail(reader.error(), PALPATE_ERROR_EFFECT, 0,
                "needles need a corridor (section corridor/nodes), which this bundle does not have; add a [[corridor]] "
                "to the boundary file and precompute the bundle again, or leave needles off");
  const std::uint64_t count = reader.counts().corridor;
  palpate_status status = reader.copy_indices(SectionId::corridor_nodes, count,
                                              &formats::IndexedSections::corridor_nodes, &corridor->nodes);
  if (status == PALPATE_OK) status = reader.map_for(effect, SectionId::corridor_compliance, &corridor->compliance);
  if (status == PALPATE_OK)
    status = map_corridor_rows(reader, SectionId::corridor_surface, reader.surface_nodes(), &corridor->surface);
  if (status != PALPATE_OK) return status;
  corridor->count = static_cast<std::int32_t>(count), corridor->node_of_column = touchable;
  tensors->corridor = corridor;
  if (!interior) return PALPATE_OK;
  const auto inside = static_cast<std::int32_t>(reader.counts().nodes - reader.counts().surface_nodes);
  return map_corridor_rows(reader, SectionId::corridor_interior, inside, &interior->corridor_interior);
}

palpate_status prepare(EffectBuild& build) {
  palpate_scene& scene = build.scene;
  ShapeState* const interior = has_interior_shape(scene) ? &scene.shape : nullptr;
  return read_corridor(build.reader, scene.touchable, &scene.corridor, interior, &scene.tensors);
}

palpate_status create(const SectionReader& reader, palpate_scene& scene, Pass pass, SceneMemory& scratch,
                      Needles& needles) {
  const palpate_scene_def& def = scene.def;
  TouchState& touch = scene.touch;
  HyperelasticBody body;
  TissueLaw* const laws = scratch.array<TissueLaw>(reader.counts().regions);
  if (!laws) return reader.no_memory("needles");
  Needles::Source source;
  palpate_status status = read_body(reader, "needles", &body, laws);
  if (status == PALPATE_OK) status = read_tetrahedra(reader, &body);
  if (status == PALPATE_OK) status = reader.map(SectionId::young, &source.young);
  if (status == PALPATE_OK) status = reader.map(SectionId::poisson, &source.poisson);
  if (status == PALPATE_OK) status = reader.read_rest(def, reader.counts().nodes, &source.geometry.nodes);
  if (status != PALPATE_OK) return status;
  touch.surface.rest_of_all = source.geometry.nodes;
  source.geometry.tetrahedra = body.tetrahedra, source.geometry.tetrahedron_count = body.tetrahedron_count;
  source.region = body.region, source.triangles = touch.surface.triangles,
  source.column_of_node = touch.surface.column_of_node;
  source.tensors = &scene.tensors, source.field = &touch.displacement;
  source.most_places = places_of(def), source.max_tools = def.max_tools;
  source.pass = pass;
  return needles.create(reader.memory(), source) ? PALPATE_OK : reader.no_memory("needles");
}
bool is_sound_needle(const palpate_needle& needle, const InputLimits& limits) {
  constexpr double most = 1e6, off = 1e-3;
  const auto up_to = [](double x, double end) { return x >= 0 && x <= end; };
  return is_sound_place(needle.triangle, needle.barycentric, limits) && is_sound_point(needle.tip) &&
         std::fabs(length(load3(needle.direction)) - 1) <= off && needle.radius > 0 && needle.radius <= 0.01 &&
         up_to(needle.friction, most) && up_to(needle.cutting_force, most) && up_to(needle.puncture_force, most) &&
         needle.spacing >= 1e-4 && needle.spacing <= 1;
}

constexpr ToolPart kNeedle =
    tool_part<palpate_needle, palpate_init_needle, is_sound_needle>(kNeedlePart, &needles_effect, false);

palpate_status build(EffectBuild& build) {
  SceneMemory& memory = build.reader.memory();
  auto* const needles = memory.make<Needles>();
  if (!needles) return build.reader.no_memory("needles");
  build.state = needles;
  build.scene.touch.parts.ask(needles);
  if (!build.scene.touch.input.read_part(memory, kNeedle)) return build.reader.no_memory("needles");
  SceneMemory scratch = memory.of_same_host();
  const palpate_status status = create(build.reader, build.scene, build.pass, scratch, *needles);
  scratch.release_all();
  return status;
}

}  // namespace

constinit const Effect needles_effect = {
    .name = "needles",
    .order = 3,
    .def = effect_struct<palpate_needles_def, palpate_init_needles_def>("needles_def"),
    .keys = kKeys,
    .needs = {},
    .uses = kUsesRest | kUsesDisplacements | kUsesSlideEnergy,
    .rows = rows,
    .pass = {"needles", Half::touch, Pass::contact, predict, most_operations},
    .sections = add_sections,
    .build = build,
    .prepare = prepare,
};

}  // namespace palpate

void palpate_init_needles_def(palpate_needles_def* def, size_t struct_bytes) {
  palpate_needles_def defaults = {};
  defaults.part.effect = &palpate::needles_effect;
  defaults.needles = 1;
  defaults.needle_places = 32;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

const palpate_needle_state* palpate_scene_needle_state(const palpate_scene* scene, int32_t id) {
  if (!scene) return nullptr;
  const auto* const needles = static_cast<const palpate::Needles*>(scene->state_of(palpate::needles_effect));
  const std::int32_t t = needles ? scene->touch.input.place_of(id) : -1;
  return t < 0 ? nullptr : &needles->state(t);
}

void palpate_init_needle(palpate_needle* needle, size_t struct_bytes) {
  palpate_needle defaults = {};
  defaults.part.effect = &palpate::needles_effect;
  defaults.triangle = -1;
  defaults.spacing = 5e-3;
  palpate::write_host_struct(defaults, needle, struct_bytes);
}
