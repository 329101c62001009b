// The metric that is renewed from the tangent of the body as it is.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "studies/hyperelastic/large_reference.h"
#include "tests/runtime/large/discs.h"
#include "tests/runtime/large/pressed_box.h"
#include "tests/runtime/large/supported_beam.h"

namespace palpate::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

TEST(Tangent, IsThatOfTheReferenceAtAnyState) {
  for (const Element element : {Element::p1, Element::p1_anp, Element::p1_ang})
    for (const LawForm& form : {LawForm(), LawForm(1.5), LawForm::yeoh(-200, 500), LawForm::ogden(-4, 0.3, 9)})
      for (const bool soft : {false, true}) {
        const ElasticBody elastic = beam_with_supports(soft);
        const LargeBody large(elastic, element, {form});
        const HyperelasticBody& body = large.get();
        std::int32_t rows = 0;
        const auto place = places_of(body, &rows);
        SceneMemory memory{palpate_allocator{}};
        Tangent tangent;
        ASSERT_TRUE(tangent.create(memory, body, place.data(), rows, 7));
        for (const double size : {0.0, 3e-3}) {
          std::vector<float> u(3 * place.size());
          VectorXd of_nodes(3 * body.node_count);
          for (std::int32_t n = 0; n < body.node_count; ++n)
            for (int i = 0; i < 3; ++i) {
              const bool held = body.fixed[3 * n + i];
              const auto at = static_cast<std::size_t>(3 * place[static_cast<std::size_t>(n)] + i);
              u[at] = held ? 0 : static_cast<float>(size * std::sin(20 * body.nodes[3 * n] + 3 * i));
              of_nodes[3 * n + i] = static_cast<double>(u[at]);
            }
          tangent.begin(u.data());
          const MatrixXd expected = LargeReference(body).tangent(of_nodes);
          MatrixXd found = MatrixXd::Zero(3 * rows, 3 * rows);
          for (std::int32_t column = 0; column < rows; ++column)
            tangent.add_column(column, [&](std::int32_t row, int r, int c, double value) {
              ASSERT_GE(row, column);
              found(3 * row + r, 3 * column + c) += value;
            });
          double miss = 0;
          for (std::int32_t a = 0; a < body.node_count; ++a)
            for (std::int32_t b = 0; b < body.node_count; ++b)
              for (int r = 0; r < 3; ++r)
                for (int c = 0; c < 3; ++c) {
                  const std::int32_t row = place[static_cast<std::size_t>(a)],
                                     column = place[static_cast<std::size_t>(b)];
                  if (row >= rows || column >= rows || row < column) continue;
                  const bool held = body.fixed[3 * a + r] || body.fixed[3 * b + c];
                  const double value = held ? (row == column && r == c ? 7 : 0) : expected(3 * a + r, 3 * b + c);
                  miss = std::max(miss, std::abs(found(3 * row + r, 3 * column + c) - value));
                }
          // Sums of some 200 terms of double precision, in two orders.
          EXPECT_LE(miss, 1e-12 * expected.cwiseAbs().maxCoeff())
              << name_of(element) << form.constant[0] << soft << size;
        }
        memory.release_all();
      }
}

// The tip of a slender part turns, and nearly incompressible tissue has a tangent that turns with it.
struct Followed {
  double force = 0, field = 0;  // worst share of the converged ones while the tip moves
  int renewals = 0, unfinished = 0, evaluations = 0, solves = 0;
};
// A disc on a block that is held at x = 0 moves, 0.1 mm in each tick.
struct Way {
  std::array<int, 3> cells;
  Vector3d size, centre;  // m
  double radius = 0;      // m, of the disc
  Vector3d along;         // unit
  int ticks = 600, ticks_a_solve = 1;
  double poisson = 0.499;
};
Followed follow(const Way& way, int slices_a_solve) {
  ElasticBody elastic =
      body_of(box_mesh(way.cells, {way.size[0], way.size[1], way.size[2]}, 0.1), {{5400, way.poisson, 0}});
  hold(elastic, [](const auto& p) { return p[0] == 0 ? 7 : 0; });
  const LargeBody body(elastic, true);
  Discs disc;
  disc.add(body.get(), way.centre, way.radius);
  Solved solved(body.get(), true);
  const LargeReference reference(body.get());
  Followed followed;
  VectorXd u = VectorXd::Zero(reference.dofs());  // converged
  for (int tick = way.ticks_a_solve; tick <= way.ticks; tick += way.ticks_a_solve) {
    disc.set(0, 1e-4 * tick * way.along);
    const LargeOutcome outcome = solved.step(disc);
    followed.unfinished += outcome.unfinished, followed.evaluations += outcome.evaluations, ++followed.solves;
    for (int i = 0; i < slices_a_solve; ++i) solved.solver.renew();
    if (tick % 20 != 0) continue;
    const VectorXd force = reference.solve(disc.dense(reference.dofs()), disc.targets(), &u, 1e-7);
    if (tick < way.ticks / 3) continue;
    followed.force = std::max(followed.force, (solved.force - force).norm() / force.norm());
    followed.field = std::max(followed.field, (solved.field() - u).norm() / u.norm());
  }
  followed.renewals = solved.solver.renewals();
  return followed;
}
Way beam_way() {
  return {{16, 3, 3}, {0.10, 0.02, 0.02}, {0.1, 0.01, 0.01}, 0.015, {0, 1, 0}};
}

