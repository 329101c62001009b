// Dead loads on a body under large deformation, against Newton's method.
#include <gmock/gmock.h>

#include <numbers>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/large/discs.h"
#include "tests/runtime/large/large_scene.h"
#include "tests/runtime/large/soft_supports.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr palpate_deformation_model kLargeModels[] = {PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LARGE_BESIDE,
                                                      PALPATE_DEFORMATION_LARGE_RENEWED};
constexpr double kFarArea = 0.05 * 0.04;  // m^2

const TouchedBody& box() {
  static const TouchedBody shared = large_body(false);
  return shared;
}
const Seen& seen() {
  static const Seen shared(box(), false, 0);
  return shared;
}

SceneDef loaded_def(palpate_deformation_model deformation) {
  SceneDef def = large_def(PALPATE_CONTACT_NODE);
  def.large.deformation = deformation, def.shape = PALPATE_SHAPE_VOLUME, def.loads.count = 1;
  def.loads.centre[0][0] = 0.06, def.loads.centre[0][1] = 0.025, def.loads.centre[0][2] = 0.02;
  def.loads.radius[0] = 0.05;
  return def;
}

// N on each dof, of a force on the face x = 0.06.
VectorXd on_far_face(const Vector3d& force) {
  VectorXd f = VectorXd::Zero(box().dofs());
  for (std::size_t t = 0; t < box().body.triangles.size(); ++t) {
    const auto& corners = box().body.triangles[t];
    if (box().outward(static_cast<std::int32_t>(t))[0] < 0.99) continue;
    const Vector3d a = box().node(corners[0]), b = box().node(corners[1]), c = box().node(corners[2]);
    for (const auto n : corners) f.segment<3>(3 * n) += (b - a).cross(c - a).norm() / 6 / kFarArea * force;
  }
  return f;
}

struct Loaded : SolvedScene {
  explicit Loaded(const SceneDef& def) : SolvedScene(box(), def) {}
  palpate_step_flags step(const Vector3d& force, const std::vector<palpate_tool>& tools = {}) {
    EXPECT_EQ(palpate_scene_set_load(get(), 0, PALPATE_LOAD_FORCE, force.data(), nullptr), PALPATE_OK);
    return SolvedScene::step(tools);
  }
  const palpate_load_state& state() { return *palpate_scene_load_state(get(), 0); }
};

TEST(LargeLoads, AWeightThatBendsTheBodyBy20MillimetresIsTheConvergedSolution) {
  const LargeReference reference(seen().body);
  const Vector3d weight(0, 0.1, -0.65);
  for (const auto deformation : kLargeModels) {
    Loaded loaded(loaded_def(deformation));
    for (int s = 1; s <= 200; ++s) loaded.step(s / 200.0 * weight);
    for (int s = 0; s < 30; ++s) loaded.step(weight);
    EXPECT_EQ(loaded.flags, 0u) << deformation;
    const VectorXd found = loaded.field();
    VectorXd u = found;
    reference.balance(on_far_face(weight), &u);
    EXPECT_LE((found - u).norm(), 0.01 * u.norm()) << deformation;
    EXPECT_GE(u.cwiseAbs().maxCoeff(), 0.02) << "not a large deformation";
    const double down = on_far_face(Vector3d::UnitZ()).dot(u);
    EXPECT_NEAR(loaded.state().displacement[2], down, 0.01 * std::abs(down)) << deformation;
  }
}

TEST(LargeLoads, ALoadThatGoesRoundUnderAToolDoesNoNetWork) {
  const std::vector<palpate_grip> grips = {grip_at_node(box().touchable[20], {0, 0, 0.003})};
  for (const auto deformation : kLargeModels) {
    Loaded loaded(loaded_def(deformation));
    double work = 0, most = 0;
    Vector3d force = Vector3d::Zero(), moved = force;
    for (int s = -100; s <= 600; ++s) {
      const double at = 2 * std::numbers::pi * std::max(0, s) / 600;
      loaded.step(0.2 * Vector3d(0.3 * std::sin(2 * at), std::sin(at), std::cos(at) - 1), {tool_of(grips)});
      const Vector3d now(loaded.state().force), there(loaded.state().displacement);
      if (s > 0) work += 0.5 * (force + now).dot(there - moved);
      force = now, moved = there, most = std::max(most, std::abs(work));
    }
    EXPECT_LT(std::abs(work), 0.02 * most) << deformation;
    EXPECT_GT(most, 1e-3) << "hardly any work";
  }
}

