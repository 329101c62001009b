#include "tests/runtime/world/touching_world.h"

#include "tests/runtime/large/large_scene.h"

namespace palpate::tests {

DenseBody block(double half, double height, int cells, int layers, bool held_at_top, double young) {
  GridBody grid;
  grid.lines = {grid_lines(-half, half, cells), grid_lines(-half, half, cells), grid_lines(0, height, layers)};
  grid.held = [=](auto p) { return p[2] == (held_at_top ? height : 0); };
  grid.young = young;
  return dense_grid(grid);
}

const TouchedBody& upper_block() {
  static const TouchedBody body(block(0.015, 0.02, 4, 4, true), with_large(false));
  return body;
}

const TouchedBody& lower_block() {
  static const TouchedBody body(block(0.03, 0.03, 8, 4, false, 8000), with_large(false));
  return body;
}

const TouchedBody& side_plate() {
  static const TouchedBody body(
      [] {
        GridBody grid;
        grid.lines = {grid_lines(-0.02, 0.02, 5), grid_lines(-0.02, 0.02, 5), grid_lines(0, 0.015, 3)};
        grid.held = [](auto p) { return p[0] == -0.02; };
        return dense_grid(grid);
      }(),
      with_large(false));
  return body;
}

Eigen::MatrixXd compliance_of(const TouchedBody& body) {
  const Eigen::MatrixXd stiffness = body.stiffness();
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < body.dofs(); ++i)
    if (!body.fixed[static_cast<std::size_t>(i)]) free.push_back(i);
  Eigen::MatrixXd c = Eigen::MatrixXd::Zero(body.dofs(), body.dofs());
  const Eigen::MatrixXd inverse = Eigen::MatrixXd(stiffness(free, free)).inverse();
  c(free, free) = inverse;
  return c;
}

SceneDef touching_def() {
  SceneDef def = unlimited_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.law = PALPATE_LAW_UNILATERAL;
  return def;
}

Touching::Touching(const std::vector<Stack>& stack, double friction, std::int32_t max_pairs,
                   palpate_deformation_model deformation)
    : beside_(deformation >= PALPATE_DEFORMATION_LARGE_BESIDE) {
  SceneDef scene = touching_def();
  scene.large.deformation = deformation;
  std::vector<palpate_pose> poses(stack.size());
  std::vector<palpate_world_organ> organs;
  for (std::size_t k = 0; k < stack.size(); ++k) {
    poses[k] = pose_at(stack[k].place);
    organs.push_back(organ_of(stack[k].body->bundle(), &scene, &poses[k]));
  }
  palpate_world_def def = palpate_default_world_def();
  def.organs = organs.data(), def.organ_count = static_cast<std::int32_t>(organs.size());
  def.max_pairs = max_pairs, def.friction = friction;
  palpate_world* made = nullptr;
  palpate_error error = {};
  if (palpate_world_create(&def, &made, &error) != PALPATE_OK) throw std::runtime_error(error.text);
  world.reset(made);
  contacts = std::make_unique<WorldContacts>(made);
}

palpate_step_flags Touching::step(const std::vector<palpate_tool>& tools) {
  const palpate_step_flags flags = palpate_world_touch(
      world.get(), tools.data(), static_cast<std::int32_t>(tools.size()), 1e-3, contacts->get(), contacts->bytes());
  for (std::int32_t k = 0; k < contacts->get()->organ_count && beside_; ++k)
    for (int i = 0; i < 3; ++i) palpate_scene_deform(palpate_world_scene(world.get(), k));
  return flags;
}

void Touching::place(std::int32_t organ, const Eigen::Vector3d& at) {
  const palpate_pose pose = pose_at(at);
  ASSERT_EQ(palpate_scene_set_pose(palpate_world_scene(world.get(), organ), &pose, nullptr), PALPATE_OK);
}

std::vector<float> Touching::shape(std::int32_t organ, const TouchedBody& body) {
  return displacements(palpate_world_scene(world.get(), organ), &contacts->organ(organ), body.body.surface_nodes);
}

DenseBody dome_of(double half, int layers, double radius, double young) {
  DenseBody made = block(half, kDomeHeight, 6, layers, false, young);
  for (auto& node : made.body.mesh.nodes)
    node[2] -= node[2] / kDomeHeight * (node[0] * node[0] + node[1] * node[1]) / (2 * radius);
  return made;
}

const TouchedBody& dome() {
  static const TouchedBody body(dome_of(0.02, 3, 0.03, 3000), with_large(false));
  return body;
}

PressedDomes::PressedDomes(double friction, int steps)
    : PressedDomes(dome(), dome(), {0.004, 0.003}, friction, steps) {}

PressedDomes::PressedDomes(const TouchedBody& lower, const TouchedBody& upper, const Eigen::Vector2d& aside,
                           double friction, int steps)
    : Touching({{&lower, {0, 0, 0}}, {&upper, {0, 0, 0}}}, friction),
      place_(aside.x(), aside.y(), 2 * kDomeHeight + 0.0005) {
  for (int s = 0; s < steps; ++s) move(1e-3 * Eigen::Vector3d(0, 0, -0.1));
}

void PressedDomes::move(const Eigen::Vector3d& way) {
  place_ += way;
  const palpate_pose pose =
      pose_at(place_, Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX())));
  ASSERT_EQ(palpate_scene_set_pose(palpate_world_scene(world.get(), 1), &pose, nullptr), PALPATE_OK);
  step();
}

}  // namespace palpate::tests
