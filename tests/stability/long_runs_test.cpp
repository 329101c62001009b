// Scenes that run for long with any time step: forces stay bounded, and after a closed path the answers are the same.
#include <random>

#include "tests/runtime/touched_box.h"
#include "tests/stability/stability_case.h"
#include "tests/support/relaxation.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

const TouchedBox& box() {
  static const TouchedBox shared({.cells = {3, 5, 4}});
  return shared;
}

// Two tools with discs and a grip, and their answers to a fixed set of moves.
struct Played : TouchedScene {
  explicit Played(const SceneDef& def) : TouchedScene(box(), def) {}
  palpate_step_flags touch(const Vector3d& first, const Vector3d& second, const Vector3d& pull, double dt) {
    const Vector3d points[2] = {first, second};
    const palpate_grip grip = grip_at_node(box().touchable[3], pull);
    std::vector<palpate_tool> tools = tools_of(points, 0.003, 0.3);
    tools.push_back(grip_tool(&grip));
    return TouchedScene::touch(tools, dt);
  }
  // Both tools leave the organ and go round it, because a contact ends above the face where it began. Then each comes down at its
  // site, presses and is dragged a little.
  std::vector<double> probe() {
    const Vector3d middle(0.03, 0.025, 0.02), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    const Vector3d first[] = {y, z, -y, -z, -x, y, x}, second[] = {y, x, -y, -x, -z, y, z};
    // A sliding contact follows its tool by at most eight buckets in a step, so the tool waits for it.
    for (int s = 0; s < 140; ++s) touch(middle + first[s / 20], middle + second[s / 20], Vector3d::Zero(), 1e4);
    std::vector<double> answer;
    for (int s = 0; s < 6; ++s) {
      touch({0.061 - 0.0005 * s, 0.02 + 1e-4 * s, 0.018}, {0.03, 0.021 + 1e-4 * s, 0.041 - 0.0004 * s},
            {0, 1e-4 * s, 0}, 0.01);
      for (int t = 0; t < 3; ++t) answer.insert(answer.end(), tool(t).force_raw, tool(t).force_raw + 3);
    }
    return answer;
  }
};

double off(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0, largest = 0;
  for (std::size_t i = 0; i < b.size(); ++i)
    most = std::max(most, std::abs(a[i] - b[i])), largest = std::max(largest, std::abs(b[i]));
  return std::isfinite(most) ? most / largest : INFINITY;
}

TEST(StabilityLongRuns, RandomToolComesBackToTheSameForce) {
  StabilityCase attack(
      "A step leaves a factor, warm starts, last positions and the relaxation's memory behind. Errors in them could "
      "add up over a day's hundred million touches.");
  const long touches = quick_or_long(100000L, 100000000L) / 8;
  for (const auto law : kEveryLaw)
    for (const auto collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED}) {
      SceneDef def = with(SceneDef(), law, collision);
      def.force_limit = 5, def.force_slew = 1000, def.relaxation = brain();
      const std::vector<double> expected = Played(def).probe();
      Played played(def);
      std::mt19937 random(31 + 2 * law + collision);
      std::normal_distribution<double> normal;
      std::uniform_real_distribution<double> decade(-5, -2.5), unit(0, 1);
      const Vector3d middle(0.03, 0.025, 0.02);
      Vector3d p[2] = {Vector3d(0.07, 0.025, 0.02), Vector3d(0.03, 0.025, 0.05)}, pull = Vector3d::Zero();
      double largest = 0, fastest = 0, change = 0;
      Vector3d last[3] = {Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
      for (long s = 1; s <= touches; ++s) {
        for (Vector3d& tool : p) {
          tool += std::pow(10.0, decade(random)) * Vector3d(normal(random), normal(random), normal(random));
          if ((tool - middle).norm() > 0.05) tool = middle + 0.05 * (tool - middle).normalized();
        }
        pull = 0.99 * pull + 1e-4 * Vector3d(normal(random), normal(random), normal(random));
        played.touch(p[0], p[1], pull, 1e-3 * unit(random) + 1e-6);
        for (int t = 0; t < 3; ++t) {
          const Vector3d force(played.tool(t).force);
          largest = force.allFinite() ? std::max(largest, force.norm()) : INFINITY;
          fastest = std::max(fastest, (force - last[t]).norm());
          last[t] = force;
        }
        if (s % (touches / 4) == 0) {
          change = std::max(change, off(played.probe(), expected));
          for (int t = 0; t < 3; ++t) last[t] = Vector3d(played.tool(t).force);
        }
      }
      const char* const laws[] = {"sticking", "sliding", "unilateral", "coulomb"};
      const std::string of = std::string(", ") + laws[law] +
                             (collision == PALPATE_COLLISION_REST ? ", at rest" : ", deformed") + ", " +
                             std::to_string(touches) + " touches";
      attack.hold("force, N" + of, largest, 5 * (1 + 1e-9), "force_limit");
      attack.hold("change of force in a step, N" + of, fastest, 1000 * 1.001e-3 * (1 + 1e-9), "force_slew");
      attack.hold(
          "probe after the run against before, relative" + of, change, law == PALPATE_LAW_STICKING ? 1e-9 : 1e-6,
          law == PALPATE_LAW_STICKING ? "rounding of a factor that held other rows before"
                                      : "Gauss-Seidel ends at 1e-10 of the largest target, at most six times in a row");
    }
}

