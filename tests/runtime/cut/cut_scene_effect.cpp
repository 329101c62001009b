#include "tests/runtime/cut/cut_scene_effect.h"

#include "runtime/base/host_struct.h"
#include "runtime/contact/touch_step.h"
#include "runtime/scene/effect_build.h"

namespace palpate::tests {
namespace {

class Mover final : public StepPart {
 public:
  double amount = 0;
  void begin_step(TouchStep& step) override {
    if (step.state->offset.count() > 0) step.state->offset.amounts()[0] = amount;
  }
};

void init_def(palpate_test_cut_def* def, std::size_t bytes);

}  // namespace

extern const Effect test_cut_effect;

namespace {

palpate_status prepare(EffectBuild& build) {
  SceneMemory& memory = build.reader.memory();
  palpate_scene& scene = build.scene;
  CutOrgan::Parts parts = cut_making().parts;
  parts.tensors = &scene.tensors, parts.touchable = scene.touchable;
  parts.contact_nodes = scene.def.max_contact_nodes, parts.constraints = scene.touch.most_constraints;
  if (scene.def.preload == PALPATE_PRELOAD_ON) {
    if (const palpate_status status = build.reader.map_preload(scene.def, &parts.preload)) return status;
  }
  cut_making().organ = memory.make<CutOrgan>();
  auto* const mover = memory.make<Mover>();
  cut_making().scene = &scene;
  if (!cut_making().organ || !mover || !cut_making().organ->create(memory, parts, scene.touch))
    return build.reader.no_memory("cut");
  if (cut_making().rows.count > 0 && scene.touch.offset.add(memory, cut_making().rows) != 0)
    return build.reader.no_memory("cut");
  scene.touch.parts.add(mover);
  cut_making().amount = &mover->amount;
  return PALPATE_OK;
}
palpate_status build(EffectBuild& build) {
  build.scene.touch.held = build.scene.shape.held = {build.reader.surface_nodes(), false};
  const HyperelasticBody& body = *cut_making().parts.body;
  const std::vector<std::uint8_t> all(static_cast<std::size_t>(body.node_count), 1);
  const bool made = cut_making().organ->take_loads(build.reader.memory(), body, all.data());
  return made ? PALPATE_OK : build.reader.no_memory("cut");
}
const char* pass_of(const palpate_scene_def&) {
  return "cut";
}
palpate_pass_work predict(const palpate_scene&, const palpate_step_load&) {
  return {};
}
double most_operations(const palpate_scene&) {
  return 1e9;
}

constexpr EffectBody kBody = {pass_of, predict, most_operations};
const EffectKey kKeys[] = {{"test_cut.on", &test_cut_effect, offsetof(palpate_test_cut_def, on),
                            sizeof(palpate_test_cut_def::on), PALPATE_KEY_COUNT, "", "", 0, 1}};
}  // namespace

const Effect test_cut_effect = {
    .name = "test_cut",
    .order = 1,
    .def = effect_struct<palpate_test_cut_def, init_def>("test_cut_def"),
    .keys = kKeys,
    .needs = {},
    .uses = kUsesHeldSurface | kUsesRest,
    .pass = {nullptr, Half::touch, Pass::contact, nullptr, nullptr},
    .body = &kBody,
    .build = build,
    .prepare = prepare,
};
namespace {

void init_def(palpate_test_cut_def* def, std::size_t bytes) {
  palpate_test_cut_def defaults = {};
  defaults.part.effect = &test_cut_effect;
  write_host_struct(defaults, def, bytes);
}

}  // namespace

CutMaking& cut_making() {
  static CutMaking making;
  return making;
}

palpate_test_cut_def switched_on() {
  palpate_test_cut_def def;
  init_def(&def, sizeof def);
  def.on = 1;
  return def;
}

}  // namespace palpate::tests
