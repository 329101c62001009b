// The quasi-non-linear correction at zero and at any length, for fits of arbitrary data, and over a cycle of motion.
#include <random>

#include "formats/errors.h"
#include "precompute/run/response_fit.h"
#include "runtime/tissue/response_curve.h"
#include "tests/runtime/touched_box.h"
#include "tests/stability/stability_case.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

// Stiffening, as compressed tissue: y = x + x^2 / a + x^3 / a^2 on [0, range], as Chebyshev coefficients (response_test.cpp).
std::vector<double> stiffening(double range, double a) {
  const double h = range / 2, b = h * h / a, c = h * h * h / (a * a);
  return {h + 1.5 * b + 2.5 * c, h + 2 * b + 3.75 * c, 0.5 * b + 1.5 * c, 0.25 * c};
}
const TouchedBox& box() {
  static const TouchedBox shared({}, [](BundleParts& parts) {
    parts.set(formats::SectionId::response_radial, {4}, stiffening(0.002, 0.004));
    parts.set(formats::SectionId::response_force, {4}, stiffening(0.5, 0.3));
    parts.set(formats::SectionId::response_range, {2}, std::vector<double>{0.002, 0.5});
  });
  return shared;
}

struct Corrected : TouchedScene {
  Corrected() : TouchedScene(box(), unlimited_def(PALPATE_RADIAL_RESPONSE, PALPATE_FORCE_RESPONSE)) {}
  // The force of the organ on each tool.
  std::vector<Vector3d> hold(const std::vector<std::vector<palpate_grip>>& grips) {
    std::vector<palpate_tool> tools;
    for (const auto& of_one : grips) tools.push_back(tool_of(of_one));
    touch(tools);
    std::vector<Vector3d> forces;
    for (std::int32_t t = 0; t < contacts->tool_count; ++t) forces.push_back(force(t));
    return forces;
  }
  double direction_length() { return Vector3d(tool().direction).norm(); }
};

std::vector<palpate_grip> face_moved(const Vector3d& d) {
  std::vector<palpate_grip> grips;
  for (const std::int32_t n : box().body.triangles[box().far_triangle()]) grips.push_back(grip_at_node(n, d));
  return grips;
}

TEST(StabilityCorrection, AtNoLengthAndFarOutsideTheRange) {
  StabilityCase attack(
      "P(r) / r and Q(f) / f are 0 / 0 at zero and overflow at a denormal; a polynomial of degree ten far outside its "
      "range is rounding to the tenth power.");
  ResponseCurve curve;
  const std::vector<double> c = stiffening(0.5, 0.3);
  ASSERT_TRUE(curve.set(c.data(), 4, 0.5));
  double at_zero = 0, odd = 0, fall = 0, before = 0;
  for (const double x : {0.0, -0.0, 5e-324, 1e-310, 2.3e-308, 1e-200, 1e-20})
    at_zero = std::max(at_zero, std::abs(curve.ratio(x) - 1));
  for (double x = 1e-320; x < 1e300; x *= 1.7) {
    const double y = curve.value(x);
    odd = std::max(odd, std::abs(y + curve.value(-x)));
    fall = std::isfinite(y) ? std::max(fall, before - y) : INFINITY;
    before = y;
  }
  attack.hold("slope near zero, off the one of the curve", at_zero, 1e-14, "rounding of four terms near one");
  attack.hold("value at -x off minus that at x", odd, 0,
              "the curve is odd: reversing the direction reverses the force");
  attack.hold("fall from 1e-320 to 1e300, N", fall, 0,
              "monotone, and continued linearly with the slope at the end of the range");
}

TEST(StabilityCorrection, ScenesFromNoMotionToTenOrgans) {
  StabilityCase attack(
      "A tool that does not move has no direction: dividing by its length gives NaN in force and shape.");
  Corrected scene;
  const Vector3d along = Vector3d(-0.8, 0.5, 0.33).normalized();
  double before = 0, fall = 0, asymmetry = 0, askew = 0;
  bool finite = true, flagged = true;
  for (const double size :
       {0.0, 5e-324, 1e-310, 1e-200, 1e-160, 1e-155, 1e-150, 1e-100, 1e-30, 1e-12, 1e-6, 1e-3, 0.06, 0.6}) {
    const Vector3d there = scene.hold({face_moved(size * along)})[0];
    const double length = scene.direction_length();
    askew = std::max(askew, std::min(length, std::abs(length - 1)));
    for (const float x : scene.shape()) finite = finite && std::isfinite(x);
    flagged = flagged && (size < 0.06 || (scene.flags & PALPATE_STEP_RESPONSE_RANGE));
    const Vector3d back = scene.hold({face_moved(-size * along)})[0];
    finite = finite && there.allFinite() && back.allFinite();
    asymmetry = std::max(asymmetry, (there + back).norm() / std::max(there.norm(), 1e-300));
    fall = std::max(fall, before - there.norm()), before = there.norm();
  }
  attack.hold("answers that are not finite", finite ? 0 : 1, 0, "zero length: the result is zero, no NaN");
  attack.hold("length of the direction off 1, or off 0", askew, 1e-15,
              "a unit vector, or zero if the squares underflow");
  attack.hold("use outside the range without a flag", flagged ? 0 : 1, 0, "PALPATE_STEP_RESPONSE_RANGE");
  attack.hold("force reversed against the reverse of the force, relative", asymmetry, 1e-12,
              "P and Q are odd; rounding");
  attack.hold("fall of the force as the motion grows, N", fall, 0, "Q is monotone");
}

