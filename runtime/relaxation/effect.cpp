#include "runtime/relaxation/effect.h"

#include "runtime/base/host_struct.h"
#include "runtime/contact/touch_step.h"
#include "runtime/relaxation/prony_series.h"
#include "runtime/scene/effect_build.h"

namespace palpate {
namespace {

const palpate_relaxation_def& relaxation_of(const palpate_scene_def& def) {
  return part_of<palpate_relaxation_def>(def, relaxation_effect);
}

class Relaxation final : public StepPart {
 public:
  bool create(SceneMemory& memory, const palpate_scene_def& def, Pass pass) {
    series_.set(relaxation_of(def)), pass_ = pass;
    const std::size_t tools = static_cast<std::size_t>(def.max_tools);
    memory_ = memory.array<PronySeries::Memory>(tools);
    torque_memory_ = memory.array<PronySeries::Memory>(tools);
    memory.keep_array(memory_, tools);
    memory.keep_array(torque_memory_, tools);
    return !memory.failed();
  }

  void correct_forces(TouchStep& step) override {
    for (std::int32_t t = 0; t < step.state->input.count(); ++t)
      relax(t, step.state->input.tool(t), step.state->input.dt(), step.result[t]);
    step.context->watch.ended(pass_);
  }
  void forget_tool(std::int32_t t) override { memory_[t] = torque_memory_[t] = PronySeries::Memory{}; }

 private:
  // After a fast retreat the relaxed part may exceed the elastic force and so pull the tool in: such a force is zero, unless the
  // tool holds the organ. Relaxation is linear in the force, so the torque, a sum of forces times levers, relaxes alike.
  void relax(std::int32_t t, const Tool& tool, double dt, ToolResult& result) {
    const Vec3 elastic = result.raw, elastic_torque = result.raw_torque;
    if (!is_finite(elastic) || !is_finite(elastic_torque)) return;
    result.raw = series_.step(memory_[t], elastic, dt);
    if (tool.has_torque) result.raw_torque = series_.step(torque_memory_[t], elastic_torque, dt);
    if (result.is_inside) return;
    const bool touches = result.touches || result.sum.contacts > 0;
    if (touches && (tool.pulls || !(dot(result.raw, elastic) < 0))) return;
    result.raw = result.raw_torque = Vec3{};
  }

  PronySeries series_;
  Pass pass_ = Pass::count;
  PronySeries::Memory *memory_ = nullptr, *torque_memory_ = nullptr;  // [max_tools]
};

#define PALPATE_RELAXATION_KEY(field) "relaxation." PALPATE_EFFECT_KEY(relaxation_effect, palpate_relaxation_def, field)
constexpr EffectKey kKeys[] = {
    {PALPATE_RELAXATION_KEY(terms), PALPATE_KEY_COUNT, "", "", 0, PALPATE_MAX_RELAXATION_TERMS},
    {PALPATE_RELAXATION_KEY(share), PALPATE_KEY_NUMBER, "1", "", 0, 1},
    {PALPATE_RELAXATION_KEY(time), PALPATE_KEY_NUMBER, "s", "", kAboveZero, kNoLimit},
};
constexpr EffectNeed kNeeds[] = {
    {"force", 1u << PALPATE_FORCE_LINEAR | 1u << PALPATE_FORCE_RESPONSE,
     "relaxation acts on a force, and force is OFF"},
};

const char* check(const palpate_scene_def& def) {
  if (PronySeries().set(relaxation_of(def))) return nullptr;
  return "relaxation needs shares of 0 and above that sum to less than 1, and times above 0 s";
}

palpate_pass_work predict(const palpate_scene& scene, const palpate_step_load& load) {
  return {0, 0, 15.0 * relaxation_of(scene.def).terms * load.tools};
}

palpate_status build(EffectBuild& build) {
  SceneMemory& memory = build.reader.memory();
  auto* const relaxation = memory.make<Relaxation>();
  if (!relaxation || !relaxation->create(memory, build.scene.def, build.pass))
    return build.reader.no_memory("relaxation");
  build.scene.touch.parts.add(relaxation);
  return PALPATE_OK;
}

}  // namespace

constinit const Effect relaxation_effect = {
    .name = "relaxation",
    .order = 6,
    .def = effect_struct<palpate_relaxation_def, palpate_init_relaxation_def>("relaxation_def"),
    .keys = kKeys,
    .needs = kNeeds,
    .check = check,
    .pass = {"relaxation: prony", Half::touch, Pass::force, predict},
    .build = build,
};

}  // namespace palpate

void palpate_init_relaxation_def(palpate_relaxation_def* def, size_t struct_bytes) {
  palpate_relaxation_def defaults = {};
  defaults.part.effect = &palpate::relaxation_effect;
  palpate::write_host_struct(defaults, def, struct_bytes);
}
