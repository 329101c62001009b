// Organs of some size under the defaults of the library: what they answer while tools press deep, and after these have left.
#include "runtime/large/effect.h"
#include "tests/runtime/large/large_scene.h"
#include "tests/support/ball_body.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

// 100 x 70 x 45 mm, round in plan and thinner towards its rim, held at its hilum in the middle of the lower side.
const TouchedBody& lobe() {
  static const TouchedBody body(
      [] {
        GridBody grid;
        grid.lines = {grid_lines(-1, 1, 13), grid_lines(-1, 1, 9), grid_lines(0, 1, 6)};
        grid.held = [](auto p) { return p[2] == 0 && std::hypot(p[0], p[1]) < 0.5; };
        DenseBody made = dense_grid(grid);
        for (auto& p : made.body.mesh.nodes) {
          const double x = p[0], y = p[1];
          p[0] = 0.05 * x * std::sqrt(1 - 0.4 * y * y), p[1] = 0.035 * y * std::sqrt(1 - 0.4 * x * x);
          p[2] = 0.045 * p[2] * (1 - 0.25 * (x * x + y * y)) + 0.006 * x * x;
        }
        made.interior = true;
        return made;
      }(),
      with_large(false));
  return body;
}

// Two discs that press the upper side by 20 and 15 mm at 50 mm/s, wait, and leave.
struct TwoDiscs {
  palpate_tool tool[2];
  Vector3d at[2], top[2];
  static constexpr int kDown = 400, kStay = 100, kSteps = 2 * kDown + kStay + 60;
  explicit TwoDiscs(const TouchedBody& body) {
    for (int t = 0; t < 2; ++t) {
      std::int32_t highest = 0;
      const Vector3d over(t == 0 ? 0.015 : -0.02, t == 0 ? 0.004 : -0.006, 1);
      double least = INFINITY;
      for (std::int32_t n = 0; n < body.body.surface_nodes; ++n)
        if (const double far = (body.node(n) - over).norm(); far < least) least = far, highest = n;
      top[t] = body.node(highest);
      tool[t] = palpate_default_tool();
      tool[t].id = t + 1, tool[t].points = at[t].data(), tool[t].point_count = 1;
      tool[t].disc_radius = 0.006, tool[t].friction = 0.3;
    }
  }
  void move(int step) {
    const double share = std::min({step, 2 * kDown + kStay - step, kDown}) / static_cast<double>(kDown);
    for (int t = 0; t < 2; ++t) at[t] = top[t] - (t == 0 ? 0.020 : 0.015) * share * Vector3d::UnitZ();
    for (int t = 0; t < 2; ++t) at[t][2] += share < 0 ? 0 : 1e-4;
  }
};

SceneDef pressed_def(palpate_deformation_model deformation) {
  SceneDef def;
  def.large.deformation = deformation, def.law = PALPATE_LAW_COULOMB, def.shape = PALPATE_SHAPE_VOLUME;
  return def;
}

// N: the largest raw force on a tool.
double largest_force(Contacts& contacts) {
  double largest = 0;
  for (int t = 0; t < contacts->tool_count; ++t)
    largest = std::max(largest, Vector3d(palpate_contacts_tool(contacts, t)->force_raw).norm());
  return largest;
}

// m: the largest displacement of a node.
double largest_displacement(const TouchedBody& body, palpate_scene* scene, Contacts& contacts) {
  double largest = 0;
  for (const float u : displacements(scene, contacts, static_cast<std::int32_t>(body.body.mesh.nodes.size())))
    largest = std::max(largest, std::abs(static_cast<double>(u)));
  return largest;
}

