// Large deformation of an organ whose supports move: against Newton's method with the supports where the motions bring them.
#include <gmock/gmock.h>

#include <numbers>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/large/discs.h"
#include "tests/runtime/large/large_scene.h"
#include "tests/runtime/large/soft_supports.h"
#include "tests/runtime/moved_box.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;

constexpr palpate_deformation_model kLargeModels[] = {PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LARGE_BESIDE,
                                                      PALPATE_DEFORMATION_LARGE_RENEWED};

// The box held at the face x = 0, which moves; with `two`, the lower part of the face x = 0.06 is held too, and stays.
DenseBody box_between_supports(bool two) {
  DenseBody dense = dense_box({});
  for (std::size_t i = 0; two && i < dense.body.mesh.nodes.size(); ++i)
    if (dense.body.mesh.nodes[i][0] > 0.06 - 1e-9 && dense.body.mesh.nodes[i][2] < 0.015)
      dense.fixed[3 * i] = dense.fixed[3 * i + 1] = dense.fixed[3 * i + 2] = 1;
  return dense;
}

struct MovedLarge : TouchedBody {
  explicit MovedLarge(bool two)
      : TouchedBody(box_between_supports(two),
                    [&](BundleParts& parts) {
                      add_motions(parts, box_between_supports(two));
                      with_large(false)(parts);
                    }),
        motions(dense_motions(box_between_supports(two))),
        seen(*this, false, 0),
        reference(seen.body),
        way(two ? -1 : 1) {}

  // m, by Newton's method with the supports at the amounts q, gravity, and rows at their targets; from u on. force: N, of each row on the body.
  VectorXd solve(const Vector4d& q, const Eigen::MatrixXd& rows, const VectorXd& target, VectorXd u,
                 VectorXd* force = nullptr) const {
    const VectorXd moved = motions.field * q;
    for (Eigen::Index i = 0; i < u.size(); ++i)
      if (fixed[static_cast<std::size_t>(i)]) u[i] = moved[i];
    const VectorXd found = reference.solve(rows, target, &u);
    if (force) *force = found;
    return u;
  }
  // A breath of 20 mm at up to 0.1 m/s, out and back, and a turn of the support with it: against a tool, or away from the other face.
  static constexpr int kBreath = 600;
  Vector4d breath_at(int step) const {
    const double share = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * step / kBreath);
    return {way * 0.02 * share, 0.1 * share, 0, 0};
  }
  DenseMotions motions;
  Seen seen;
  LargeReference reference;
  double way;
};
constexpr int kBreath = MovedLarge::kBreath;
const MovedLarge& on_one() {
  static const MovedLarge shared(false);
  return shared;
}
const MovedLarge& on_two() {
  static const MovedLarge shared(true);
  return shared;
}

SceneDef moved_large_def(palpate_deformation_model deformation) {
  SceneDef def = large_def(PALPATE_CONTACT_NODE);
  def.large.deformation = deformation, def.motions.motions = 1, def.shape = PALPATE_SHAPE_VOLUME;
  return def;
}

struct Moved : SolvedScene {
  Moved(const MovedLarge& on, const SceneDef& def) : SolvedScene(on, def), body(on) {}
  palpate_step_flags step(const Vector4d& q, const std::vector<palpate_tool>& tools) {
    set_amounts(get(), q);
    return SolvedScene::step(tools);
  }
  const MovedLarge& body;
};

TEST(MovedLargeBody, ABreathOf20MillimetresUnderAToolAtRestIsTheConvergedSolution) {
  for (const MovedLarge* const on : {&on_one(), &on_two()})
    for (const auto deformation : kLargeModels) {
      Moved moved(*on, moved_large_def(deformation));
      const std::int32_t node = on->touchable.back();
      const std::vector<palpate_grip> grips = {grip_at_node(node, Vector3d::Zero())};
      double field = 0, force = 0, largest = 0;
      int flagged = 0;
      for (int s = 0; s <= kBreath; ++s) {
        flagged += moved.step(on->breath_at(s), {tool_of(grips)}) != 0;
        if (s % 50 != 0 || s == 0 || s == kBreath) continue;
        const VectorXd found = moved.field();
        VectorXd on_body;
        const VectorXd u = on->solve(on->breath_at(s), rows_of_node(*on, node), Vector3d::Zero(), found, &on_body);
        field = std::max(field, (found - u).norm() / u.norm());
        force = std::max(force, (moved.force() + on_body).norm());
        largest = std::max(largest, on_body.norm());
        EXPECT_LT(on->reference.energy(u, &on_body), 1) << "finite";
      }
      std::printf("%d field %.3f %% force %.3f %% flagged %d\n", deformation, 100 * field, 100 * force / largest,
                  flagged);
      EXPECT_LE(field, 0.01) << deformation;
      EXPECT_LE(force, 0.02 * largest) << deformation;
      EXPECT_LE(flagged, deformation == PALPATE_DEFORMATION_LARGE ? 0 : 30) << deformation;
    }
}

