// Force that relaxes under a held displacement, against the closed form of ramp and hold, at any time step.
#include "runtime/relaxation/prony_series.h"

#include <functional>
#include <random>

#include "runtime/base/exponential.h"
#include "tests/runtime/asked_scene.h"
#include "tests/support/relaxation.h"

namespace palpate::tests {
namespace {

// Force at time t where F_e rises to 1 in `rise` seconds and stays: the integral of R over the ramp.
double ramp_and_hold(double t, double rise) {
  const palpate_relaxation_def r = brain();
  double force = std::min(t, rise) / rise;
  for (int i = 0; i < r.terms; ++i) {
    const double tau = r.time[i], ramp = std::min(t, rise);
    // h_i = tau / rise (exp(-(t - ramp) / tau) - exp(-t / tau))
    const double part = tau / rise * std::exp(-(t - ramp) / tau) * -std::expm1(-ramp / tau);
    force -= r.share[i] * (ramp / rise - part);
  }
  return force;
}

TEST(Relaxation, OneMinusExponentialIsThatOfTheMathematicsLibrary) {
  for (double x = 1e-12; x < 200; x *= 1.3)
    EXPECT_NEAR(one_minus_exp(x), -std::expm1(-x), 4e-15 * -std::expm1(-x)) << x;
  EXPECT_EQ(one_minus_exp(0), 0);
  for (double x = 1e-300; x < 1e300; x *= 1.7)
    EXPECT_NEAR(natural_log(x), std::log(x), 3e-16 * (1 + std::abs(std::log(x)))) << x;
  EXPECT_EQ(natural_log(1), 0);
}

TEST(Relaxation, OfRampAndHoldIsTheClosedFormAtEveryTimeStep) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> exponent(-9, 1);
  for (const double rise : {1e-6, 0.02, 3.0, 400.0}) {
    PronySeries series;
    ASSERT_TRUE(series.set(brain()));
    PronySeries::Memory memory;
    double t = 0;
    for (int s = 0; s < 3000; ++s) {
      // Steps from 1e-9 to 10 s; no step crosses the end of the ramp, where the force is not a straight line.
      double dt = std::pow(10.0, exponent(random));
      if (t < rise && t + dt > rise) dt = rise - t;
      t += dt;
      const double force = series.step(memory, {0, 0, std::min(1.0, t / rise)}, dt).z;
      EXPECT_NEAR(force, ramp_and_hold(t, rise), 1e-11) << "rise " << rise << " s, at " << t << " s";  // 3000 roundings
    }
  }
}

// Force at the end of a ramp, in the given number of equal steps.
double ramp(double seconds, int steps, const std::function<double(double)>& elastic) {
  PronySeries series;
  EXPECT_TRUE(series.set(brain()));
  PronySeries::Memory memory;
  double force = 0;
  for (int s = 1; s <= steps; ++s)
    force = series.step(memory, {elastic(static_cast<double>(s) / steps), 0, 0}, seconds / steps).x;
  return force;
}

// The ramp test: 30 % of 13 mm at the three rates at which swine brain was compressed.
constexpr double kCompressed = 3.9;                            // mm
constexpr double kRates[] = {500. / 60, 5. / 60, 0.005 / 60};  // mm/s

// Miller and Chinzei's instantaneous stress: J1 = l^2 + 2/l, J2 = 2 l + 1/l^2, C100 = C010 = 263 Pa, C200 = C020 = 491 Pa.
double brain_stress_at_once(double strain) {
  const double l = 1 - strain, j1 = l * l + 2 / l, j2 = 2 * l + 1 / (l * l);
  return -2 * (1 - 1 / (l * l * l)) * (l * (263 + 982 * (j1 - 3)) + 263 + 982 * (j2 - 3));
}

TEST(Relaxation, OfTheModelAtOnceGivesThePublishedStressesAtEachRate) {
  // Nominal stress, Pa, at strains of 5, 10 .. 30 %, computed independently from the same constants, to 1 Pa.
  const double published[][6] = {
      {170, 394, 735, 1294, 2242, 3870}, {98, 219, 402, 703, 1213, 2089}, {33, 78, 148, 264, 460, 798}};
  for (int r = 0; r < 3; ++r)
    for (int k = 0; k < 6; ++k) {
      const double strain = 0.05 * (k + 1);
      const double stress =
          ramp(strain * 13 / kRates[r], 3000, [&](double part) { return brain_stress_at_once(part * strain); });
      EXPECT_NEAR(stress, published[r][k], 0.6) << kRates[r] << " mm/s, strain " << strain;
    }
}

TEST(Relaxation, ActsOnAToolsForceAndOnNothingElse) {
  const TouchedBox box;
  SceneDef def = unlimited_def();
  TouchedScene elastic(box, def);
  def.relaxation = brain();
  TouchedScene relaxing(box, def);
  const std::vector<palpate_grip> grips = {grip_at_node(box.touchable[5], {-0.001, 0.0005, 0.0002})};
  palpate_tool tool = tool_of(grips);
  tool.hold = 1;
  elastic.touch({tool}, 0.01);
  const Eigen::Vector3d whole(elastic.tool().force_raw);
  for (int s = 1; s <= 400; ++s) {
    relaxing.touch({tool}, 0.01);
    const Eigen::Vector3d force(relaxing.tool().force_raw);
    EXPECT_LT((force - ramp_and_hold(0.01 * s, 0.01) * whole).norm(), 1e-11 * whole.norm()) << s;
    EXPECT_EQ(Eigen::Vector3d(relaxing.contacts.nodes()[0].force), Eigen::Vector3d(elastic.contacts.nodes()[0].force));
  }
  EXPECT_EQ(relaxing.shape(), elastic.shape());
  // Reset clears the memory.
  relaxing.reset();
  relaxing.touch({tool}, 0.01);
  EXPECT_LT((relaxing.force() - ramp_and_hold(0.01, 0.01) * whole).norm(), 1e-12 * whole.norm());
}

TEST(Relaxation, NeverPullsAToolThatDoesNotHold) {
  const TouchedBox box;
  TouchedScene scene(box, unlimited_def(brain()));
  const std::int32_t triangle = box.far_triangle(5);
  const Eigen::Vector3d place = box.place(triangle, {.3, .3, .4}), out = box.outward(triangle);
  const auto press = [&](double depth, double dt) {
    const Eigen::Vector3d p = place - depth * out;
    scene.touch({point_tool(p.data())}, dt);
    return scene.force().dot(out);
  };
  press(-1e-4, 0.001);
  EXPECT_GT(press(0.003, 0.01), 0);
  for (int s = 0; s < 100; ++s) EXPECT_GT(press(0.003, 1), 0);
  // A sudden retreat by half: the relaxed tissue has not recovered.
  EXPECT_EQ(press(0.0015, 0.001), 0);
  EXPECT_EQ(press(-0.001, 0.001), 0);
  // A second press soon after is softer than the first; one much later equals the first.
  const double soon = press(0.003, 0.01);
  press(-0.001, 0.001);
  for (int s = 0; s < 100; ++s) press(-0.001, 10);
  const double late = press(0.003, 0.01);
  EXPECT_LT(soon, 0.9 * late);
}

TEST(Relaxation, RefusesNumbersThatAreNone) {
  const TouchedBox box;
  const auto status = [&](auto change) {
    SceneDef def = with(SceneDef(), brain());
    change(def);
    return refusal_of(box, def).status;
  };
  EXPECT_EQ(status([](auto&) {}), PALPATE_OK);
  EXPECT_EQ(status([](auto& d) { d.relaxation.terms = 9; }), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(status([](auto& d) { d.relaxation.share[0] = 0.7; }), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(status([](auto& d) { d.relaxation.share[1] = NAN; }), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(status([](auto& d) { d.relaxation.time[1] = 0; }), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(status([](auto& d) { d.force = PALPATE_FORCE_OFF; }), PALPATE_ERROR_ARGUMENT);
}

}  // namespace
}  // namespace palpate::tests
