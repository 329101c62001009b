// The quasi-non-linear corrections P and Q: the paper's rule for one tool, ours for several, and the ends of the range.
#include "runtime/tissue/response_curve.h"

#include "tests/runtime/touched_box.h"

namespace palpate::tests {
namespace {

// y = x + x^2 / scale + x^3 / scale^2 on [0, range], as Chebyshev coefficients: with x = range (t + 1) / 2,
// (t + 1)^2 = 3/2 + 2 t + T_2 / 2 and (t + 1)^3 = 5/2 + 15/4 t + 3/2 T_2 + T_3 / 4.
struct Cubic {
  double range, scale;
  double operator()(double x) const { return x + x * x / scale + x * x * x / (scale * scale); }
  double slope(double x) const { return 1 + 2 * x / scale + 3 * x * x / (scale * scale); }
  std::vector<double> coefficients() const {
    const double a = range / 2, b = a * a / scale, c = a * a * a / (scale * scale);
    return {a + 1.5 * b + 2.5 * c, a + 2 * b + 3.75 * c, 0.5 * b + 1.5 * c, 0.25 * c};
  }
};
constexpr Cubic kP{0.002, 0.004}, kQ{0.5, 0.3};

void add_curves(BundleParts& parts) {
  using formats::SectionId;
  parts.set(SectionId::response_radial, {4}, kP.coefficients());
  parts.set(SectionId::response_force, {4}, kQ.coefficients());
  parts.set(SectionId::response_range, {2}, std::vector<double>{kP.range, kQ.range});
}
const TouchedBox& box() {
  static const TouchedBox shared({}, add_curves);
  return shared;
}
SceneDef corrected_def() {
  return unlimited_def(PALPATE_RADIAL_RESPONSE, PALPATE_FORCE_RESPONSE);
}
Eigen::Vector3d at(const std::vector<float>& u, int n) {
  return {u[3 * n], u[3 * n + 1], u[3 * n + 2]};
}

TEST(ResponseCurve, ReproducesItsPolynomialOddlyAndContinuesItLinearly) {
  ResponseCurve curve;
  ASSERT_TRUE(curve.set(kQ.coefficients().data(), 4, kQ.range));
  for (double x = 0; x <= 0.5; x += 0.01) {
    EXPECT_NEAR(curve.value(x), kQ(x), 1e-14);  // rounding of numbers near one
    EXPECT_EQ(curve.value(-x), -curve.value(x));
  }
  EXPECT_NEAR(curve.ratio(0), 1, 1e-14);
  EXPECT_NEAR(curve.ratio(1e-300), 1, 1e-14);
  EXPECT_NEAR(curve.value(0.9), kQ(0.5) + 0.4 * kQ.slope(0.5), 1e-13);
  EXPECT_TRUE(curve.outside(0.51) && curve.outside(-0.51) && !curve.outside(0.5));
}

// ---- which curves are one: formats/response_check.h ----------------------------------------------------------------

// Chebyshev coefficients of y on [0, 1], by interpolation.
std::vector<double> coefficients_of(int count, const std::function<double(double)>& y) {
  std::vector<double> c(static_cast<std::size_t>(count), 0.0);
  for (int p = 0; p < count; ++p) {
    const double angle = M_PI * (p + 0.5) / count, value = y((std::cos(angle) + 1) / 2);
    for (int k = 0; k < count; ++k) c[k] += (k == 0 ? 1.0 : 2.0) / count * value * std::cos(k * angle);
  }
  c[0] = 0;  // such that y(0) = sum (-1)^k c_k is zero
  for (int k = 1; k < count; ++k) c[0] += (k % 2 ? 1 : -1) * c[k];
  return c;
}
formats::ResponseFault fault_of(const std::vector<double>& c, double range = 1) {
  return formats::check_response(c.data(), c.size(), range).fault;
}

TEST(ResponseCheck, TakesEveryCurveThatRisesFromZero) {
  using formats::ResponseFault;
  const std::vector<std::function<double(double)>> rising = {
      [](double x) { return x; },
      [](double x) { return 900 * x; },
      [](double x) { return x * x; },                          // flat at the start
      [](double x) { return 2 * x - x * x; },                  // flat at the end
      [](double x) { return std::expm1(6 * x) / 6; },          // stiffens 400-fold
      [](double x) { return x - std::sin(12.5 * x) / 12.5; },  // flat, but nowhere falling, in the middle
      [](double x) { return std::pow(x - 0.5, 3) + 0.125; },
  };
  for (std::size_t i = 0; i < rising.size(); ++i)
    for (const int count : {8, 17, 33}) {
      if (i == 5 && count < 33) continue;  // fewer coefficients do not resolve it
      EXPECT_EQ(fault_of(coefficients_of(count, rising[i])), ResponseFault::none) << i << " " << count;
    }
  EXPECT_EQ(fault_of(kP.coefficients(), kP.range), ResponseFault::none);
  EXPECT_EQ(fault_of(kQ.coefficients(), kQ.range), ResponseFault::none);
}

TEST(ResponseCheck, FindsTheDipHoweverNarrow) {
  using formats::ResponseFault;
  for (const double depth : {1.02, 1.1, 3.0})
    for (const double waves : {3.0, 9.0, 20.0}) {
      // The slope falls below zero by (depth - 1) on a few hundredths of the range.
      const auto y = [&](double x) { return x - depth * std::sin(waves * x) / waves + (depth - 1) * x; };
      const std::vector<double> c = coefficients_of(33, y);
      const formats::ResponseVerdict verdict = formats::check_response(c.data(), c.size(), 1);
      // y' = depth (1 - cos) >= 0: rises; and with more of the sine it falls.
      EXPECT_EQ(verdict.fault, ResponseFault::none) << depth << " " << waves;
      const std::vector<double> falls =
          coefficients_of(33, [&](double x) { return y(x) - 0.01 * depth * std::sin(waves * x) / waves; });
      EXPECT_EQ(fault_of(falls), ResponseFault::falls) << depth << " " << waves;
    }
}

TEST(ResponseCheck, SaysWhichRuleACurveBreaks) {
  using formats::ResponseFault;
  EXPECT_EQ(fault_of({0.5, 0.5}), ResponseFault::none);
  EXPECT_EQ(fault_of({5.5, 0.5}), ResponseFault::origin);
  EXPECT_EQ(fault_of({0.5 + 1e-7, 0.5}), ResponseFault::origin);
  EXPECT_EQ(fault_of({0.5 + 1e-12, 0.5}), ResponseFault::none) << "rounding";
  EXPECT_EQ(fault_of({0, 0}), ResponseFault::falls);
  EXPECT_EQ(fault_of({-0.5, -0.5}), ResponseFault::falls);
  EXPECT_EQ(fault_of({501, 501}), ResponseFault::scale);
  EXPECT_EQ(fault_of({4.9e-4, 4.9e-4}), ResponseFault::scale);
  EXPECT_EQ(fault_of({0.5, NAN}), ResponseFault::not_finite);
  EXPECT_EQ(fault_of({0.5, INFINITY}), ResponseFault::not_finite);
  EXPECT_EQ(fault_of({0.5, 0.5}, 0), ResponseFault::not_finite);
  EXPECT_EQ(fault_of({0.5, 0.5}, INFINITY), ResponseFault::not_finite);
  EXPECT_EQ(fault_of({0.5}), ResponseFault::count);
  EXPECT_EQ(fault_of(std::vector<double>(34, 0.5)), ResponseFault::count);
}

TEST(ResponseCurve, RefusesUnusableNumbers) {
  ResponseCurve curve;
  const double good[3] = {1, 1, 0}, bad[3] = {1, NAN, 0};
  EXPECT_FALSE(curve.set(bad, 3, 1));
  EXPECT_FALSE(curve.set(good, 3, 0));
  EXPECT_FALSE(curve.set(good, 3, INFINITY));
  EXPECT_FALSE(curve.set(good, 1, 1));
  EXPECT_FALSE(curve.set(good, 1000, 1));
}

struct Step {
  std::vector<float> u;
  Eigen::Vector3d force;
  std::vector<Eigen::Vector3d> node_force;
  palpate_step_flags touch_flags, shape_flags;
};
Step step(const SceneDef& def, const std::vector<std::vector<palpate_grip>>& grips) {
  TouchedScene scene(box(), def);
  std::vector<palpate_tool> tools;
  for (const auto& one : grips) tools.push_back(tool_of(one));
  Step result;
  result.touch_flags = scene.touch(tools);
  result.u = scene.shape(&result.shape_flags);
  result.force = scene.force();
  for (int e = 0; e < scene.contacts->node_count; ++e) result.node_force.emplace_back(scene.contacts.nodes()[e].force);
  return result;
}

TEST(Radial, CorrectsTheOrthogonalPartOfOneToolAsThePaperDoes) {
  const Eigen::Vector3d d(-0.003, 0.0004, 0.0002);
  const std::vector<std::vector<palpate_grip>> grips = {{grip_at_place(box().far_triangle(), {.3, .3, .4}, d)}};
  const Step linear = step(unlimited_def(), grips), corrected = step(corrected_def(), grips);
  for (int n = 0; n < box().body.surface_nodes; ++n) {
    const Eigen::Vector3d u = at(linear.u, n), along = d.normalized().dot(u) * d.normalized(), orthogonal = u - along;
    const double r = orthogonal.norm();
    const Eigen::Vector3d expected = along + (r > 0 ? kP(r) / r * orthogonal : orthogonal);
    EXPECT_LT((at(corrected.u, n) - expected).norm(), 1e-6 * d.norm());  // f32
  }
  EXPECT_EQ(corrected.shape_flags, 0u);
}

TEST(Radial, AddsTheCorrectedContributionsOfTwoTools) {
  // Two tools that press towards each other. Each contribution is found from the contact entries one tool at a time.
  const std::int32_t top = box().touchable[box().touchable.size() - 1], other = box().touchable[7];
  const Eigen::Vector3d d(0, 0.0003, -0.0006), e = -d;  // within the range of P
  const std::vector<std::vector<palpate_grip>> grips = {{grip_at_node(top, d)}, {grip_at_node(other, e)}};
  const ScenePointer linear = box().scene(unlimited_def());
  const palpate_tool tools[2] = {tool_of(grips[0]), tool_of(grips[1])};
  Contacts contacts(linear.get());
  palpate_scene_touch(linear.get(), tools, 2, 1e-3, contacts.get(), contacts.bytes());
  const auto nodes = const_cast<palpate_contact_node*>(contacts.nodes());
  const auto alone = [&](int t) {
    Contacts one(linear.get());
    one.memory = contacts.memory;
    auto* entry = const_cast<palpate_contact_node*>(one.nodes());
    for (double& x : entry[1 - t].modified_displacement) x = 0;
    return displacements(linear.get(), one.get(), box().body.surface_nodes);
  };
  ASSERT_EQ(contacts->node_count, 2);
  ASSERT_EQ(nodes[0].index, 0);
  const auto first = alone(0), second = alone(1);
  const Step corrected = step(corrected_def(), grips);
  const Eigen::Vector3d direction = d.normalized();
  const auto correct = [&](const Eigen::Vector3d& u) -> Eigen::Vector3d {
    const Eigen::Vector3d along = direction.dot(u) * direction, orthogonal = u - along;
    const double r = orthogonal.norm();
    return along + (r > 0 ? kP(r) / r : 1) * orthogonal;
  };
  for (int n = 0; n < box().body.surface_nodes; ++n)
    EXPECT_LT((at(corrected.u, n) - correct(at(first, n)) - correct(at(second, n))).norm(), 1e-6 * d.norm());  // f32
}

TEST(Response, GivesZeroWithoutMotion) {
  const std::vector<std::vector<palpate_grip>> grips = {{grip_at_node(box().touchable[5], {0, 0, 0})}};
  const Step still = step(corrected_def(), grips);
  EXPECT_EQ(still.force.norm(), 0);
  for (const float x : still.u) EXPECT_EQ(x, 0);
  EXPECT_EQ(still.touch_flags | still.shape_flags, 0u);
}

TEST(Response, KeepsToolsWithoutADirectionLinear) {
  // One tool holds nodes at zero displacement while another pushes. The first tool has no direction, and its nodes must not move.
  const std::int32_t still = box().touchable[5], pushed = box().touchable[20];
  const std::vector<std::vector<palpate_grip>> grips = {{grip_at_node(still, {0, 0, 0})},
                                                        {grip_at_node(pushed, {0, 0.002, 0})}};
  const Step linear = step(unlimited_def(), grips), both = step(corrected_def(), grips);
  for (const float x : both.u) EXPECT_TRUE(std::isfinite(x));
  EXPECT_GT(both.force.norm(), 0);
  EXPECT_EQ(both.force, linear.force);
}

// Eqs 5 and 6: F = F^t + F^r along and across the motion; F^t becomes Q(|F^t|), and F^r stays.
TEST(Response, ChangesTheForceOfOneNodeAlongTheToolsDirectionAlone) {
  for (const Eigen::Vector3d& d : {Eigen::Vector3d(-0.002, 0.0004, 0.0002), {0.001, 0.0007, -0.0011}, {0, 0, 0.0015}}) {
    const std::vector<std::vector<palpate_grip>> grips = {{grip_at_node(box().touchable[20], d)}};
    const Step linear = step(unlimited_def(), grips), corrected = step(corrected_def(), grips);
    const Eigen::Vector3d unit = d.normalized();
    const double along = -linear.force.dot(unit);
    const Eigen::Vector3d across = linear.force + along * unit;
    ASSERT_GT(along, 0);
    ASSERT_LT(along, kQ.range);
    ASSERT_GT(across.norm(), 0.02 * along);  // so that a scaled whole vector is another one
    EXPECT_LT((corrected.force - (across - kQ(along) * unit)).norm(), 1e-14);  // rounding of forces below 1 N
    EXPECT_LT((corrected.node_force[0] + corrected.force).norm(), 1e-16);
  }
}

// One node each of the three of a triangle: the resultant's part along the motion becomes Q of itself.
std::vector<palpate_grip> grips_of_far_triangle(const Eigen::Vector3d& d) {
  std::vector<palpate_grip> grips;
  for (const std::int32_t n : box().body.triangles[box().far_triangle()]) grips.push_back(grip_at_node(n, d));
  return grips;
}

TEST(Response, SharesQOfAToolsResultantAmongItsNodesAsTheirPartsAlongItsMotion) {
  const Eigen::Vector3d d(-0.002, 0.0004, 0.0002), unit = d.normalized();
  const std::vector<palpate_grip> grips = grips_of_far_triangle(d);
  const Step linear = step(unlimited_def(), {grips}), corrected = step(corrected_def(), {grips});
  const double along = -linear.force.dot(unit);
  ASSERT_GT(along, 0);
  ASSERT_LT(along, kQ.range);
  const double factor = kQ(along) / along;
  EXPECT_NEAR(-corrected.force.dot(unit), kQ(along), 1e-12);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t e = 0; e < grips.size(); ++e) {
    const Eigen::Vector3d f = linear.node_force[e];
    EXPECT_LT((corrected.node_force[e] - (f + (factor - 1) * f.dot(unit) * unit)).norm(), 1e-12);
    sum += corrected.node_force[e];
  }
  EXPECT_LT((sum + corrected.force).norm(), 1e-12);
}

TEST(Response, ReportsContactsAndTorqueOfTheCorrectedForces) {
  SceneDef def = with(corrected_def(), PALPATE_REPORT_CONTACTS, PALPATE_CONTACT_PATCH);
  def.torque_limit = def.torque_slew = INFINITY;
  TouchedScene scene(box(), def);
  const Eigen::Vector3d d(-0.002, 0.0004, 0.0002), reference(0.1, -0.02, 0.05);
  const std::vector<palpate_grip> grips = grips_of_far_triangle(d);
  palpate_tool tool = tool_of(grips);
  tool.has_torque = 1;
  Eigen::Map<Eigen::Vector3d>(tool.reference) = reference;
  scene.touch({tool});
  const palpate_tool_state& state = scene.tool();
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = force;
  for (std::size_t i = 0; i < grips.size(); ++i) {
    const palpate_contact& contact =
        *palpate_report_contact(palpate_scene_report(scene.get()), static_cast<std::int32_t>(i));
    const Eigen::Vector3d f(contact.force), place(contact.tool_point);
    force += f, torque += (place - reference).cross(f);
  }
  EXPECT_GT(force.norm(), 0.05);
  EXPECT_LT((force - Eigen::Vector3d(state.force_raw)).norm(), 1e-14);
  EXPECT_LT((torque - Eigen::Vector3d(state.torque_raw)).norm(), 1e-15);
}

// A grasp turns and pulls: what Q adds to its forces is along the direction, and so has no moment about it.
TEST(Response, AddsToAGraspsTorqueTheMomentOfWhatItAddsToItsForces) {
  palpate_grasp grasp = palpate_default_grasp();
  grasp.triangle = box().far_triangle(), grasp.radius = 0.012;
  for (double& k : grasp.barycentric) k = 1.0 / 3;
  const auto held = [&](SceneDef def, const Eigen::Vector3d& reference) {
    def.torque_limit = def.torque_slew = INFINITY;
    def.collision = PALPATE_COLLISION_OFF, def.grasps.grasps = 1;
    TouchedScene scene(box(), def);
    palpate_tool tool = palpate_default_tool();
    tool.parts = &grasp.part, tool.has_torque = 1;
    Eigen::Map<Eigen::Vector3d>(tool.reference) = reference;
    palpate_grasp moved = grasp;
    for (const double way : {0.0, 1.0}) {
      moved.position[0] = -0.002 * way, moved.position[1] = 0.001 * way;
      moved.orientation[0] = std::cos(0.1 * way), moved.orientation[2] = std::sin(0.1 * way);
      tool.parts = &moved.part;
      scene.touch({tool});
    }
    return scene.tool();
  };
  const Eigen::Vector3d here(0.05, 0.01, 0.02), there(-0.1, 0.3, 0.2);
  const palpate_tool_state linear = held(unlimited_def(), here), corrected = held(corrected_def(), here),
                           about_there = held(corrected_def(), there);
  const Eigen::Vector3d unit(corrected.direction), force(corrected.force_raw), torque(corrected.torque_raw),
      added = torque - Eigen::Vector3d(linear.torque_raw);
  ASSERT_NEAR(unit.norm(), 1, 1e-12);
  ASSERT_GT((force - Eigen::Vector3d(linear.force_raw)).norm(), 0.1 * force.norm());
  ASSERT_GT(std::fabs(unit.dot(torque)), 0.02 * torque.norm());
  EXPECT_GT(added.norm(), 0.02 * torque.norm());
  EXPECT_LT(std::fabs(unit.dot(added)), 1e-14);  // rounding of torques below 0.1 N m
  EXPECT_LT((Eigen::Vector3d(about_there.torque_raw) - torque - (here - there).cross(force)).norm(), 1e-14);
}

// Q of the resultant, not node by node: a patch moved as one answers the same whether its resultant is carried by few
// or by many nodes. Here: the same patch, once gripped by its nodes and once with every node gripped twice.
TEST(Response, DoesNotDependOnHowManyNodesCarryTheForce) {
  const Eigen::Vector3d d(-0.002, 0, 0);
  std::vector<palpate_grip> grips;
  for (const std::int32_t n : box().body.triangles[box().far_triangle()]) grips.push_back(grip_at_node(n, d));
  std::vector<palpate_grip> twice = grips;
  twice.insert(twice.end(), grips.begin(), grips.end());
  const Step once = step(corrected_def(), {grips}), doubled = step(corrected_def(), {twice});
  EXPECT_LT((once.force - doubled.force).norm(),
            1e-5 * once.force.norm());  // the regularisation's 1e-6, through Q's slope
}

TEST(Response, SaysWhenItLeavesTheMeasuredRange) {
  const std::int32_t n = box().touchable[20];
  const Step inside = step(corrected_def(), {{grip_at_node(n, {0, 0.0005, 0})}});
  EXPECT_EQ(inside.touch_flags | inside.shape_flags, 0u);
  const Step outside = step(corrected_def(), {{grip_at_node(n, {0, 0.05, 0})}});
  EXPECT_EQ(outside.touch_flags, PALPATE_STEP_RESPONSE_RANGE);
  EXPECT_EQ(outside.shape_flags, PALPATE_STEP_RESPONSE_RANGE);
  for (const float x : outside.u) EXPECT_TRUE(std::isfinite(x));
}

// Two grips of one tool press a bar together from two sides by 5 mm. The direction of the sum of their displacements is noise.
std::vector<palpate_grip> pinch(const Eigen::Vector3d& first, const Eigen::Vector3d& second) {
  std::int32_t low = -1, high = -1;
  for (const std::int32_t n : box().touchable) {
    if (box().node(n)[0] < 0.03) continue;
    if (low < 0 || box().node(n)[2] < box().node(low)[2]) low = n;
    if (high < 0 || box().node(n)[2] > box().node(high)[2]) high = n;
  }
  return {grip_at_node(low, first), grip_at_node(high, second)};
}

TEST(Response, FadesWithTheDirectionAsAToolsMotionsCancel) {
  // From a push of both grips in one direction to a pinch, in small steps: direction, force and shape change in small steps.
  TouchedScene scene(box(), corrected_def());
  Eigen::Vector3d direction_before = Eigen::Vector3d::Zero(), force_before = Eigen::Vector3d::Zero();
  double longest_step = 0, largest_jump = 0, shortest = 1, longest = 0;
  constexpr int kSteps = 2000;
  for (int s = 0; s <= kSteps; ++s) {
    const double angle = 3.14159265358979 * s / kSteps;
    const Eigen::Vector3d first(0, 0, 0.002), second(0, 0.002 * std::sin(angle), 0.002 * std::cos(angle));
    const std::vector<palpate_grip> grips = pinch(first, second);
    scene.hold(grips);
    const palpate_tool_state* state = palpate_contacts_tool(scene.contacts, 0);
    const Eigen::Vector3d direction(state->direction), force(state->force_raw);
    shortest = std::min(shortest, direction.norm()), longest = std::max(longest, direction.norm());
    if (angle < 2.09) {  // 120 degrees: the sum is half of the lengths' sum
      EXPECT_NEAR(direction.norm(), 1, 1e-15);
    }
    if (s > 0) {
      longest_step = std::max(longest_step, (direction - direction_before).norm());
      largest_jump = std::max(largest_jump, (force - force_before).norm());
    }
    direction_before = direction, force_before = force;
  }
  EXPECT_LT(shortest, 1e-5);
  EXPECT_NEAR(longest, 1, 1e-15);
  // Per radian of the angle the length changes by at most 1.5 / kAgreed times 0.5, and the direction turns by a half.
  EXPECT_LT(longest_step, 2.1 * 3.14159265358979 / kSteps);
  EXPECT_LT(largest_jump, 0.01 * kQ.range);
}

}  // namespace
}  // namespace palpate::tests