TEST(MovedLargeBody, SupportsThatMoveAsOneBy50MillimetresGiveNoStrainAndNoForce) {
  for (const auto deformation : kLargeModels) {
    Moved moved(on_one(), moved_large_def(deformation));
    const std::int32_t node = on_one().touchable.back();
    for (int s = 1; s <= 500; ++s) {
      const Vector4d q(1e-4 * s, 0, 0, 0);
      // A tool that goes along.
      const std::vector<palpate_grip> grips = {grip_at_node(node, {1e-4 * s, 0, 0})};
      ASSERT_EQ(moved.step(q, {tool_of(grips)}), 0u) << s;
      ASSERT_LT(moved.force().norm(), 2e-5) << s;  // N, where 1 mm takes 0.05 N
      ASSERT_NEAR(moved.contacts->least_volume, 1, 1e-5) << s;
    }
    const VectorXd field = moved.field();
    for (Eigen::Index n = 0; 3 * n < field.size(); ++n)
      EXPECT_LT((field.segment<3>(3 * n) - Vector3d(0.05, 0, 0)).norm(), 1e-7) << n;
  }
}

TEST(MovedLargeBody, ABreathThatStopsComesToRestInItsBalance) {
  for (const auto deformation : kLargeModels) {
    Moved moved(on_two(), moved_large_def(deformation));
    for (int s = 0; s <= kBreath / 2; ++s) moved.step(on_two().breath_at(s), {});
    for (int s = 0; s < 100; ++s) moved.step(on_two().breath_at(kBreath / 2), {});
    const VectorXd found = moved.field();
    EXPECT_EQ(moved.step(on_two().breath_at(kBreath / 2), {}), 0u);
    EXPECT_EQ(palpate_scene_deform(moved.get()), deformation == PALPATE_DEFORMATION_LARGE ? -1 : 0);
    EXPECT_EQ((moved.field() - found).norm(), 0) << "at rest";
    const VectorXd u =
        on_two().solve(on_two().breath_at(kBreath / 2), Eigen::MatrixXd(0, on_two().dofs()), VectorXd(0), found);
    EXPECT_LE((found - u).norm(), 1e-3 * u.norm()) << deformation;
    const VectorXd linear = on_two().motions.field * on_two().breath_at(kBreath / 2);
    EXPECT_GE((linear - u).norm(), 0.05 * u.norm()) << "not a large deformation";
    for (int s = kBreath / 2; s <= kBreath; ++s) moved.step(on_two().breath_at(s), {});
    for (int s = 0; s < 300; ++s) moved.step(Vector4d::Zero(), {});
    EXPECT_EQ(moved.field().norm(), 0) << deformation;
  }
}

