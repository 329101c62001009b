// Blocks and domes in worlds whose organs touch one another.
#pragma once

#include <palpate/palpate_scene_def.hpp>

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
DenseBody block(double half, double height, int cells, int layers, bool held_at_top, double young = 5400);

// A small block held at its top, a larger one held at its bottom, and a plate held at one side: each fits under the one before.
const TouchedBody& upper_block();
const TouchedBody& lower_block();
const TouchedBody& side_plate();

// [3N][3N] m/N, zero on fixed dofs.
Eigen::MatrixXd compliance_of(const TouchedBody& body);

SceneDef touching_def();

struct Stack {
  const TouchedBody* body;
  Eigen::Vector3d place;
};

// Organs that touch, without tools where none are given.
class Touching {
 public:
  explicit Touching(const std::vector<Stack>& stack, double friction = 0, std::int32_t max_pairs = 200,
                    palpate_deformation_model deformation = PALPATE_DEFORMATION_LINEAR);
  // Bodies that are solved beside the touch are solved three times behind it.
  palpate_step_flags step(const std::vector<palpate_tool>& tools = {});
  void place(std::int32_t organ, const Eigen::Vector3d& at);
  Eigen::Vector3d pressed(std::int32_t organ) { return Eigen::Vector3d(contacts->state(organ).pressed); }
  std::vector<float> shape(std::int32_t organ, const TouchedBody& body);
  const palpate_world_pair& pair(std::int32_t i) { return *palpate_world_contacts_pair(contacts->get(), i); }

  WorldPointer world;
  std::unique_ptr<WorldContacts> contacts;

 private:
  bool beside_ = false;
};

inline constexpr double kDomeHeight = 0.02;
// A block whose top is bent by this radius, m, held at its bottom. young: Pa.
DenseBody dome_of(double half, int layers, double radius, double young);
const TouchedBody& dome();

// Two domes, the upper one turned over, 0.5 mm apart and then pressed on one another by 0.1 mm in each step. aside: m, of the upper one.
class PressedDomes : public Touching {
 public:
  explicit PressedDomes(double friction, int steps = 100);
  PressedDomes(const TouchedBody& lower, const TouchedBody& upper, const Eigen::Vector2d& aside, double friction,
               int steps);
  void move(const Eigen::Vector3d& way);

 private:
  Eigen::Vector3d place_;
};

}  // namespace palpate::tests