TEST(StabilityLongRuns, RelaxationOverDaysAtAnyTimeStep) {
  StabilityCase attack(
      "A force held for days is a sum of ever smaller parts: steps of ten seconds must not overshoot, steps of a "
      "nanosecond "
      "must not lose what they add.");
  SceneDef def = unlimited_def();
  const Vector3d d(-0.001, 0.0005, 0.0002);
  const auto held = [&](const SceneDef& with, double dt, long steps, double* rise) {
    TouchedScene scene(box(), with);
    const palpate_grip grip = grip_at_node(box().touchable[5], d);
    const palpate_tool tool = grip_tool(&grip, 1, 0, 1);
    double before = INFINITY;
    Vector3d force = Vector3d::Zero();
    for (long s = 0; s < steps; ++s) {
      scene.touch({tool}, dt);
      force = scene.force();
      if (s > 0 && rise) *rise = std::max(*rise, force.norm() - before);
      before = force.norm();
    }
    return force;
  };
  const Vector3d whole = held(def, 1e-3, 1, nullptr);
  def.relaxation = brain();
  double rise = 0;
  const Vector3d days = held(def, 10, 3 * 24 * 360, &rise);
  attack.hold("after three days of 10 s steps, against 1 - sum of shares, relative",
              (days - (1 - 0.45 - 0.365) * whole).norm() / whole.norm(), 1e-12, "exp(-5000) is zero: rounding alone");
  attack.hold("rise of a held force, N", rise, 1e-15 * whole.norm(), "it relaxes: one rounding");
  const long steps = quick_or_long(200000L, 100000000L);
  const Vector3d soon = held(def, 1e-9, steps, nullptr);
  double expected = 1;
  const double held_for = 1e-9 * static_cast<double>(steps - 1);
  for (int i = 0; i < 2; ++i) {
    const double tau = def.relaxation.time[i];
    // The first step ramps the force up: the mean of the relaxation over this step.
    expected -= def.relaxation.share[i] * (1 - std::exp(-held_for / tau) * -std::expm1(-1e-9 / tau) * tau / 1e-9);
  }
  attack.hold("after " + std::to_string(steps) + " steps of 1 ns, against the closed form, relative",
              (soon - expected * whole).norm() / whole.norm(), 1.1e-16 * static_cast<double>(steps) + 1e-14,
              "one rounding a step");
}

TEST(StabilityLongRuns, StepsThatAreNothingAgainstTheTimeConstant) {
  StabilityCase attack(
      "A step so short, or a time so long, that their ratio underflows: the relaxation's increment is 0 / 0.");
  SceneDef def = unlimited_def();
  const palpate_grip grip = grip_at_node(box().touchable[5], {-0.001, 0.0005, 0.0002});
  const palpate_tool tool = grip_tool(&grip, 1, 0, 1);
  const auto held = [&](double dt) {
    TouchedScene scene(box(), def);
    for (int s = 0; s < 3; ++s) scene.touch({tool}, dt);
    return scene.force();
  };
  const Vector3d whole = held(1e-3);
  def.relaxation = brain();
  double off = 0;
  for (const double time : {1.0, 1e10, 1e300})
    for (const double dt : {1e-20, 1e-300}) {  // the shortest one that a step takes
      def.relaxation.time[1] = time;
      const double change = (held(dt) - whole).norm() / whole.norm();
      off = std::isfinite(change) ? std::max(off, change) : INFINITY;
    }
  attack.hold("force off the one before any relaxation, relative", off, 1e-15, "no time, no relaxation: rounding");
}

TEST(StabilityLongRuns, AnyTimeStepUnderEveryLaw) {
  StabilityCase attack(
      "A loop that stalls for ten seconds, or calls twice in a nanosecond, must not allow a jump of the force.");
  SceneDef def;
  def.force_limit = 0.1, def.force_slew = 0.2, def.law = PALPATE_LAW_COULOMB, def.relaxation = brain();
  Played played(def);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> exponent(-9, 1), unit(-1, 1);
  double over = 0;
  Vector3d last = Vector3d::Zero();
  for (int s = 0; s < quick_or_long(20000, 2000000); ++s) {
    const double dt = std::pow(10.0, exponent(random));
    const Vector3d p(0.058 + 0.004 * unit(random), 0.025, 0.02);
    played.touch(p, {0.03, 0.025, 0.1}, Vector3d::Zero(), dt);
    const Vector3d force(played.tool(0).force);
    over = force.allFinite() ? std::max(over, (force - last).norm() / (0.2 * std::min(dt, 0.02))) : INFINITY;
    over = std::max(over, force.norm() / 0.1), last = force;
  }
  attack.hold("force and its change over their limits, steps of 1 ns to 10 s", over, 1 + 1e-6,
              "force_limit, and force_slew for 20 ms at most; a change of 2e-10 N is rounded at 1e-17");
}

}  // namespace
}  // namespace palpate::tests