// The work of the supports over a whole breath under a tool at rest, and that of a tool on a closed way on an organ that has moved.
TEST(MovedLargeBody, ClosedWaysGiveNoWork) {
  Moved moved(on_two(), moved_large_def(PALPATE_DEFORMATION_LARGE));
  const std::int32_t node = on_two().touchable.back();
  const Eigen::MatrixXd rows = rows_of_node(on_two(), node);
  double by_supports = 0, most = 0;
  VectorXd last = VectorXd::Zero(on_two().dofs()), force, last_force = last;
  for (int s = 0; s <= kBreath; ++s) {
    const std::vector<palpate_grip> grips = {grip_at_node(node, Vector3d(-0.004, 0, 0.002) * std::min(1.0, s / 40.0))};
    moved.step(on_two().breath_at(std::max(0, s - 50)), {tool_of(grips)});
    const VectorXd u = moved.field();
    on_two().reference.energy(u, &force);
    for (Eigen::Index i = 0; i < u.size(); ++i)
      if (on_two().fixed[static_cast<std::size_t>(i)])
        by_supports += 0.5 * (force[i] + last_force[i]) * (u[i] - last[i]);
    most = std::max(most, std::abs(by_supports)), last = u, last_force = force;
  }
  for (int s = kBreath - 50; s <= kBreath; ++s) {
    const std::vector<palpate_grip> grips = {grip_at_node(node, {-0.004, 0, 0.002})};
    moved.step(on_two().breath_at(s), {tool_of(grips)});
    const VectorXd u = moved.field();
    on_two().reference.energy(u, &force);
    for (Eigen::Index i = 0; i < u.size(); ++i)
      if (on_two().fixed[static_cast<std::size_t>(i)])
        by_supports += 0.5 * (force[i] + last_force[i]) * (u[i] - last[i]);
    last = u, last_force = force;
  }
  EXPECT_GT(most, 1e-4);
  EXPECT_LE(std::abs(by_supports), 0.02 * most);
  for (int s = 0; s <= 150; ++s) moved.step(on_two().breath_at(s), {});
  double by_tool = 0, most_of_tool = 0;
  Vector3d at = moved.field().segment<3>(3 * node), from = at, felt = Vector3d::Zero();
  for (int s = 0; s <= 400; ++s) {
    const double turn = 2 * std::numbers::pi * s / 400;
    const Vector3d to = from + 0.006 * Vector3d(std::cos(turn) - 1, 0, std::sin(turn));
    moved.step(on_two().breath_at(150), {tool_of({grip_at_node(node, to)})});
    const Vector3d now = -moved.force();
    by_tool += 0.5 * (now + felt).dot(to - at);
    most_of_tool = std::max(most_of_tool, std::abs(by_tool)), at = to, felt = now;
  }
  EXPECT_GT(most_of_tool, 1e-5);
  EXPECT_LE(std::abs(by_tool), 0.02 * most_of_tool);
}

// A tool point that rests, under each law, while the organ breathes against it and away: the supports get back what they gave.
TEST(MovedLargeBody, AContactThatSlidesWhileTheOrganBreathesGivesNoWork) {
  for (const auto law : {PALPATE_LAW_SLIDING, PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB}) {
    SceneDef def = moved_large_def(PALPATE_DEFORMATION_LARGE);
    def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_PATCH, def.law = law;
    Moved moved(on_one(), def);
    const Vector3d point(0.0605, 0.025, 0.021);
    double work = 0, most = 0, pressed = 0;
    VectorXd last = VectorXd::Zero(on_one().dofs()), force, last_force = last;
    for (int s = 0; s <= kBreath; ++s) {
      palpate_tool tool = point_tool(point.data(), 1, 0.008, 0.3);
      moved.step(0.4 * on_one().breath_at(s), {tool});
      const VectorXd u = moved.field();
      on_one().reference.energy(u, &force);
      for (Eigen::Index i = 0; i < u.size(); ++i)
        if (on_one().fixed[static_cast<std::size_t>(i)]) work += 0.5 * (force[i] + last_force[i]) * (u[i] - last[i]);
      most = std::max(most, std::abs(work)), pressed = std::max(pressed, moved.force().norm());
      last = u, last_force = force;
    }
    EXPECT_GT(pressed, 0.05) << law;
    EXPECT_GE(work, -0.02 * most) << law;
    EXPECT_LE(work, (law == PALPATE_LAW_COULOMB ? 1 : 0.02) * most) << law;
  }
}

TEST(MovedLargeBody, ADeformedSurfaceIsMetWhereTheBreathHasBroughtIt) {
  for (const auto deformation : kLargeModels) {
    SceneDef def = moved_large_def(deformation);
    def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_PATCH;
    Moved moved(on_one(), def);
    // The far face comes from 0.06 to 0.08, and the tool waits at 0.07.
    const Vector3d point(0.07, 0.025, 0.021);
    int met = -1;
    for (int s = 0; s <= 200; ++s) {
      moved.step({1e-4 * s, 0, 0, 0}, {point_tool(point.data(), 1, 0.006)});
      if (met < 0 && moved.touches()) met = s;
    }
    EXPECT_NEAR(met, 100, 2) << deformation;
    EXPECT_GT(moved.force().x(), 0.05) << deformation;
    for (int s = 200; s >= 0; --s) moved.step({1e-4 * s, 0, 0, 0}, {point_tool(point.data(), 1, 0.006)});
    EXPECT_FALSE(moved.touches()) << deformation;
  }
}

