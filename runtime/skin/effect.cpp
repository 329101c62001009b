#include "runtime/skin/effect.h"

#include "runtime/base/alignment.h"
#include "runtime/base/host_struct.h"
#include "runtime/scene/effect_build.h"
#include "runtime/skin/skin.h"

namespace palpate {
namespace {

using formats::SectionId;

// nullptr where the scene has no render mesh.
Skin* skin_of(const palpate_scene* scene) {
  return scene ? static_cast<Skin*>(scene->state_of(skin_effect)) : nullptr;
}

// ---- the render mesh -------------------------------------------------------------------------------------------------

constexpr EffectKey kSkinKeys[] = {{"render_mesh", &skin_effect, offsetof(palpate_render_mesh, positions),
                                    sizeof(palpate_render_mesh::positions), PALPATE_KEY_POINTER, "", "", 0, 1}};
constexpr EffectNeed kSkinNeeds[] = {{"shape", 1u << PALPATE_SHAPE_SURFACE | 1u << PALPATE_SHAPE_VOLUME,
                                      "render_mesh follows a shape, and shape is OFF"}};

void add_sections(const palpate_scene_def& def, SectionList& sections) {
  sections.add_rest(def);
}

// Every triangle adds to three bones, every vertex blends three bones.
palpate_pass_work predict_skin(const palpate_scene& scene, const palpate_step_load&) {
  const Skin& skin = *skin_of(&scene);
  const double vertices = skin.vertex_count(), triangles = skin.triangle_count(), nodes = skin.node_count();
  const double floats = skin.has_normals() ? 21 : 15;  // floats read and written for each vertex
  return {4 * (floats * vertices + 21 * triangles + 19 * nodes), 0, 9 * vertices + 12 * triangles};
}

// scratch: memory that the binding alone needs.
palpate_status bind(const SectionReader& reader, const palpate_scene& scene, SceneMemory& scratch, Skin& skin) {
  const palpate_scene_def& def = scene.def;
  const std::int32_t* triangles = scene.touch.surface.triangles;
  if (!triangles)
    if (const palpate_status status = reader.copy_indices(SectionId::triangles, 3 * reader.counts().triangles,
                                                          &formats::IndexedSections::triangles, &triangles))
      return status;
  const double *position = nullptr, *preload = nullptr, *meshed = nullptr;
  const float* preload_of_surface = nullptr;
  const std::uint64_t nodes = reader.counts().surface_nodes;
  if (const palpate_status status = reader.map(SectionId::nodes, &position)) return status;
  if (const palpate_status status = reader.map_preload(def, &preload)) return status;
  if (const palpate_status status = reader.sum_positions(position, nullptr, nodes, scratch, &meshed)) return status;
  if (preload)
    if (const palpate_status status =
            reader.sum_positions(preload, nullptr, nodes, reader.memory(), &preload_of_surface))
      return status;
  return skin.bind(reader.memory(), scratch, part_of<palpate_render_mesh>(def, skin_effect), meshed,
                   reader.surface_nodes(), preload_of_surface, triangles, reader.triangles(),
                   find_part(def, dent_effect) != nullptr, reader.error());
}

palpate_status build_skin(EffectBuild& build) {
  auto* const skin = build.reader.memory().make<Skin>();
  if (!skin) return build.reader.no_memory("render mesh");
  build.state = skin;
  SceneMemory scratch = build.reader.memory().of_same_host();
  const palpate_status status = bind(build.reader, build.scene, scratch, *skin);
  scratch.release_all();
  return status;
}

// ---- dents -----------------------------------------------------------------------------------------------------------

constexpr const char* kOfDiscs =
    "dent DISCS draws the discs of a report on a render mesh; set render_mesh, contact PATCH and report CONTACTS, or "
    "leave dent OFF";
constexpr EffectKey kDentKeys[] = {{PALPATE_EFFECT_KEY(dent_effect, palpate_dent_def, dent), PALPATE_KEY_CHOICE, "",
                                    "off, discs", 0, PALPATE_DENT_DISCS}};
constexpr EffectNeed kDentNeeds[] = {{"contact", 1u << PALPATE_CONTACT_PATCH, kOfDiscs},
                                     {"report", 1u << PALPATE_REPORT_CONTACTS, kOfDiscs},
                                     {"render_mesh", 1u << 1, kOfDiscs}};

// Every vertex is compared with the box around the discs; those inside look at each disc.
palpate_pass_work predict_dent(const palpate_scene& scene, const palpate_step_load& load) {
  const Skin& skin = *skin_of(&scene);
  const double vertices = skin.vertex_count(), discs = std::max(0, load.contacts - load.grips);
  if (discs == 0) return {0, 0, 10};
  return {12 * vertices, 0, 50 * discs + 2 * vertices + discs * skin.vertices_near_a_disc() * 60};
}

palpate_status build_dent(EffectBuild& build) {
  const bool made =
      skin_of(&build.scene)
          ->draw_dents(build.reader.memory(), &build.scene.touch.surface.measure, build.scene.def.max_points);
  return made ? PALPATE_OK : build.reader.no_memory("dent");
}

}  // namespace

constinit const Effect skin_effect = {
    .name = "render_mesh",
    .order = 9,
    .def = effect_struct<palpate_render_mesh, palpate_init_render_mesh>("render_mesh"),
    .keys = kSkinKeys,
    .needs = kSkinNeeds,
    .creates = "render mesh on the surface",
    .pass = {"skin: render mesh", Half::shape, Pass::positions, predict_skin},
    .sections = add_sections,
    .build = build_skin,
};

constinit const Effect dent_effect = {
    .name = "dent",
    .order = 10,
    .def = effect_struct<palpate_dent_def, palpate_init_dent_def>("dent_def"),
    .keys = kDentKeys,
    .needs = kDentNeeds,
    .pass = {"dent: discs", Half::shape, Pass::positions, predict_dent},
    .build = build_dent,
};

}  // namespace palpate

