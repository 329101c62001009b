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
palpate_scene_def corrected_def() {
  palpate_scene_def def = unlimited_def();
  def.radial = PALPATE_RADIAL_RESPONSE, def.force = PALPATE_FORCE_RESPONSE;
  return def;
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
Step step(const palpate_scene_def& def, const std::vector<std::vector<palpate_grip>>& grips) {
  const ScenePointer scene = box().scene(def);
  std::vector<palpate_tool> tools;
  for (const auto& one : grips) tools.push_back(tool_of(one));
  Contacts contacts(scene.get());
  Step result;
  result.touch_flags = palpate_scene_touch(scene.get(), tools.data(), static_cast<int>(tools.size()), 1e-3,
                                           contacts.get(), contacts.bytes());
  result.u = displacements(scene.get(), contacts.get(), box().body.surface_nodes, &result.shape_flags);
  result.force = Eigen::Vector3d(palpate_contacts_tool(contacts, 0)->force_raw);
  for (int e = 0; e < contacts->node_count; ++e) result.node_force.emplace_back(contacts.nodes()[e].force);
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
  ASSERT_EQ(nodes[0].tool, 0);
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
  const Step both = step(corrected_def(), {{grip_at_node(still, {0, 0, 0})}, {grip_at_node(pushed, {0, 0.002, 0})}});
  for (const float x : both.u) EXPECT_TRUE(std::isfinite(x));
  EXPECT_TRUE(both.force.allFinite());
}

TEST(Response, ScalesAToolsForcesSoThatItsResultantAlongItsMotionBecomesQ) {
  const Eigen::Vector3d d(-0.002, 0.0004, 0.0002);
  std::vector<palpate_grip> grips;
  for (const std::int32_t n : box().body.triangles[box().far_triangle()]) grips.push_back(grip_at_node(n, d));
  const Step linear = step(unlimited_def(), {grips}), corrected = step(corrected_def(), {grips});
  const double along = -linear.force.dot(d.normalized());
  ASSERT_GT(along, 0);
  ASSERT_LT(along, kQ.range);
  const double factor = kQ(along) / along;
  EXPECT_NEAR(-corrected.force.dot(d.normalized()), kQ(along), 1e-12);
  for (std::size_t e = 0; e < grips.size(); ++e)
    EXPECT_LT((corrected.node_force[e] - factor * linear.node_force[e]).norm(), 1e-12);
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

}  // namespace
}  // namespace palpate::tests