TEST(MovedLargeBody, ARestoredSceneGoesOnWithTheSameBits) {
  for (const auto deformation : kLargeModels) {
    const SceneDef def = moved_large_def(deformation);
    Moved one(on_two(), def), other(on_two(), def);
    const auto tools = [](int s) {
      static std::vector<palpate_grip> grips;
      grips = {grip_at_node(on_two().touchable.back(), Vector3d(-1e-5 * s, 0, 0))};
      return std::vector<palpate_tool>{tool_of(grips)};
    };
    for (int s = 0; s < 150; ++s) one.step(on_two().breath_at(s), tools(s));
    restore_from(one.get(), other.get());
    for (int s = 150; s < 200; ++s) {
      one.step(on_two().breath_at(s), tools(s)), other.step(on_two().breath_at(s), tools(s));
      ASSERT_TRUE(one.has_bytes_of(other)) << deformation << ' ' << s;
    }
  }
}

TEST(MovedLargeBody, AnOrganThatMovesWhileNoThreadSolvesItIsFlagged) {
  Moved moved(on_two(), moved_large_def(PALPATE_DEFORMATION_LARGE_BESIDE));
  for (int s = 0; s <= 150; ++s) {
    set_amounts(moved.get(), on_two().breath_at(s));
    moved.touch();
  }
  EXPECT_TRUE(moved.flags & PALPATE_STEP_DEFORMATION_BEHIND);
  const VectorXd linear = on_two().motions.field * on_two().breath_at(150);
  EXPECT_LE((moved.field() - linear).norm(), 1e-6 * linear.norm()) << "the linear displacement of the newest amounts";
  for (int i = 0; i < 100; ++i) moved.step(on_two().breath_at(150), {});
  EXPECT_EQ(moved.step(on_two().breath_at(150), {}), 0u);
}

TEST(MovedLargeBody, GravityIsALoadThatDoesNotTurn) {
  Moved moved(on_one(), moved_large_def(PALPATE_DEFORMATION_LARGE));
  const Vector4d most(0, 0, 0, -60);
  for (int s = 0; s <= 200; ++s) moved.step(s / 200.0 * most, {});
  for (int s = 0; s < 20; ++s) moved.step(most, {});
  const VectorXd found = moved.field(), linear = on_one().motions.field * most;
  VectorXd u = found;
  on_one().reference.balance(on_one().stiffness() * linear, &u);
  EXPECT_LE((found - u).norm(), 1e-3 * u.norm());
  EXPECT_GE((linear - u).norm(), 0.03 * u.norm()) << "not a large deformation";
}

// The first step takes all amounts at once.
TEST(MovedLargeBody, AnOrganThatBeginsFarAwayComesToItsBalance) {
  for (const auto deformation : kLargeModels) {
    Moved moved(on_two(), moved_large_def(deformation));
    for (int s = 0; s < 60; ++s) moved.step(on_two().breath_at(kBreath / 2), {});
    EXPECT_EQ(moved.step(on_two().breath_at(kBreath / 2), {}), 0u) << deformation;
    const VectorXd found = moved.field(), u = on_two().solve(on_two().breath_at(kBreath / 2),
                                                             Eigen::MatrixXd(0, on_two().dofs()), VectorXd(0), found);
    EXPECT_LE((found - u).norm(), 1e-3 * u.norm()) << deformation;
  }
}

