// Jaws on a block of gel, against the closed forms of a rigid disc on a half-space: 4 G a / (1 - nu) along the normal, 8 G a / (2 - nu) across
// it, 8 G a^3 / (3 (1 - nu)) against a tilt, 16 G a^3 / 3 against a twist (Johnson, Contact Mechanics, sections 3.4 and 5.4; Mindlin 1949;
// Reissner and Sagoci 1944). Those of a push and a tilt are of discs without friction: one that sticks is stiffer, by 0.2 % at nu = 0.45.
#include "tests/precompute/punched_block.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

// Over the closed forms: pushed, dragged, tilted about both directions, twisted.
std::array<double, 5> stiffness(Punched& block, double poisson, Vector3d at, double a, double held) {
  const double g = kYoung / (2 * (1 + poisson)), way = 1e-4, angle = 0.01, cube = a * a * a;
  const Vector3d still = Vector3d::Zero(), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  const double tilt = 8 * g * cube / (3 * (1 - poisson)) * angle, twist = 16 * g * cube / 3 * angle;
  return {-block.grasp(at, a, way * z, still).force[2] / (4 * g * a / (1 - poisson) * way) - held,
          -block.grasp(at, a, way * x, still).force[0] / (8 * g * a / (2 - poisson) * way) - held,
          -block.grasp(at, a, still, angle * x).torque[0] / tilt,
          -block.grasp(at, a, still, angle * y).torque[1] / tilt,
          -block.grasp(at, a, still, angle * z).torque[2] / twist};
}

class GraspedBlock : public testing::TestWithParam<std::pair<Element, double>> {};

TEST_P(GraspedBlock, HasForceAndTorqueOfARigidDiscWhateverTheEdge) {
  const auto [element, poisson] = GetParam();
  Punched block(flat_block(), element, poisson, 5.5 * kEdge);
  double force = 0, torque = 0;
  for (const double edges : {0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0})  // in a radius
    for (const auto& [x, y] : {std::pair{0.0, 0.0}, {0.5, 0.25}, {0.33, 0.8}, {-0.5, 0.5}}) {
      // The block is held far away, which makes it stiffer against a push (FlatPunch); of a turn that falls with the cube of the distance.
      const double held = 2.5 * 2 * edges / (std::numbers::pi * kReach);
      const auto of = stiffness(block, poisson, {x * kEdge, y * kEdge, 0}, edges * kEdge, held);
      // Forces as those of a punch (FlatPunch). The constants of a turn are fitted on this block, and leave what a disc scatters by from
      // place to place, 4 %. The largest disc has 80 nodes and acts on 64 of them.
      const double turn = element == Element::p1_ang ? 0.1 : 0.05;
      const double allowed = element == Element::p1 && edges == 4 ? 0.08 : turn;
      for (int i = 0; i < 2; ++i) EXPECT_NEAR(of[i], 1, allowed) << edges << " edges, at " << x << " " << y;
      for (int i = 2; i < 5; ++i) EXPECT_NEAR(of[i], 1, turn) << edges << " edges, at " << x << " " << y << ": " << i;
      for (int i = 0; i < 2; ++i) force = std::max(force, std::abs(of[i] - 1));
      for (int i = 2; i < 5; ++i) torque = std::max(torque, std::abs(of[i] - 1));
    }
  RecordProperty("worst_force", std::to_string(force));
  RecordProperty("worst_torque", std::to_string(torque));
}
INSTANTIATE_TEST_SUITE_P(Elements, GraspedBlock,
                         testing::Values(std::pair{Element::p1, 0.45}, std::pair{Element::p1_anp, 0.45},
                                         std::pair{Element::p1_ang, 0.45}));

// A disc of more than 64 nodes acts on 64 of them, which are points where the disc is a surface. What it lacks then belongs to the method's
// limits (docs/method.md, section 16), and is no more than stated there.
TEST(GraspedBlock, OfAWideDiscIsTooSoft) {
  std::vector<double> distance;
  for (const double edges : {0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0, 16.0, 28.5, 58.5, kReach})
    distance.push_back(kEdge * edges);
  Punched block(graded_block(distance), Element::p1_anp, 0.45, 9.5 * kEdge);
  for (const auto& [edges, force, torque] : {std::tuple{5.0, 0.07, 0.16}, {6.0, 0.11, 0.22}, {8.0, 0.16, 0.30}}) {
    const double held = 2.5 * 2 * edges / (std::numbers::pi * kReach);
    const auto of = stiffness(block, 0.45, {0.5 * kEdge, 0.25 * kEdge, 0}, edges * kEdge, held);
    const double least_force = std::min(of[0], of[1]), least_torque = std::min({of[2], of[3], of[4]});
    RecordProperty("at_" + std::to_string(static_cast<int>(edges)),
                   std::to_string(least_force) + " " + std::to_string(least_torque));
    EXPECT_GT(least_force, 1 - force) << edges;
    EXPECT_GT(least_torque, 1 - torque) << edges;
    EXPECT_LT(least_torque, 1) << edges;
  }
}

// One disc of 6 mm on blocks of equal size whose edges below it are 8, 4 and 2 mm.
TEST(GraspedBlock, HasTheSameForceAndTorqueOnThreeMeshes) {
  constexpr double kRadius = 0.006, kPoisson = 0.45;
  const std::vector<double> distances[] = {{0, 8, 16, 24, 36, 60, 110, 200},
                                           {0, 4, 8, 12, 16, 20, 28, 44, 80, 130, 200},
                                           {0, 2, 4, 6, 8, 10, 14, 20, 32, 56, 100, 200}};
  std::array<double, 5> least, most;
  least.fill(INFINITY), most.fill(0);
  for (std::vector<double> distance : distances) {
    for (double& d : distance) d *= 1e-3;
    Punched block(graded_block(distance), Element::p1_anp, kPoisson, 0.021);
    for (const auto& [x, y] : {std::pair{0.0, 0.0}, {0.001, 0.0015}, {0.003, -0.002}}) {
      const auto of = stiffness(block, kPoisson, {x, y, 0}, kRadius, 0);
      for (std::size_t i = 0; i < of.size(); ++i)
        least[i] = std::min(least[i], of[i]), most[i] = std::max(most[i], of[i]);
    }
  }
  // What a disc scatters by from place to place (above). Measured: 3 %.
  for (std::size_t i = 0; i < least.size(); ++i) EXPECT_LT(most[i] / least[i], 1.05) << i;
  RecordProperty("tilt", std::to_string(std::max(most[2] / least[2], most[3] / least[3]) - 1));
  RecordProperty("twist", std::to_string(most[4] / least[4] - 1));
}

}  // namespace
}  // namespace palpate::tests
