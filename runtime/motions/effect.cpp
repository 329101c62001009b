#include "runtime/motions/effect.h"

#include <algorithm>
#include <cmath>

#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"
#include "runtime/motions/motions.h"
#include "runtime/scene/effect_build.h"
#include "runtime/scene/needs.h"

namespace palpate {
namespace {

using formats::SectionId;

constexpr EffectKey kKeys[] = {
    {PALPATE_EFFECT_KEY(motions_effect, palpate_motions_def, motions), PALPATE_KEY_FLAG, "", "", 0, 1}};
constexpr EffectNeed kNeeds[] = {
    {"collision", 1u << PALPATE_COLLISION_OFF | 1u << PALPATE_COLLISION_DEFORMED,
     "tools meet an organ that moves where it is: take collision DEFORMED, or OFF, or leave motions at 0"}};

void add_sections(const palpate_scene_def& def, SectionList& sections) {
  sections.add({SectionId::motion_kinds, SectionId::motion_surface});
  if (def.shape == PALPATE_SHAPE_VOLUME || key_number(def, "deformation") != 0)
    sections.add({SectionId::motion_interior});
  sections.add({SectionId::motion_volume});
  if (key_number(def, "deformation") != 0) sections.add({SectionId::motion_pressed, SectionId::triangles});
}

// With the targets of the contacts, which the pass of the contacts finds.
palpate_pass_work predict(const palpate_scene& scene, const palpate_step_load& load) {
  return {0, 0, 20 + scene.touch.offset.count() * (6 + 3.0 * load.nodes)};
}

palpate_status read_rows(const SectionReader& reader, SectionId id, std::int32_t nodes, OffsetRows* out) {
  if (const palpate_status status = reader.map_for("motions", id, &out->numbers)) return status;
  out->count = static_cast<std::int32_t>(reader.counts().motions), out->nodes = nodes;
  const std::size_t numbers = 3 * static_cast<std::size_t>(out->count) * static_cast<std::size_t>(nodes);
  for (std::size_t i = 0; i < numbers; ++i)
    if (!(std::fabs(out->numbers[i]) <= 1e12f)) return reader.not_usable(id, i);
  return PALPATE_OK;
}

palpate_status read_kinds_and_volumes(const SectionReader& reader, Motions::Source* source) {
  const std::uint64_t m = reader.counts().motions;
  if (const palpate_status status =
          reader.copy_indices(SectionId::motion_kinds, m, &formats::IndexedSections::motion_kinds, &source->kind))
    return status;
  if (reader.find(SectionId::motion_volume)) {
    if (const palpate_status status = reader.map(SectionId::motion_volume, &source->volume)) return status;
    for (std::uint64_t i = 0; i < m * m; ++i)
      if (!(std::fabs(source->volume[i]) <= 1e12)) return reader.not_usable(SectionId::motion_volume, i);
  }
  for (std::uint64_t i = 0; i < m; ++i)
    if (static_cast<formats::MotionKind>(source->kind[i]) == formats::MotionKind::pressure &&
        (!source->volume || !(source->volume[i * m + i] > 0)))
      return source->volume ? reader.not_usable(SectionId::motion_volume, i * m + i)
                            : reader.missing("motions", SectionId::motion_volume);
  return PALPATE_OK;
}

palpate_status tell_volumes(const SectionReader& reader, const std::int32_t* kind, OffsetRows* rows) {
  auto* const forces = reader.memory().array<RowForce>(static_cast<std::size_t>(rows->count));
  if (!forces) return reader.no_memory("motions");
  for (std::int32_t m = 0; m < rows->count; ++m)
    forces[m].in_volume = static_cast<formats::MotionKind>(kind[m]) == formats::MotionKind::gravity;
  rows->force = forces;
  return PALPATE_OK;
}

// The triangles of each pressure, for a body on whose surface it acts as that is.
palpate_status read_surfaces(const SectionReader& reader, OffsetRows* rows) {
  if (!reader.find(SectionId::motion_pressed)) return PALPATE_OK;
  formats::IndexedSections sections;
  if (const palpate_status status = reader.map(SectionId::motion_pressed, &sections.motion_pressed)) return status;
  if (const palpate_status status = reader.check(sections)) return status;
  const auto count_of_triangles = static_cast<std::uint64_t>(reader.triangles());
  const std::int32_t* triangles = nullptr;
  if (const palpate_status status = reader.copy_indices(SectionId::triangles, 3 * count_of_triangles,
                                                        &formats::IndexedSections::triangles, &triangles))
    return status;
  const std::uint8_t* pressed = sections.motion_pressed;
  auto* const pieces = reader.memory().array<RowPressure>(static_cast<std::size_t>(rows->count));
  if (!pieces) return reader.no_memory("motions");
  for (std::int32_t m = 0; m < rows->count; ++m, pressed += reader.triangles()) {
    const auto count = std::count(pressed, pressed + reader.triangles(), std::uint8_t{1});
    auto* const corners = reader.memory().array<std::int32_t>(3 * static_cast<std::size_t>(count));
    if (!corners) return reader.no_memory("motions");
    pieces[m] = {corners, static_cast<std::int32_t>(count)};
    std::int32_t* to = corners;
    for (std::int32_t t = 0; t < reader.triangles(); ++t)
      if (pressed[t]) to = std::copy_n(triangles + 3 * t, 3, to);
  }
  rows->pressure = pieces;
  return PALPATE_OK;
}

palpate_status prepare(EffectBuild& build) {
  const SectionReader& reader = build.reader;
  palpate_scene& scene = build.scene;
  auto* const motions = reader.memory().make<Motions>();
  if (!motions) return reader.no_memory("motions");
  build.state = motions;
  OffsetRows rows;
  if (const palpate_status status = read_rows(reader, SectionId::motion_surface, reader.surface_nodes(), &rows))
    return status;
  Motions::Source source;
  source.offset = &scene.touch.offset, source.count = rows.count, source.pass = build.pass;
  if (const palpate_status status = read_kinds_and_volumes(reader, &source)) return status;
  if (const palpate_status status = tell_volumes(reader, source.kind, &rows)) return status;
  source.is_linear = scene.touch.body->responds_linearly(), source.is_whole = key_number(scene.def, "cut") == 0;
  const auto inside = static_cast<std::int32_t>(reader.counts().nodes - reader.counts().surface_nodes);
  if (asks_inside(scene) && inside > 0) {
    OffsetRows of_interior;
    if (const palpate_status status = read_rows(reader, SectionId::motion_interior, inside, &of_interior))
      return status;
    rows.inside = of_interior.numbers, rows.nodes_inside = inside;
  }
  if (!source.is_linear) {
    if (const palpate_status status = read_surfaces(reader, &rows)) return status;
    source.has_surfaces = rows.pressure != nullptr;
    scene.touch.offset.take_volumes(source.volume, source.count);
  }
  if (scene.touch.offset.add(reader.memory(), rows) != 0 || !motions->create(reader.memory(), source))
    return reader.no_memory("motions");
  scene.touch.parts.add(motions);
  return PALPATE_OK;
}

Motions* motions_of(const palpate_scene* scene) {
  return scene ? static_cast<Motions*>(scene->state_of(motions_effect)) : nullptr;
}

palpate_status refuse_without_motions(palpate_error* error) {
  return fail(error, PALPATE_ERROR_ARGUMENT, 0,
              "motions: expected a scene with motions, found %s; create the scene with motions = 1", "none");
}

}  // namespace

constinit const Effect motions_effect = {
    .name = "motions",
    .order = 4,
    .def = effect_struct<palpate_motions_def, palpate_init_motions_def>("motions_def"),
    .keys = kKeys,
    .needs = kNeeds,
    .pass = {"motions", Half::touch, Pass::input, predict},
    .sections = add_sections,
    .prepare = prepare,
};

}  // namespace palpate

void palpate_init_motions_def(palpate_motions_def* def, size_t struct_bytes) {
  palpate_motions_def defaults = {};
  defaults.part.effect = &palpate::motions_effect;
  defaults.motions = 1;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

palpate_status palpate_scene_set_motions(palpate_scene* scene, const double* amounts, int32_t count,
                                         palpate_error* error) {
  palpate::Motions* const motions = palpate::motions_of(scene);
  return motions ? motions->set(amounts, count, error) : palpate::refuse_without_motions(error);
}

palpate_status palpate_scene_hold_volume(palpate_scene* scene, int32_t motion, int32_t holds, double volume,
                                         palpate_error* error) {
  palpate::Motions* const motions = palpate::motions_of(scene);
  return motions ? motions->hold_volume(motion, holds != 0, volume, error) : palpate::refuse_without_motions(error);
}

const palpate_motion_state* palpate_scene_motion_state(const palpate_scene* scene, int32_t motion) {
  const palpate::Motions* const motions = palpate::motions_of(scene);
  return motions ? motions->state(motion) : nullptr;
}
