#include "runtime/force_control/effect.h"

#include <cmath>

#include "runtime/base/host_struct.h"
#include "runtime/force_control/force_control.h"
#include "runtime/scene/effect_build.h"

namespace palpate {
namespace {

constexpr EffectKey kKeys[] = {{PALPATE_EFFECT_KEY(force_control_effect, palpate_force_control_def, force_control),
                                PALPATE_KEY_FLAG, "", "", 0, 1}};

constexpr double kLargestForce = 1e6;  // N

bool is_sound_force(const palpate_given_force& given, const InputLimits&) {
  for (const double force : given.force)
    if (!(std::fabs(force) <= kLargestForce)) return false;
  return given.speed > 0;
}

constexpr ToolPart kForce = alone(
    tool_part<palpate_given_force, palpate_init_given_force, is_sound_force>(kForcePart, &force_control_effect, false));

// A correction measures three numbers of stiffness for each tool, and the step is solved once more.
palpate_pass_work predict(const palpate_scene& scene, const palpate_step_load& load) {
  return {0, 0, 50.0 * scene.def.max_tools + 3.0 * load.rows * load.rows};
}

palpate_status build(EffectBuild& build) {
  palpate_scene& scene = build.scene;
  SceneMemory& memory = build.reader.memory();
  auto* const control = memory.make<ForceControl>();
  if (!control) return build.reader.no_memory("force_control");
  build.state = control;
  scene.touch.parts.ask(control);
  const bool made = scene.touch.input.read_part(memory, kForce) &&
                    control->create(memory, &scene.touch, scene.def.max_tools,
                                    scene.touch.rows.set().constraint_capacity, build.pass);
  return made ? PALPATE_OK : build.reader.no_memory("force_control");
}

}  // namespace

constinit const Effect force_control_effect = {
    .name = "force_control",
    .order = 13,
    .def = effect_struct<palpate_force_control_def, palpate_init_force_control_def>("force_control_def"),
    .keys = kKeys,
    .needs = {},
    .pass = {"force control", Half::touch, Pass::contact, predict},
    .build = build,
};

}  // namespace palpate

void palpate_init_force_control_def(palpate_force_control_def* def, size_t struct_bytes) {
  palpate_force_control_def defaults = {};
  defaults.part.effect = &palpate::force_control_effect;
  defaults.force_control = 1;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

void palpate_init_given_force(palpate_given_force* force, size_t struct_bytes) {
  palpate_given_force defaults = {};
  defaults.part.effect = &palpate::force_control_effect;
  defaults.speed = 0.25;
  palpate::write_host_struct(defaults, force, struct_bytes);
}

const palpate_given_force_state* palpate_scene_given_force_state(const palpate_scene* scene, int32_t id) {
  if (!scene) return nullptr;
  const auto* const control = static_cast<const palpate::ForceControl*>(scene->state_of(palpate::force_control_effect));
  const std::int32_t t = control ? scene->touch.input.place_of(id) : -1;
  return t < 0 ? nullptr : &control->state(t);
}