TEST(LargeOrgan, TwoDiscsWithFrictionPressALobeDeepAndItComesBackToRest) {
  for (const bool few : {false, true}) {
    SceneDef def = pressed_def(PALPATE_DEFORMATION_LARGE);
    if (few) def.max_operations = 40'000;  // less than kFewestSteps
    const ScenePointer large = lobe().scene(def), linear = lobe().scene(pressed_def(PALPATE_DEFORMATION_LINEAR));
    Contacts contacts(large.get()), linear_contacts(linear.get());
    TwoDiscs discs(lobe());
    double worst = 0, peak_linear = 0;
    int flagged = 0, pressed = 0;
    for (int step = 0; step <= TwoDiscs::kSteps; ++step) {
      discs.move(step);
      flagged += palpate_scene_touch(large.get(), discs.tool, 2, 1e-3, contacts.get(), contacts.bytes()) != 0;
      palpate_scene_touch(linear.get(), discs.tool, 2, 1e-3, linear_contacts.get(), linear_contacts.bytes());
      peak_linear = std::max(peak_linear, largest_force(linear_contacts));
      pressed += largest_force(contacts) > 0;
      // What the linear response has at the same place, or a tenth of its peak where one of the two has let go.
      worst =
          std::max(worst, largest_force(contacts) / std::max(largest_force(linear_contacts), 0.1 * peak_linear + 0.01));
    }
    EXPECT_GT(pressed, TwoDiscs::kDown) << few;
    EXPECT_LT(flagged, TwoDiscs::kSteps / 10) << few;
    EXPECT_LT(worst, 3) << few;
    for (int step = 0; step <= LargeSolver::kStepsToRest; ++step)
      palpate_scene_touch(large.get(), nullptr, 0, 1e-3, contacts.get(), contacts.bytes());
    EXPECT_LT(largest_displacement(lobe(), large.get(), contacts), 1e-4) << few;
    EXPECT_EQ(largest_force(contacts), 0) << few;
  }
}

// A disc that presses a ball of a tissue that stiffens.
void press_ball(const LawForm& form) {
  SCOPED_TRACE(words_of(form));
  const TouchedBody ball(dense_ball(0.03, 5), with_large(false, form));
  const Seen seen(ball, false, form);
  const LargeReference reference(seen.body);
  const ScenePointer scene = ball.scene(pressed_def(PALPATE_DEFORMATION_LARGE));
  Contacts contacts(scene.get());
  const auto nodes = static_cast<std::int32_t>(ball.body.mesh.nodes.size());
  Vector3d point;
  palpate_tool tool = palpate_default_tool();
  tool.points = point.data(), tool.point_count = 1, tool.disc_radius = 0.005, tool.friction = 0.3;
  double worst = 0;
  int compared = 0;
  for (int step = 0; step <= 100; ++step) {
    point = Vector3d(0.002, 0.001, 0.0301 - 5e-5 * std::min(step, 60));  // 2.7 mm deep and more, then a stand
    EXPECT_EQ(palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes()), 0u) << step;
    const double raw = largest_force(contacts);
    ASSERT_TRUE(std::isfinite(raw));
    if (step % 20 != 0 || raw == 0) continue;
    const auto [weights, compliance, place, carried, load] = held_rows(deforming_body_of(*scene.get()), nodes);
    VectorXd u = VectorXd::Zero(3 * nodes), force;
    for (int i = 1; i <= 8; ++i) force = reference.solve(weights, place * i / 8, &u, 1e-7, compliance);
    worst = std::max(worst, carried.norm() / force.norm()), ++compared;
  }
  EXPECT_GT(compared, 3);
  EXPECT_LT(worst, 1.1);
  for (int step = 0; step <= LargeSolver::kStepsToRest; ++step)
    palpate_scene_touch(scene.get(), nullptr, 0, 1e-3, contacts.get(), contacts.bytes());
  EXPECT_LT(largest_displacement(ball, scene.get(), contacts), 1e-4);
}

TEST(LargeOrgan, ABallThatStiffensExponentiallyHasNewtonsForce) {
  press_ball(32);
}

TEST(LargeOrgan, ABallThatStiffensByYeohsOrOgdensLawHasNewtonsForce) {
  for (const LawForm& form : {LawForm::yeoh(-5000, 1e6), LawForm::ogden(30), LawForm::ogden(-12, 0.5, 20)})
    press_ball(form);
}

}  // namespace
}  // namespace palpate::tests