TEST(RenewedMetric, FollowsANearlyIncompressibleBeamWhoseTipMovesBySixtyMillimetres) {
  const Followed kept = follow(beam_way(), 0), renewed = follow(beam_way(), 1);
  std::printf("nu 0.499, tip 60 mm: kept field %.2f %% force %.2f %%, renewed %.2f %% %.2f %% (%d renewals)\n",
              100 * kept.field, 100 * kept.force, 100 * renewed.field, 100 * renewed.force, renewed.renewals);
  EXPECT_EQ(kept.renewals, 0);
  EXPECT_EQ(renewed.renewals, 600 / LargeSolver::kSlices);
  EXPECT_EQ(renewed.unfinished, 0);
  EXPECT_LE(renewed.field, 0.02);
  EXPECT_LE(renewed.force, 0.02);
  EXPECT_GT(kept.force, 2 * renewed.force) << "the metric at rest would have done";
}

// Pairs that are older than the metric's state spoil its directions: where a solve takes no step, they stay for long.
TEST(RenewedMetric, TakesFewEvaluationsWhereMostSolvesTakeNoStep) {
  Way way = beam_way();
  way.cells = {20, 4, 4}, way.poisson = 0.49;  // with {16, 3, 3} old pairs do little harm
  const Followed renewed = follow(way, 1);
  const double evaluations = double(renewed.evaluations) / renewed.solves;
  std::printf("nu 0.49, tip 60 mm: %.2f evaluations a solve, field %.2f %% force %.2f %%\n", evaluations,
              100 * renewed.field, 100 * renewed.force);
  EXPECT_LE(evaluations, 2.5);
  EXPECT_LE(renewed.force, 0.01);
  EXPECT_EQ(renewed.unfinished, 0);
}

// The table of method.md, section 14: large_test --gtest_also_run_disabled_tests --gtest_filter='*TableOfTheMethod'
TEST(RenewedMetric, DISABLED_TableOfTheMethod) {
  const auto beam_of = [](double poisson, int ticks, int ticks_a_solve) {
    Way way = beam_way();
    way.cells = {20, 4, 4}, way.poisson = poisson, way.ticks = ticks, way.ticks_a_solve = ticks_a_solve;
    return way;
  };
  const std::pair<const char*, Way> ways[] = {
      {"beam, tip 60 mm, nu 0.45", beam_of(0.45, 600, 1)},
      {"beam, tip 60 mm, nu 0.49", beam_of(0.49, 600, 1)},
      {"beam, tip 60 mm, nu 0.499", beam_of(0.499, 600, 1)},
      {"beam, tip 40 mm, nu 0.499, a solve every 5 ms", beam_of(0.499, 400, 5)},
      {"slender, tip 60 mm, nu 0.49",
       {{40, 2, 2}, {0.10, 0.005, 0.005}, {0.1, 0.0025, 0.0025}, 0.004, {0, 1, 0}, 600, 1, 0.49}},
      {"block, oblique push to 20 mm, nu 0.499",
       {{7, 9, 10}, {0.04, 0.05, 0.06}, {0.04, 0.025, 0.03}, 0.01, Vector3d(-2, 1, 0).normalized(), 200, 1, 0.499}}};
  for (const auto& [name, way] : ways) {
    const Followed kept = follow(way, 0), renewed = follow(way, 1);
    std::printf("%s: kept %.2f; %.2f %%; %.1f; renewed %.2f; %.2f %%; %.1f\n", name, 100 * kept.field, 100 * kept.force,
                double(kept.evaluations) / kept.solves, 100 * renewed.field, 100 * renewed.force,
                double(renewed.evaluations) / renewed.solves);
    std::fflush(stdout);
  }
}