TEST(LargeLoads, AForceTooLargeForTheBodyStaysFiniteAndIsFlagged) {
  for (const auto deformation : kLargeModels) {
    Loaded loaded(loaded_def(deformation));
    palpate_step_flags raised = 0;
    for (int s = 0; s < 300; ++s) {
      raised |= loaded.step({0, 0, -500});
      ASSERT_TRUE(loaded.field().allFinite()) << s;
    }
    EXPECT_NE(raised & (PALPATE_STEP_DEFORMATION_BEHIND | PALPATE_STEP_UNSOLVED | PALPATE_STEP_SOLVE_INEXACT), 0u);
    EXPECT_NE(loaded.flags, 0u) << deformation;
    palpate_scene_reset(loaded.get());
    for (int s = 0; s < 30; ++s) loaded.step({0, 0, 0});
    EXPECT_EQ(loaded.flags, 0u) << deformation;
    EXPECT_LT(loaded.field().cwiseAbs().maxCoeff(), 1e-5) << deformation;
  }
}

// The rows are off by a thousandth, as those of half precision are: the load is still the force itself, less what the supports bear.
TEST(LargeLoads, ALoadOnABodyOnSoftSupportsIsTheConvergedSolutionWhateverTheRoundingOfItsRow) {
  ElasticBody elastic = body_of(box_mesh({6, 6, 4}, {0.12, 0.12, 0.08}, 0.15), {{5400, 0.45, 0}});
  add_foundation(elastic, 2e5, 5e4, [](const auto& p) { return p[2] == 0; });
  add_springs(elastic, 60, [](const auto& p) { return p[0] == 0.12; });
  const LargeBody large(elastic, true);
  const HyperelasticBody& body = large.get();
  const LargeReference reference(body);
  const Eigen::Index dofs = reference.dofs();
  std::vector<std::int32_t> nodes;
  for (std::int32_t n = 0; n < body.node_count; ++n)
    if (body.nodes[3 * n + 2] > 0.079 && body.nodes[3 * n] < 0.05) nodes.push_back(n);
  const std::vector<double> weights(nodes.size(), 1.0 / static_cast<double>(nodes.size()));
  VectorXd load = VectorXd::Zero(dofs);
  for (const std::int32_t n : nodes) load[3 * n] = weights[0];
  VectorXd row = Eigen::MatrixXd(reference.tangent(VectorXd::Zero(dofs))).llt().solve(load);
  for (Eigen::Index i = 0; i < dofs; ++i) row[i] *= 1 + 1e-3 * std::sin(static_cast<double>(7 * i));
  const Eigen::VectorXf numbers = row.cast<float>();
  const RowForce force = {nodes.data(), weights.data(), static_cast<std::int32_t>(nodes.size()), 0};
  OffsetRows offset;
  offset.numbers = numbers.data(), offset.count = 1, offset.nodes = body.node_count, offset.force = &force;
  Solved solved(body);
  SceneMemory memory{palpate_allocator{}};
  ASSERT_TRUE(solved.solver.take_offset(memory, body, offset));
  const Discs none;
  const double most = 0.02 / row.cwiseAbs().maxCoeff();
  for (int s = 1; s <= 220; ++s) {
    const double q = most * std::min(1.0, s / 200.0);
    solved.solver.move_by(&q, nullptr);
    solved.step(none);
  }
  const VectorXd found = solved.field() + most * numbers.cast<double>();
  VectorXd u = found;
  reference.balance(most * load, &u);
  EXPECT_LE((found - u).norm(), 1e-3 * u.norm());
  EXPECT_GE((most * row - u).norm(), 0.02 * u.norm()) << "not a large deformation";
  memory.release_all();
}

}  // namespace
}  // namespace palpate::tests
