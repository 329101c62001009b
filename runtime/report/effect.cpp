#include "runtime/report/effect.h"

#include "runtime/base/host_struct.h"
#include "runtime/report/report_contacts.h"
#include "runtime/scene/effect_build.h"
#include "runtime/scene/surface_trees.h"

namespace palpate {
namespace {

constexpr EffectKey kKeys[] = {{PALPATE_EFFECT_KEY(report_effect, palpate_report_def, report), PALPATE_KEY_CHOICE, "",
                                "off, contacts", 0, PALPATE_REPORT_CONTACTS}};

void add_sections(const palpate_scene_def&, SectionList& sections) {
  sections.add_surface();
}

palpate_pass_work predict(const palpate_scene& scene, const palpate_step_load& load) {
  return {0, 0,
          static_cast<double>(
              ContactReport::operations(load.points, load.contacts, load.nodes, scene.touch.surface.bound != nullptr))};
}

palpate_status build(EffectBuild& build) {
  TouchState& touch = build.scene.touch;
  SceneMemory& memory = build.reader.memory();
  auto* const report = memory.make<StepReport>();
  if (!report) return build.reader.no_memory("report");
  build.state = report;
  touch.parts.add(report);
  return report->create(memory, build.scene.def, touch.surface.rest, touch.surface.triangles, touch.surface.bound,
                        &touch.displacement, build.pass)
             ? PALPATE_OK
             : build.reader.no_memory("report");
}

}  // namespace

constinit const Effect report_effect = {
    .name = "report",
    .order = 7,
    .def = effect_struct<palpate_report_def, palpate_init_report_def>("report_def"),
    .keys = kKeys,
    .needs = {},
    .uses = kUsesRest | kUsesDisplacements,
    .pass = {"report: contacts", Half::touch, Pass::output, predict},
    .sections = add_sections,
    .build = build,
};

}  // namespace palpate

void palpate_init_report_def(palpate_report_def* def, size_t struct_bytes) {
  palpate_report_def defaults = {};
  defaults.part.effect = &palpate::report_effect;
  defaults.report = PALPATE_REPORT_CONTACTS;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

const palpate_contact_report* palpate_scene_report(const palpate_scene* scene) {
  if (!scene) return nullptr;
  const auto* const report = static_cast<const palpate::StepReport*>(scene->state_of(palpate::report_effect));
  return report ? report->report() : nullptr;
}