TEST(MovedLargeBody, AnOrganThatSagsUnderAPreloadMovesFromThere) {
  const DenseBody dense = box_between_supports(true);
  const VectorXd sag = -30 * dense_motions(dense).field.col(kWeight);
  const TouchedBody body(dense, [&](BundleParts& parts) {
    add_motions(parts, dense);
    with_large(false)(parts);
    parts.set(formats::SectionId::preload_displacement, {parts.sections.at(formats::SectionId::nodes).shape[0], 3},
              std::vector<double>(sag.begin(), sag.end()));
  });
  SceneDef def = moved_large_def(PALPATE_DEFORMATION_LARGE);
  def.preload = PALPATE_PRELOAD_ON;
  TouchedScene scene(body, def);
  const MovedLarge& on = on_two();
  for (int s = 0; s <= kBreath / 2; ++s) {
    set_amounts(scene.get(), on.breath_at(s));
    scene.touch();
  }
  for (int s = 0; s < 20; ++s) EXPECT_EQ(scene.touch() & ~PALPATE_STEP_DEFORMATION_BEHIND, 0u);
  EXPECT_EQ(scene.flags, 0u);
  const std::vector<float> told = scene.shape();
  const VectorXd load = on.stiffness() * sag, moved = on.motions.field * on.breath_at(kBreath / 2);
  VectorXd rest = VectorXd::Zero(on.dofs());
  on.reference.balance(load, &rest);
  const VectorXd found = rest + Eigen::Map<const Eigen::VectorXf>(told.data(), on.dofs()).cast<double>();
  VectorXd u = found;
  for (Eigen::Index i = 0; i < u.size(); ++i)
    if (on.fixed[static_cast<std::size_t>(i)]) u[i] = moved[i];
  on.reference.balance(load, &u);
  EXPECT_LE((found - u).norm(), 1e-3 * u.norm());
  EXPECT_GE(rest.norm(), 0.1 * u.norm()) << "hardly a preload";
}

// Springs and foundations that tie the body to the world move with their bases, by 20 mm and along another way each.
TEST(MovedLargeBody, BasesOfSoftSupportsThatMoveAreTheConvergedSolution) {
  ElasticBody elastic = body_of(box_mesh({6, 6, 4}, {0.12, 0.12, 0.08}, 0.15), {{5400, 0.45, 0}});
  add_foundation(elastic, 2e5, 5e4, [](const auto& p) { return p[2] == 0; });
  add_springs(elastic, 60, [](const auto& p) { return p[0] == 0.12; });
  const LargeBody large(elastic, true);
  const HyperelasticBody& body = large.get();
  const LargeReference reference(body);
  const Eigen::Index dofs = reference.dofs();
  HyperelasticBody bare = body;
  bare.support_count = 0;
  const Eigen::MatrixXd stiffness(reference.tangent(VectorXd::Zero(dofs))),
      of_elements(LargeReference(bare).tangent(VectorXd::Zero(dofs)));
  // Rows: all bases along x; the bases of the far face alone, and a stretch with it.
  Eigen::MatrixXd bases = Eigen::MatrixXd::Zero(dofs, 2);
  for (std::int32_t n = 0; n < body.node_count; ++n) {
    bases(3 * n, 0) = 1;
    if (body.nodes[3 * n] > 0.119) bases(3 * n, 1) = 0.4, bases(3 * n + 2, 1) = 1;
  }
  const Eigen::MatrixXd rows = stiffness.llt().solve((stiffness - of_elements) * bases);
  std::vector<float> numbers;
  for (Eigen::Index m = 0; m < 2; ++m)
    for (Eigen::Index i = 0; i < dofs; ++i) numbers.push_back(static_cast<float>(rows(i, m)));
  OffsetRows offset;
  offset.numbers = numbers.data(), offset.count = 2, offset.nodes = body.node_count;
  Solved solved(body);
  SceneMemory memory{palpate_allocator{}};
  ASSERT_TRUE(solved.solver.take_offset(memory, body, offset));
  const Discs none;
  for (int s = 1; s <= 200; ++s) {
    const double q[2] = {1e-4 * s, 1e-4 * s};
    solved.solver.move_by(q, nullptr);
    solved.step(none);
  }
  for (int s = 0; s < 20; ++s) solved.step(none);
  const Eigen::Vector2d q(0.02, 0.02);
  const VectorXd linear = rows * q, found = solved.field() + linear;
  VectorXd u = found;
  reference.balance((stiffness - of_elements) * (bases * q), &u);
  EXPECT_LE((found - u).norm(), 1e-3 * u.norm());
  EXPECT_GE((linear - u).norm(), 0.02 * u.norm()) << "not a large deformation";
  memory.release_all();
}

}  // namespace
}  // namespace palpate::tests
