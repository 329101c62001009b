#include "runtime/obstacles/effect.h"

#include <algorithm>

#include "runtime/base/error_text.h"
#include "runtime/obstacles/obstacles.h"
#include "runtime/scene/effect_build.h"

namespace palpate {
namespace {

#define PALPATE_OBSTACLES_KEY(field) PALPATE_EFFECT_KEY(obstacles_effect, palpate_obstacles_def, field)
constexpr EffectKey kKeys[] = {
    {"obstacles." PALPATE_OBSTACLES_KEY(count), PALPATE_KEY_COUNT, "", "", 0, PALPATE_MAX_OBSTACLES},
    {"obstacle_nodes", &obstacles_effect, offsetof(palpate_obstacles_def, max_nodes),
     sizeof(palpate_obstacles_def::max_nodes), PALPATE_KEY_COUNT, "", "", 1, 2048},
    {"obstacles." PALPATE_OBSTACLES_KEY(list), PALPATE_KEY_POINTER, "", "", 0, 1},
};
constexpr EffectNeed kNeeds[] = {
    {"collision", 1u << PALPATE_COLLISION_DEFORMED,
     "obstacles meet the organ where forces have moved it: take collision DEFORMED, or leave obstacles.count at 0"}};

const palpate_obstacles_def& obstacles_of(const palpate_scene_def& def) {
  return part_of<palpate_obstacles_def>(def, obstacles_effect);
}

const char* check(const palpate_scene_def& def) {
  return obstacles_of(def).list ? nullptr : "obstacles need a list of them";
}

RowBudget rows(const palpate_scene_def& def) {
  const std::int32_t nodes = obstacles_of(def).max_nodes;
  return {nodes, nodes, nodes};
}

void add_sections(const palpate_scene_def&, SectionList& sections) {
  sections.add_contacts();
}

Obstacles* obstacles_of(const palpate_scene* scene) {
  return scene ? static_cast<Obstacles*>(scene->state_of(obstacles_effect)) : nullptr;
}

// Every node of the step is one of an obstacle that is looked at.
palpate_pass_work predict(const palpate_scene& scene, const palpate_step_load& load) {
  return {0, 0, 20.0 * obstacles_of(&scene)->count() + load.nodes * (300 + 3.0 * load.nodes)};
}

double most_operations(const palpate_scene& scene, double) {
  return obstacles_of(&scene)->most_operations(9.0 * scene.def.max_contact_nodes);
}

bool is_length(double x) {
  return x > 0 && x <= 1e3;
}

// The sentence of what is wrong.
const char* fault_of(const palpate_obstacle& from) {
  const int kind = enum_number(from.kind);
  if (kind < PALPATE_OBSTACLE_RECTANGLE || kind > PALPATE_OBSTACLE_MESH) return "a kind";
  if (kind != PALPATE_OBSTACLE_MESH &&
      !(is_length(from.size[0]) && (kind == PALPATE_OBSTACLE_DISC || is_length(from.size[1]))))
    return "a size above 0 and at most 1000 m";
  if (!(from.friction >= 0 && from.friction <= 1e6)) return "a friction of 0 or more";
  return is_length(from.depth) ? nullptr : "a depth above 0 and at most 1000 m";
}

palpate_status read_list(const EffectBuild& build, Obstacles* obstacles) {
  const palpate_obstacles_def& def = obstacles_of(build.scene.def);
  palpate_error* const error = build.reader.error();
  const auto* at = reinterpret_cast<const unsigned char*>(def.list);
  for (std::int32_t i = 0; i < def.count; ++i, at += def.list->struct_bytes) {
    const auto* const from = reinterpret_cast<const palpate_obstacle*>(at);
    palpate_obstacle one = palpate_default_obstacle();
    if (const palpate_status status = read_host_struct("obstacle", from, &one, error)) return status;
    const char* wrong = fault_of(one);
    if (!wrong) wrong = obstacles->read(build.reader.memory(), i, one);
    if (wrong)
      return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_obstacle: obstacle %d: expected %s, found something else",
                  static_cast<int>(i), wrong);
    palpate_pose pose = palpate_default_pose();
    std::copy(one.position, one.position + 3, pose.position);
    std::copy(one.orientation, one.orientation + 4, pose.orientation);
    if (const palpate_status status = set_pose(&pose, &obstacles->pose(i), error)) return status;
  }
  return PALPATE_OK;
}

palpate_status build(EffectBuild& build) {
  palpate_scene& scene = build.scene;
  const palpate_obstacles_def& def = obstacles_of(scene.def);
  SceneMemory& memory = build.reader.memory();
  auto* const obstacles = memory.make<Obstacles>();
  const Obstacles::Source source = {&scene.touch, build.reader.surface_nodes(), build.reader.triangles(), build.pass};
  if (!obstacles || !obstacles->create(memory, source, def.count, def.max_nodes))
    return build.reader.no_memory("obstacles");
  build.state = obstacles;
  scene.touch.parts.ask(obstacles);
  const palpate_status status = read_list(build, obstacles);
  return status == PALPATE_OK && memory.failed() ? build.reader.no_memory("obstacles") : status;
}

}  // namespace

constinit const Effect obstacles_effect = {
    .name = "obstacles",
    .order = 14,
    .def = effect_struct<palpate_obstacles_def, palpate_init_obstacles_def>("obstacles_def"),
    .keys = kKeys,
    .needs = kNeeds,
    .check = check,
    .uses = kUsesRest | kUsesSurface | kUsesDisplacements | kUsesNodeReach,
    .rows = rows,
    .pass = {"obstacles", Half::touch, Pass::contact, predict, most_operations},
    .sections = add_sections,
    .build = build,
};

}  // namespace palpate

void palpate_init_obstacles_def(palpate_obstacles_def* def, size_t struct_bytes) {
  palpate_obstacles_def defaults = {};
  defaults.part.effect = &palpate::obstacles_effect;
  defaults.max_nodes = 256;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

void palpate_init_obstacle(palpate_obstacle* obstacle, size_t struct_bytes) {
  palpate_obstacle defaults = {};
  defaults.depth = 0.01;
  defaults.orientation[0] = 1;
  palpate::write_host_struct(defaults, obstacle, struct_bytes);
}

palpate_status palpate_scene_set_obstacle_pose(palpate_scene* scene, int32_t obstacle, const palpate_pose* pose,
                                               palpate_error* error) {
  palpate::Obstacles* const obstacles = palpate::obstacles_of(scene);
  if (!obstacles || obstacle < 0 || obstacle >= obstacles->count() || !pose)
    return palpate::fail(error, PALPATE_ERROR_ARGUMENT, 0,
                         "obstacles: expected a pose and an obstacle of the scene, found %d of %d",
                         static_cast<int>(obstacle), static_cast<int>(obstacles ? obstacles->count() : 0));
  return palpate::set_pose(pose, &obstacles->pose(obstacle), error);
}

const palpate_obstacle_state* palpate_scene_obstacle_state(const palpate_scene* scene, int32_t obstacle) {
  const palpate::Obstacles* const obstacles = palpate::obstacles_of(scene);
  return obstacles ? obstacles->state(obstacle) : nullptr;
}