void palpate_init_dent_def(palpate_dent_def* def, size_t struct_bytes) {
  palpate_dent_def defaults = {};
  defaults.part.effect = &palpate::dent_effect;
  defaults.dent = PALPATE_DENT_DISCS;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

palpate_step_flags palpate_scene_skin(palpate_scene* scene, const palpate_shape_out* shape, palpate_skin_out* out) {
  palpate_skin_out wanted = {};
  palpate_shape_out shaped = {};
  if (!palpate::read_host_struct(out, &wanted)) return PALPATE_STEP_BAD_INPUT;
  out->vertex_count = wanted.vertex_count = 0;
  palpate::Skin* const skin = palpate::skin_of(scene);
  if (!skin || wanted.vertex_capacity < 0) return PALPATE_STEP_BAD_INPUT;
  if (!palpate::read_host_struct(shape, &shaped)) return PALPATE_STEP_BAD_INPUT;
  if (!shaped.displacements || shaped.node_count < skin->node_count()) return PALPATE_STEP_BAD_INPUT;
  for (const float* array : {shaped.displacements, wanted.positions, wanted.normals, wanted.disc_normals})
    if (!palpate::is_aligned(array)) return PALPATE_STEP_BAD_INPUT;
  if (wanted.normals && !skin->has_normals()) return PALPATE_STEP_BAD_INPUT;
  if (wanted.disc_normals && wanted.disc_capacity < 0) return PALPATE_STEP_BAD_INPUT;
  palpate_step_flags flags = skin->move(shaped.displacements, &wanted);
  out->vertex_count = wanted.vertex_count;
  scene->watch.ended(scene->pass_of(palpate::skin_effect));
  if (skin->draws_dents() && wanted.report) {
    flags |= skin->dent(&wanted);
    scene->watch.ended(scene->pass_of(palpate::dent_effect));
  }
  if (out->struct_bytes >= offsetof(palpate_skin_out, disc_count) + sizeof out->disc_count)
    out->disc_count = skin->draws_dents() && wanted.report ? wanted.disc_count : 0;
  return flags;
}

void palpate_init_render_mesh(palpate_render_mesh* mesh, size_t struct_bytes) {
  palpate_render_mesh defaults = {};
  defaults.part.effect = &palpate::skin_effect;
  palpate::write_host_struct(defaults, mesh, struct_bytes);
}

void palpate_init_skin_out(palpate_skin_out* out, size_t struct_bytes) {
  palpate::write_host_struct(palpate_skin_out{}, out, struct_bytes);
}