TEST(StabilityCorrection, MotionsOfAToolThatCancelButForRounding) {
  StabilityCase attack(
      "A tool that spreads its nodes imposes motions whose sum is zero, or rounding: the direction of this rounding "
      "would decide which part of the force is corrected.");
  Corrected scene;
  double length = 0;
  for (const double size : {1e-9, 1e-6, 1e-3}) {
    std::vector<palpate_grip> grips;
    for (const double part : {0.1, 0.2, -0.3})
      grips.push_back(grip_at_node(box().touchable[10 + 5 * grips.size()], {0, part * size, 0}));
    scene.hold({grips});
    length = std::max(length, scene.direction_length());
  }
  attack.hold("length of the direction", length, 0, "0.1 + 0.2 - 0.3 is rounding, not a direction");
}

TEST(StabilityCorrection, APinchUnderTheNoiseOfADevice) {
  StabilityCase attack(
      "Two opposed grips of one tool: the direction of the sum of their displacements is that of the noise, and P "
      "along "
      "a direction of noise moves the drawn surface by millimetres from frame to frame.");
  // With G the largest abs(P' - 1), and A how much the linear field exceeds what is imposed: the corrected part of the field is
  // share * (P(r) / r - 1) * (field across the direction). Its change per sum of the inputs' changes is at most 3 G A through the
  // share (3 t (1 - t / 1) <= 1.5 over kAgreed = 0.5), 4.5 G A through the direction (share / length of the sum <= 9 / 8 over 0.5,
  // times 2 for what turns), and G A through the field itself.
  const double g = 2 * 0.002 / 0.004 + 3 * 0.25, a = 1.5, bound = a + 8.5 * g * a;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  Corrected scene;
  std::int32_t low = -1, high = -1;
  for (const std::int32_t n : box().touchable) {
    if (box().node(n)[0] < 0.03) continue;
    if (low < 0 || box().node(n)[2] < box().node(low)[2]) low = n;
    if (high < 0 || box().node(n)[2] > box().node(high)[2]) high = n;
  }
  for (const double noise : {1e-7, 1e-5, 1e-3}) {
    std::vector<float> before;
    Vector3d first_before = Vector3d::Zero(), second_before = Vector3d::Zero();
    double worst = 0;
    for (int s = 0; s < quick_or_long(200, 20'000); ++s) {
      const Vector3d first = Vector3d(0, 0, 0.005) + noise * Vector3d::NullaryExpr([&](auto) { return any(random); }),
                     second = Vector3d(0, 0, -0.005) + noise * Vector3d::NullaryExpr([&](auto) { return any(random); });
      scene.hold({{grip_at_node(low, first), grip_at_node(high, second)}});
      const std::vector<float> u = scene.shape();
      double moved = 0;
      for (std::size_t i = 0; s > 0 && i < u.size(); i += 3)
        moved =
            std::max<double>(moved, std::hypot(u[i] - before[i], u[i + 1] - before[i + 1], u[i + 2] - before[i + 2]));
      // 6e-8 of 5 mm, for each of a few float operations.
      if (s > 0)
        worst = std::max(worst, (moved - 3e-9) / ((first - first_before).norm() + (second - second_before).norm()));
      before = u, first_before = first, second_before = second;
    }
    attack.hold(
        "change of the surface over that of the grips, noise " + std::to_string(1e6 * noise).substr(0, 4) + " um",
        worst, bound, "1.5 + 8.5 x 1.75 x 1.5: through share, direction and field");
  }
}

TEST(StabilityCorrection, TwoToolsThatPullOneNodeApart) {
  StabilityCase attack(
      "Two tools with opposite directions at one node: their displacements cancel, and each tool's force is as large "
      "as the regularised system allows.");
  Corrected scene;
  const std::int32_t node = box().touchable[20];
  double worst = 0, shape = 0;
  for (const double size : {1e-9, 1e-6, 1e-4, 1e-3}) {
    const Vector3d d(0, size, 0);
    const auto forces = scene.hold({{grip_at_node(node, d)}, {grip_at_node(node, -d)}});
    EXPECT_TRUE(scene.flags & PALPATE_STEP_REGULARISED);
    for (const Vector3d& f : forces) worst = f.allFinite() ? worst : INFINITY;
    worst = std::max(worst, (forces[0] + forces[1]).norm() / forces[0].norm());
    for (const float x : scene.shape()) shape = std::isfinite(x) ? std::max(shape, std::abs(x) / size) : INFINITY;
  }
  attack.hold("sum of the two forces over one of them", worst, 1e-9, "Q is odd, and the node must not move");
  attack.hold("largest displacement of the shape over the targets", shape, 1, "two opposite contributions cancel");
}

TEST(StabilityCorrection, PushedAndReleasedInACycle) {
  StabilityCase attack(
      "In an elastic law, the force on the way out equals that on the way in. A force that depends on the direction of "
      "motion would add energy in every cycle, and a haptic device would vibrate.");
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  double net = 0;
  for (int cycle = 0; cycle < quick_or_long(50, 5000); ++cycle) {
    Corrected scene;
    const Vector3d most = 0.01 * Vector3d(any(random), any(random), any(random));
    double work = 0, effort = 0;
    Vector3d at = Vector3d::Zero(), force = Vector3d::Zero();
    for (int s = 1; s <= 200; ++s) {
      const Vector3d d = (s <= 100 ? s : 200 - s) / 100.0 * most, f = scene.hold({face_moved(d)})[0];
      const double step = -0.5 * (force + f).dot(d - at);
      work += step, effort += std::abs(step), at = d, force = f;
    }
    net = std::max(net, std::abs(work) / effort);
  }
  attack.hold("net work over the work done, in and out along one line", net, 1e-12,
              "each displacement has one force: 200 roundings, and those of the contact system");
}

TEST(StabilityCorrection, FitsOnDataThatNoTissueGave) {
  StabilityCase attack(
      "Least squares of degree 4 to 10 on noise, on a plateau, on data that fall, on points that coincide: the "
      "polynomial "
      "may swing, turn negative, or come from a singular matrix.");
  std::mt19937 random(23);
  std::normal_distribution<double> noise;
  std::uniform_real_distribution<double> share(0, 1);
  struct Data {
    const char* name;
    std::function<double(double)> value;
  };
  const Data kinds[] = {
      {"noise of a tenth", [&](double x) { return x * x + 0.1 * noise(random); }},
      {"noise alone", [&](double) { return std::abs(noise(random)); }},
      {"constant", [](double) { return 1.0; }},
      {"falling", [](double x) { return 1 - 0.9 * x; }},
      {"up and down", [](double x) { return 1 + std::sin(20 * x); }},
      {"a step", [](double x) { return x < 0.5 ? 1e-6 : 1.0; }},
      {"a spike", [](double x) { return std::abs(x - 0.5) < 0.02 ? 100.0 : x; }},
      {"tiny", [](double x) { return 1e-300 * x; }},
      {"huge", [](double x) { return 1e300 * x * x; }},
  };
  double fall = 0, at_zero = 0;
  int silent = 0, fits = 0, refused = 0;
  for (const Data& kind : kinds)
    for (const int points : {1, 2, 3, 4, 5, 8, 40, 1000})
      for (int degree = 4; degree <= 10; ++degree)
        for (const bool uneven : {false, true}) {
          std::vector<double> x, y;
          for (int i = 1; i <= points; ++i)
            x.push_back(uneven ? std::pow(static_cast<double>(i) / points, 6) : static_cast<double>(i) / points);
          for (const double at : x) y.push_back(kind.value(at));
          ResponsePolynomial p;
          try {
            p = fit_response(x, y, degree, kind.name);
          } catch (const InputError& error) {
            refused += 1, silent += std::string(error.what()).empty();
            continue;
          }
          ++fits;
          const double largest =
              *std::max_element(y.begin(), y.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
          at_zero = std::max(at_zero, std::abs(p(0) / largest));
          double before = p(0);
          for (int i = 1; i <= 300; ++i) {
            const double now = p(p.range * i / 300);
            fall = std::isfinite(now) ? std::max(fall, (before - now) / std::abs(largest)) : INFINITY;
            before = now;
          }
        }
  EXPECT_GT(fits, 500);
  attack.hold("fall of " + std::to_string(fits) + " fits, over the largest datum", fall, 1e-12,
              "monotone, but for rounding");
  attack.hold("value at zero, over the largest datum", at_zero, 1e-15 * 11,
              "through the origin: the last sum of 11 terms");
  attack.hold("refusals without a sentence, of " + std::to_string(refused), silent, 0,
              "fewer than four points are refused");
}

}  // namespace
}  // namespace palpate::tests
