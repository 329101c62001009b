#include "runtime/grasps/effect.h"

#include <algorithm>

#include "runtime/base/host_struct.h"
#include "runtime/grasps/grasp.h"
#include "runtime/scene/build_scene.h"
#include "runtime/scene/effect_build.h"

namespace palpate {
namespace {

constexpr const char* kOfDiscs = "a grasp holds discs; take contact PATCH, or leave grasps at 0";
constexpr EffectKey kKeys[] = {
    {PALPATE_EFFECT_KEY(grasps_effect, palpate_grasps_def, grasps), PALPATE_KEY_FLAG, "", "", 0, 1}};
constexpr EffectNeed kNeeds[] = {{"contact", 1u << PALPATE_CONTACT_PATCH, kOfDiscs}};

// Of a disc: a wide one has the more nodes the more there is room for beside the points.
std::int32_t most_nodes(const palpate_scene_def& def) {
  const std::int32_t room = def.max_contact_nodes > 0 ? def.max_contact_nodes : kMostNodesByDefault;
  return std::clamp((room - nodes_of_points(def)) / (3 * def.max_tools), std::int32_t{GraspPatch::kFewNodes},
                    std::int32_t{GraspPatch::kMostNodes});
}

RowBudget rows(const palpate_scene_def& def) {
  return {6 * def.max_tools, 3 * most_nodes(def) * def.max_tools, def.max_tools};
}

void add_sections(const palpate_scene_def&, SectionList& sections) {
  sections.add_contacts();
}

palpate_pass_work predict(const palpate_scene&, const palpate_step_load& load) {
  return {0, 0, 20 + 10.0 * load.nodes};
}

// Of grasps that close.
double most_operations(const palpate_scene& scene, double change) {
  return scene.def.max_tools *
         (2 * change + static_cast<double>(Grasps::operations_to_close(scene.def.max_contact_nodes)));
}

bool is_sound_grasp(const palpate_grasp& grasp, const InputLimits& limits) {
  Pose pose;
  if (!is_sound_place(grasp.triangle, grasp.barycentric, limits)) return false;
  if (grasp.opposite_triangle != -1 && !is_sound_place(grasp.opposite_triangle, grasp.opposite_barycentric, limits))
    return false;
  return is_position(grasp.position) && read_pose(grasp.position, grasp.orientation, &pose) && grasp.radius > 0 &&
         grasp.radius <= 1 && grasp.closing >= 0 && grasp.closing <= 1 && grasp.friction >= 0 && grasp.clamp_force >= 0;
}

constexpr ToolPart kGrasp =
    tool_part<palpate_grasp, palpate_init_grasp, is_sound_grasp>(kGraspPart, &grasps_effect, true);

palpate_status build(EffectBuild& build) {
  palpate_scene& scene = build.scene;
  SceneMemory& memory = build.reader.memory();
  auto* const grasps = memory.make<Grasps>();
  if (!grasps) return build.reader.no_memory("grasps");
  build.state = grasps;
  scene.touch.parts.ask(grasps);
  const bool made = scene.touch.input.read_part(memory, kGrasp) &&
                    grasps->create(memory, scene.touch.surface.discs(), scene.def.max_tools, most_nodes(scene.def),
                                   &scene.touch.displacement, build.pass);
  return made ? PALPATE_OK : build.reader.no_memory("grasps");
}

}  // namespace

constinit const Effect grasps_effect = {
    .name = "grasps",
    .order = 2,
    .def = effect_struct<palpate_grasps_def, palpate_init_grasps_def>("grasps_def"),
    .keys = kKeys,
    .needs = kNeeds,
    .uses = kUsesDisplacements,
    .rows = rows,
    .pass = {"grasps", Half::touch, Pass::contact, predict, most_operations},
    .sections = add_sections,
    .build = build,
};

}  // namespace palpate

void palpate_init_grasps_def(palpate_grasps_def* def, size_t struct_bytes) {
  palpate_grasps_def defaults = {};
  defaults.part.effect = &palpate::grasps_effect;
  defaults.grasps = 1;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

const palpate_grasp_state* palpate_scene_grasp_state(const palpate_scene* scene, int32_t id) {
  if (!scene) return nullptr;
  const auto* const grasps = static_cast<const palpate::Grasps*>(scene->state_of(palpate::grasps_effect));
  const std::int32_t t = grasps ? scene->touch.input.place_of(id) : -1;
  return t < 0 ? nullptr : &grasps->state(t);
}

void palpate_init_grasp(palpate_grasp* grasp, size_t struct_bytes) {
  palpate_grasp defaults = {};
  defaults.part.effect = &palpate::grasps_effect;
  defaults.triangle = defaults.opposite_triangle = -1;
  defaults.orientation[0] = 1;
  defaults.friction = defaults.clamp_force = INFINITY;
  palpate::write_host_struct(defaults, grasp, struct_bytes);
}
