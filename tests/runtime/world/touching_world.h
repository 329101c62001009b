// Blocks and domes in worlds whose organs touch one another.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "tests/runtime/world/played_world.h"
#include "tests/support/deformed_truth.h"
#include "tests/support/grid_body.h"

namespace palpate::tests {

// A block between x, y = -half .. half and z = 0 .. height, held at its top or its bottom.
inline DenseBody block(double half, double height, int cells, int layers, bool held_at_top, double young = 5400) {
  GridBody grid;
  grid.lines = {grid_lines(-half, half, cells), grid_lines(-half, half, cells), grid_lines(0, height, layers)};
  grid.held = [=](auto p) { return p[2] == (held_at_top ? height : 0); };
  grid.young = young;
  return dense_grid(grid);
}

// A small block held at its top, a larger one held at its bottom, and a plate held at one side: each fits under the one before.
inline const TouchedBody& upper_block() {
  static const TouchedBody body(block(0.015, 0.02, 4, 4, true));
  return body;
}
inline const TouchedBody& lower_block() {
  static const TouchedBody body(block(0.03, 0.03, 8, 4, false, 8000));
  return body;
}
inline const TouchedBody& side_plate() {
  static const TouchedBody body([] {
    GridBody grid;
    grid.lines = {grid_lines(-0.02, 0.02, 5), grid_lines(-0.02, 0.02, 5), grid_lines(0, 0.015, 3)};
    grid.held = [](auto p) { return p[0] == -0.02; };
    return dense_grid(grid);
  }());
  return body;
}

// [3N][3N] m/N, zero on fixed dofs.
inline Eigen::MatrixXd compliance_of(const TouchedBody& body) {
  const Eigen::MatrixXd stiffness = body.stiffness();
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < body.dofs(); ++i)
    if (!body.fixed[static_cast<std::size_t>(i)]) free.push_back(i);
  Eigen::MatrixXd c = Eigen::MatrixXd::Zero(body.dofs(), body.dofs());
  const Eigen::MatrixXd inverse = Eigen::MatrixXd(stiffness(free, free)).inverse();
  c(free, free) = inverse;
  return c;
}

inline palpate_scene_def touching_def() {
  palpate_scene_def def = unlimited_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.law = PALPATE_LAW_UNILATERAL;
  return def;
}

struct Stack {
  const TouchedBody* body;
  Eigen::Vector3d place;
};

// Organs that touch, without tools where none are given.
class Touching {
 public:
  explicit Touching(const std::vector<Stack>& stack, double friction = 0, std::int32_t max_pairs = 200) {
    const palpate_scene_def scene = touching_def();
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
  palpate_step_flags step(const std::vector<palpate_tool>& tools = {}) {
    return palpate_world_touch(world.get(), tools.data(), static_cast<std::int32_t>(tools.size()), 1e-3,
                               contacts->get(), contacts->bytes());
  }
  void place(std::int32_t organ, const Eigen::Vector3d& at) {
    const palpate_pose pose = pose_at(at);
    ASSERT_EQ(palpate_scene_set_pose(palpate_world_scene(world.get(), organ), &pose, nullptr), PALPATE_OK);
  }
  Eigen::Vector3d pressed(std::int32_t organ) { return Eigen::Vector3d(contacts->state(organ).pressed); }
  std::vector<float> shape(std::int32_t organ, const TouchedBody& body) {
    return displacements(palpate_world_scene(world.get(), organ), &contacts->organ(organ), body.body.surface_nodes);
  }
  const palpate_world_pair& pair(std::int32_t i) { return *palpate_world_contacts_pair(contacts->get(), i); }

  WorldPointer world;
  std::unique_ptr<WorldContacts> contacts;
};

inline constexpr double kDomeHeight = 0.02;
inline const TouchedBody& dome() {
  static const TouchedBody body([] {
    constexpr double radius = 0.03;
    DenseBody made = block(0.02, kDomeHeight, 6, 3, false, 3000);
    for (auto& node : made.body.mesh.nodes)
      node[2] -= node[2] / kDomeHeight * (node[0] * node[0] + node[1] * node[1]) / (2 * radius);
    return made;
  }());
  return body;
}

// Two domes, the upper one turned over, 0.5 mm apart and then pressed on one another by 0.1 mm in each step.
class PressedDomes : public Touching {
 public:
  explicit PressedDomes(double friction, int steps = 100)
      : Touching({{&dome(), {0, 0, 0}}, {&dome(), {0, 0, 0}}}, friction) {
    for (int s = 0; s < steps; ++s) move(1e-3 * Eigen::Vector3d(0, 0, -0.1));
  }
  void move(const Eigen::Vector3d& way) {
    place_ += way;
    const palpate_pose pose =
        pose_at(place_, Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX())));
    ASSERT_EQ(palpate_scene_set_pose(palpate_world_scene(world.get(), 1), &pose, nullptr), PALPATE_OK);
    step();
  }

 private:
  Eigen::Vector3d place_ = {0.004, 0.003, 2 * kDomeHeight + 0.0005};
};

}  // namespace palpate::tests