TEST(RenewedMetric, IsThatOfRestAgainWhereTheBodyIs) {
  const LargeBody body(block(0.49), true);
  Discs discs;
  discs.add(body.get(), {0.06, 0.06, 0.08}, 0.021);
  Solved solved(body.get(), true);
  solved.solver.renew();
  EXPECT_EQ(solved.solver.renewals(), 0);
  for (int tick = 1; tick <= 100; ++tick) {
    discs.set(0, {0, 0, -1e-4 * tick});
    solved.step(discs);
    solved.solver.renew();
  }
  EXPECT_EQ(solved.solver.renewals(), 100 / LargeSolver::kSlices);
  for (int tick = 0; tick < 300; ++tick) solved.step({}), solved.solver.renew();
  EXPECT_LE(solved.field().cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_EQ(solved.solver.renewals(), 0);
  // A small push has the force of a body that was never pushed.
  Solved other(body.get());
  discs.set(0, {0, 0, -1e-4});
  solved.step(discs), other.step(discs);
  EXPECT_EQ(solved.force, other.force);
}

SceneDef renewed_def() {
  SceneDef def = large_def(PALPATE_CONTACT_PATCH);
  def.large.deformation = PALPATE_DEFORMATION_LARGE_RENEWED, def.collision = PALPATE_COLLISION_DEFORMED;
  return def;
}

TEST(RenewedMetric, ASceneWithItAnswersAsTheBodyThatIsSolvedInEachStep) {
  for (const bool nodal : {false, true}) {
    const TouchedBody box = large_body(nodal);
    SceneDef def = renewed_def();
    def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_POINT;
    Play renewed(def, box);
    def.large.deformation = PALPATE_DEFORMATION_LARGE;
    Play large(def, box);
    for (int tick = 1; tick <= 165; ++tick) {
      const Vector3d way = Vector3d(-1e-4, 0.2e-4, 0.3e-4) * std::min(tick, 160);  // the last steps wait
      const std::vector<palpate_grip> grips = {grip_at_place(box.far_triangle(), {0.5, 0.3, 0.2}, way)};
      EXPECT_EQ(renewed.touch(tool_of(grips)), 0u) << tick;
      large.touch(tool_of(grips));
    }
    EXPECT_LE((renewed.force(0) - large.force(0)).norm(), 0.01 * large.force(0).norm()) << nodal;
  }
}

TEST(RenewedMetric, ARestoredStateGoesOnWithTheSameBits) {
  const TouchedBody box = large_body(true);
  const auto go = [](Play& one, int from, int to) {
    for (int tick = from; tick < to; ++tick) {
      std::vector<Vector3d> at = {Vector3d(0.06 - 1e-4 * tick, 0.025, 0.02),
                                  Vector3d(0.0601 - 1e-4 * tick, 0.04, 0.03)};
      if (tick % 25 < 5) at.pop_back();
      one.move(at);
    }
  };
  // In the middle of the second renewal or later: the state holds a renewed metric and a part of the next one.
  for (const int saved : {3, 40, 75}) {
    Play one(renewed_def(), box), restored(renewed_def(), box);
    one.most_solves = restored.most_solves = 2;
    go(one, 0, saved);
    std::vector<std::uint64_t> state(palpate_scene_state_bytes(one.scene.get()) / 8 + 1);
    palpate_error error = {};
    ASSERT_EQ(palpate_scene_save(one.scene.get(), state.data(), 8 * state.size(), &error), PALPATE_OK) << error.text;
    ASSERT_EQ(palpate_scene_restore(restored.scene.get(), state.data(), 8 * state.size(), &error), PALPATE_OK);
    go(one, saved, 120), go(restored, saved, 120);
    EXPECT_EQ(0, std::memcmp(one.contacts.get(), restored.contacts.get(), one.contacts->used_bytes)) << saved;
  }
}

TEST(RenewedMetric, TakesMemoryInScenesThatAskForItAlone) {
  const auto bytes = [](palpate_deformation_model model) {
    SceneDef def = renewed_def();
    def.large.deformation = model;
    const auto scene = large_box().scene(def);
    std::uint64_t sum = 0;
    for (const palpate_plan_pass& pass : plan_of(scene.get())) sum += pass.memory_bytes;
    return sum;
  };
  EXPECT_GT(bytes(PALPATE_DEFORMATION_LARGE_RENEWED), bytes(PALPATE_DEFORMATION_LARGE_BESIDE));
}

}  // namespace
}  // namespace palpate::tests
