// The solver of a step against the converged reference: force and field on the way in, and what else a tool may do.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "precompute/elements/discretisation.h"
#include "studies/hyperelastic/large_reference.h"
#include "tests/runtime/large/discs.h"
#include "tests/runtime/large/soft_supports.h"
#include "tests/runtime/large/supported_beam.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

TEST(LargeSolver, ItsFactorInvertsTheStiffnessOfThePrecomputation) {
  double limit[2] = {};
  for (const auto& [nodal, soft] : {std::pair{false, false}, {true, false}, {false, true}, {true, true}}) {
    const ElasticBody elastic = beam_with_supports(soft);
    const LargeBody body(elastic, nodal);
    const auto order = elimination_order(body.get());
    SceneMemory memory{palpate_allocator{}};
    std::int32_t rows = 0;
    std::vector<std::int32_t> place = places_of(body.get(), &rows), improved(order.size());
    BlockRows k;
    ASSERT_TRUE(assemble_stiffness(memory, body.get(), place.data(), rows, &k));
    ASSERT_TRUE(postorder(memory, k, improved.data()));
    for (auto& p : place)
      if (p < rows) p = improved[static_cast<std::size_t>(p)];
    k = {};
    ASSERT_TRUE(assemble_stiffness(memory, body.get(), place.data(), rows, &k));
    BlockFactor factor;
    ASSERT_EQ(factor.create(memory, k), BlockFactor::Outcome::made);
    const HeldStiffness held =
        remove_held_dofs(discretise(elastic, nodal ? Element::p1_anp : Element::p1).stiffness, elastic.fixed);
    std::vector<float> x(static_cast<std::size_t>(3 * rows + 64));
    std::vector<double> there(static_cast<std::size_t>(3 * rows)), expected(there.size());
    for (std::int32_t n = 0; n < body.get().node_count; ++n)
      for (int i = 0; i < 3; ++i)
        if (place[n] < rows) {
          const auto at = static_cast<std::size_t>(3 * place[n] + i);
          const double v = std::sin(0.7 * n + i);
          x[at] = static_cast<float>(v), expected[at] = static_cast<double>(x[at]);
        }
    // The rough copy, in the energy of the solution: some hundred columns, each rounded by 1.5e-5 of its largest number.
    BlockFactor rough;
    ASSERT_EQ(rough.create(memory, k, 0), BlockFactor::Outcome::made);
    ASSERT_TRUE(rough.has_rough_copy() && !factor.has_rough_copy());
    std::vector<float> roughly = x, none = x;
    rough.solve_roughly(roughly.data()), factor.solve_roughly(none.data());
    factor.solve(x.data());
    EXPECT_EQ(none, x) << "without a copy it is the same solve";
    double energy = 0, missed = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      energy += expected[i] * static_cast<double>(x[i]);
      missed += expected[i] * (static_cast<double>(roughly[i]) - static_cast<double>(x[i]));
    }
    EXPECT_GT(energy, 0);
    EXPECT_LE(std::abs(missed), 2e-2 * energy) << nodal << soft;
    EXPECT_NE(roughly, x);
    for (std::int32_t n = 0; n < body.get().node_count; ++n)
      for (int i = 0; i < 3; ++i)
        if (place[n] < rows)
          there[static_cast<std::size_t>(3 * held.row_of_node[n] + i)] =
              static_cast<double>(x[static_cast<std::size_t>(3 * place[n] + i)]);
    const std::vector<double> back = multiply(held.matrix, there);
    double miss = 0, largest = 0, entry = 0;
    for (const auto& block : held.matrix.block)
      for (const double v : block) entry = std::max(entry, std::abs(v));
    for (std::int32_t n = 0; n < body.get().node_count; ++n)
      for (int i = 0; i < 3; ++i)
        if (place[n] < rows) {
          const auto at = static_cast<std::size_t>(3 * place[n] + i);
          miss = std::max(miss, std::abs(back[static_cast<std::size_t>(3 * held.row_of_node[n] + i)] - expected[at]));
          largest = std::max(largest, std::abs(static_cast<double>(x[at])));
        }
    // A rounding of 6e-8 for each of some 400 terms of a row, as a share of the largest entry times the largest displacement. The
    // step asks for a metric and not for a solution. Supports leave the strains and their rounding, add terms of their own,
    // and stop the beam's swing alone.
    if (!soft) limit[nodal] = 5e-5 * entry * largest;
    EXPECT_LE(miss, (soft ? 2 : 1) * limit[nodal]) << soft;
    EXPECT_GT(largest, 0);
    memory.release_all();
  }
}

struct Errors {
  double field = 0, force = 0, evaluations = 0, least_volume = 1;
};
// Moves the discs at 100 mm/s, a tick each millisecond, to `depth` mm, and compares there with the converged solution.
Errors follow(const HyperelasticBody& body, Discs discs, const std::vector<Vector3d>& ways, int depth,
              bool roughly = false) {
  Solved solved(body, false, roughly);
  Errors errors;
  const int ticks = 10 * depth;
  for (int tick = 1; tick <= ticks; ++tick) {
    for (std::size_t i = 0; i < ways.size(); ++i) discs.set(i, 1e-4 * tick * ways[i]);
    const LargeOutcome outcome = solved.step(discs);
    EXPECT_FALSE(outcome.failed || outcome.cut);
    errors.evaluations += static_cast<double>(outcome.evaluations) / ticks;
    errors.least_volume = std::min(errors.least_volume, outcome.least_volume);
  }
  const LargeReference reference(body);
  VectorXd u = solved.field();  // near the solution; the reference converges from there, to the end
  const VectorXd force = reference.solve(discs.dense(reference.dofs()), discs.targets(), &u);
  errors.field = (solved.field() - u).norm() / u.norm();
  errors.force = (solved.force - force).norm() / force.norm();
  return errors;
}

struct Case {
  const char* name;
  bool nodal;
  double poisson;
  std::vector<LawForm> forms;
  std::vector<Vector3d> places, ways;
};

// The limits are what the method promises: 1 % of the field and 2 % of the force, at 0.1 m/s.
TEST(LargeSolver, FollowsTheConvergedSolutionOfABlock) {
  const Vector3d top(0.06, 0.06, 0.08), left(0.03, 0.06, 0.08), right(0.09, 0.06, 0.08);
  const std::vector<Case> cases = {
      {"push, p1", false, 0.45, {}, {top}, {{0, 0, -1}}},
      {"oblique, p1, exponential", false, 0.45, {1.5}, {top}, {{0.7, 0, -0.7}}},
      {"pull, p1-anp", true, 0.45, {}, {top}, {{0, 0, 1}}},
      {"drag, p1-anp", true, 0.45, {}, {top}, {{1, 0, -0.3}}},
      {"push, p1-anp, nu 0.49", true, 0.49, {}, {top}, {{0, 0, -1}}},
      {"pinch, p1-anp, nu 0.49", true, 0.49, {}, {left, right}, {{0.7, 0, -0.3}, {-0.7, 0, -0.3}}},
      {"pull, p1-anp, exponential", true, 0.45, {1.5}, {top}, {{0, 0, 1}}},
      {"push, p1-anp, Yeoh", true, 0.45, {LawForm::yeoh(-300, 400)}, {top}, {{0, 0, -1}}},
      {"oblique, p1, Yeoh", false, 0.45, {LawForm::yeoh(500, 2000)}, {top}, {{0.7, 0, -0.7}}},
      {"push, p1-anp, nu 0.49, Ogden", true, 0.49, {LawForm::ogden(4.5)}, {top}, {{0, 0, -1}}},
      {"oblique, p1, Ogden of two terms", false, 0.45, {LawForm::ogden(-5, 0.2, 10)}, {top}, {{0.7, 0, -0.7}}}};
  for (const Case& one : cases) {
    const LargeBody body(block(one.poisson), one.nodal, one.forms);
    Discs discs;
    for (const Vector3d& place : one.places) discs.add(body.get(), place, 0.021);
    for (const int depth : {10, 20, 30}) {
      const Errors errors = follow(body.get(), discs, one.ways, depth);
      std::printf("%-28s %d mm: field %.2f %% force %.2f %% least J %.2f evaluations %.2f\n", one.name, depth,
                  100 * errors.field, 100 * errors.force, errors.least_volume, errors.evaluations);
      EXPECT_LE(errors.field, 0.01) << one.name << depth;
      EXPECT_LE(errors.force, 0.02) << one.name << depth;
      EXPECT_LE(errors.evaluations, 4) << one.name << depth;
    }
  }
}

// Directions from 16 bits a number keep the promises of the method.
TEST(LargeSolver, FollowsTheConvergedSolutionWithTheRoughCopyOfItsFactor) {
  const Vector3d top(0.06, 0.06, 0.08);
  for (const double poisson : {0.45, 0.49})
    for (const Vector3d& way : {Vector3d(0, 0, -1), Vector3d(0.7, 0, -0.7)}) {
      const LargeBody body(block(poisson), true, {});
      Discs discs;
      discs.add(body.get(), top, 0.021);
      const Errors errors = follow(body.get(), discs, {way}, 20, true), exact = follow(body.get(), discs, {way}, 20);
      std::printf("nu %.2f: field %.2f %% force %.2f %% evaluations %.2f, with 32 bits %.2f\n", poisson,
                  100 * errors.field, 100 * errors.force, errors.evaluations, exact.evaluations);
      EXPECT_LE(errors.field, 0.01);
      EXPECT_LE(errors.force, 0.02);
      EXPECT_LE(errors.evaluations, 1.1 * exact.evaluations);
      EXPECT_NE(errors.force, exact.force) << "the copy was not used";
    }
}

// No node is held: what gives way below the body decides the force.
TEST(LargeSolver, FollowsTheConvergedSolutionOnSoftSupportsAlone) {
  struct Support {
    const char* name;
    std::function<void(ElasticBody&)> add;
  };
  const Support supports[] = {
      {"on a foundation",
       [](ElasticBody& body) { add_foundation(body, 2e5, 5e4, [](const auto& p) { return p[2] == 0; }); }},
      {"on springs",
       [](ElasticBody& body) {
         add_springs(body, 60, [](const auto& p) { return p[2] == 0 && (p[0] == 0 || p[0] == 0.12); });
       }},
  };
  for (const Support& support : supports)
    for (const Element element : {Element::p1, Element::p1_anp, Element::p1_ang}) {
      ElasticBody elastic =
          body_of(box_mesh({6, 6, 4}, {0.12, 0.12, 0.08}, 0.15), {{5400, element == Element::p1 ? 0.45 : 0.49, 0}});
      support.add(elastic);
      const LargeBody body(elastic, element);
      Discs discs;
      discs.add(body.get(), {0.06, 0.06, 0.08}, 0.021);
      for (const Vector3d& way : {Vector3d(0, 0, -1), Vector3d(0.8, 0, -0.6)})
        for (const int depth : {10, 20, 30}) {
          const Errors errors = follow(body.get(), discs, {way}, depth);
          std::printf("%s, %s, %.1f %d mm: field %.2f %% force %.2f %% least J %.2f evaluations %.2f\n", support.name,
                      name_of(element), way.x(), depth, 100 * errors.field, 100 * errors.force, errors.least_volume,
                      errors.evaluations);
          EXPECT_LE(errors.field, 0.01) << support.name << depth;
          EXPECT_LE(errors.force, 0.02) << support.name << depth;
        }
    }
}

TEST(LargeSolver, ComesBackToRestOnSoftSupports) {
  ElasticBody elastic = body_of(box_mesh({6, 6, 4}, {0.12, 0.12, 0.08}, 0.15), {{5400, 0.45, 0}});
  add_foundation(elastic, 2e5, 5e4, [](const auto& p) { return p[2] == 0; });
  const LargeBody body(elastic, true);
  Solved solved(body.get());
  Discs discs, none;
  discs.add(body.get(), {0.06, 0.06, 0.08}, 0.021);
  double most = 0;
  for (int tick = 1; tick <= 300; ++tick) {
    discs.set(0, Vector3d(0, 0, -1e-4 * tick));
    solved.step(discs);
    most = std::max(most, solved.field().cwiseAbs().maxCoeff());
  }
  for (int tick = 0; tick < 50; ++tick) solved.step(none);
  EXPECT_LE(solved.field().cwiseAbs().maxCoeff(), 1e-4 * most);
}

// Its tip turns, so that the metric of the straight beam is a bad one there.
TEST(LargeSolver, FollowsABeamThatBends) {
  const LargeBody body(beam(), true);
  Discs discs;
  discs.add(body.get(), {0.1, 0.01, 0.01}, 0.015);
  for (const int depth : {10, 20, 40}) {
    const Errors errors = follow(body.get(), discs, {{0, 0, -1}}, depth);
    std::printf("beam %d mm: field %.2f %% force %.2f %% least J %.2f evaluations %.2f\n", depth, 100 * errors.field,
                100 * errors.force, errors.least_volume, errors.evaluations);
    EXPECT_LE(errors.field, 0.01) << depth;
    EXPECT_LE(errors.force, 0.02) << depth;
  }
}

// Of the tetrahedra in the outer half of the beam, over that at rest. u: [3 nodes] m.
double volume_of_outer_half(const HyperelasticBody& body, const VectorXd& u) {
  double now = 0, at_rest = 0;
  for (std::int32_t t = 0; t < body.tetrahedron_count; ++t) {
    const std::int32_t* const corner = body.tetrahedra + 4 * t;
    const auto six_volumes = [&](bool moved) {
      Vector3d x[4];
      for (int v = 0; v < 4; ++v) {
        x[v] = Vector3d(body.nodes + 3 * corner[v]);
        if (moved) x[v] += u.segment<3>(3 * corner[v]);
      }
      return (x[1] - x[0]).cross(x[2] - x[0]).dot(x[3] - x[0]);
    };
    double x = 0;
    for (int v = 0; v < 4; ++v) x += body.nodes[3 * corner[v]] / 4;
    if (x > 0.05) now += six_volumes(true), at_rest += six_volumes(false);
  }
  return now / at_rest;
}

TEST(LargeSolver, APartThatTurnsKeepsItsVolumeWhereLinearElasticityInflatesIt) {
  const LargeBody body(beam(), true);
  Discs discs;
  discs.add(body.get(), {0.1, 0.01, 0.01}, 0.015);
  Solved solved(body.get());
  VectorXd linear;
  for (int tick = 1; tick <= 600; ++tick) {
    discs.set(0, Vector3d(0, 0, -1e-4 * tick));
    solved.step(discs);
    if (tick == 1) linear = 600 * solved.field();
  }
  const double large_volume = volume_of_outer_half(body.get(), solved.field()),
               linear_volume = volume_of_outer_half(body.get(), linear);
  std::printf("volume of the outer half: %.3f, linear %.3f\n", large_volume, linear_volume);
  EXPECT_NEAR(large_volume, 1,
              0.02);  // straight down, the tip draws the beam longer by 17 %: (1 - 2 nu) of it is volume
  EXPECT_GT(linear_volume, 1.1);
}

// Ticks until the force at a target that stands still is within `share` of the converged one; `most` where it never is.
int ticks_to_settle(Solved& solved, const Discs& discs, const VectorXd& force, double share, int most) {
  for (int tick = 0; tick < most; ++tick) {
    solved.step(discs);
    if ((solved.force - force).norm() <= share * force.norm()) return tick;
  }
  return most;
}

TEST(LargeSolver, JumpsOfThirtyMillimetresInOneStepSettle) {
  for (const bool nodal : {false, true}) {
    const LargeBody body(block(0.45), nodal);
    const LargeReference reference(body.get());
    for (const Vector3d& way : {Vector3d(0, 0, -1), Vector3d(0, 0, 1), Vector3d(1, 0, 0)}) {
      Discs discs;
      discs.add(body.get(), {0.06, 0.06, 0.08}, 0.021);
      discs.set(0, 0.03 * way);
      VectorXd u = VectorXd::Zero(reference.dofs());
      const Eigen::MatrixXd rows = discs.dense(reference.dofs());
      VectorXd force;
      for (const double share : {0.25, 0.5, 0.75, 1.0}) force = reference.solve(rows, share * discs.targets(), &u);
      Solved solved(body.get());
      EXPECT_LE(ticks_to_settle(solved, discs, force, 0.02, 40), 33) << nodal << way.transpose();  // the study's worst
    }
  }
}

TEST(LargeSolver, ReturnsToRestFromSixtyMillimetres) {
  for (const bool nodal : {false, true})
    for (const Vector3d& way : {Vector3d(0, 0, -1), Vector3d(0, 0, 1), Vector3d(0.8, 0, -0.6)}) {
      const LargeBody body(block(0.45), nodal);
      Solved solved(body.get());
      Discs discs, none;
      discs.add(body.get(), {0.06, 0.06, 0.08}, 0.021);
      double most = 0;
      for (int tick = 1; tick <= 300; ++tick) {  // 200 mm/s
        discs.set(0, 2e-4 * tick * way);
        EXPECT_FALSE(solved.step(discs).failed);
        most = std::max(most, solved.field().cwiseAbs().maxCoeff());
      }
      EXPECT_GT(most, 0.05);
      for (int tick = 299; tick >= 0; --tick) {
        discs.set(0, 2e-4 * tick * way);
        EXPECT_FALSE(solved.step(discs).failed);
      }
      for (int tick = 0; tick < 50; ++tick) solved.step(none);
      EXPECT_LE(solved.field().cwiseAbs().maxCoeff(), 1e-4 * most) << nodal << way.transpose();
    }
}

TEST(LargeSolver, AContactThatIsLetGoSpringsBack) {
  const LargeBody body(block(0.45), true);
  Solved solved(body.get());
  Discs discs, none;
  discs.add(body.get(), {0.06, 0.06, 0.08}, 0.021);
  for (int tick = 1; tick <= 200; ++tick) discs.set(0, {0, 0, -1e-4 * tick}), solved.step(discs);
  int ticks = 0;
  while (solved.field().cwiseAbs().maxCoeff() > 2e-4 && ticks < 60) solved.step(none), ++ticks;
  EXPECT_LE(ticks, 30);
}

// Memory of the body stays valid while another contact comes and goes: the force of the first one does not depend on it.
TEST(LargeSolver, ContactsThatComeAndGoLeaveTheForceOfTheOthers) {
  const LargeBody body(block(0.45), true);
  Discs one, two;
  one.add(body.get(), {0.03, 0.06, 0.08}, 0.021);
  two.add(body.get(), {0.03, 0.06, 0.08}, 0.021), two.add(body.get(), {0.09, 0.06, 0.08}, 0.021);
  Solved alone(body.get()), disturbed(body.get());
  for (int tick = 1; tick <= 200; ++tick) {
    one.set(0, {0, 0, -1e-4 * tick}), two.set(0, {0, 0, -1e-4 * tick});
    two.set(1, disturbed.field().segment<3>(3 * two.nodes.back()));
    alone.step(one);
    disturbed.step(tick % 20 < 10 ? one : two);
  }
  for (int tick = 0; tick < 5; ++tick) alone.step(one), disturbed.step(one);
  // Both are within the tolerance of the same solution.
  EXPECT_LE((alone.force - disturbed.force).norm(), 0.01 * alone.force.norm());
}

TEST(LargeSolver, AComplianceBetweenRowAndBodyTakesItsShare) {
  // L r adds to the displacement that the body takes: with the force r at the target d, the body alone has r at d - L r.
  const LargeBody body(block(0.45), true);
  const double compliance = 0.01;  // m/N, about that of the body
  Discs soft, plain;
  soft.add(body.get(), {0.06, 0.06, 0.08}, 0.021, compliance);
  plain.add(body.get(), {0.06, 0.06, 0.08}, 0.021);
  Solved with(body.get());
  for (int tick = 1; tick <= 200; ++tick) soft.set(0, {0, 0, -1e-4 * tick}), with.step(soft);
  for (int tick = 0; tick < 10; ++tick) with.step(soft);
  const LargeReference reference(body.get());
  VectorXd u = with.field();
  const VectorXd left = soft.targets() - compliance * with.force;
  EXPECT_LE(std::abs(left[2]), 0.9 * 0.02);
  const VectorXd force = reference.solve(plain.dense(reference.dofs()), left, &u);
  EXPECT_LE((with.force - force).norm(), 0.01 * force.norm());  // the tolerance of a step
}

TEST(LargeSolver, ImpossibleTargetsGiveFiniteAnswersAndARecovery) {
  const LargeBody body(block(0.45), true);
  Solved solved(body.get());
  Discs discs, none;
  discs.add(body.get(), {0.06, 0.06, 0.08}, 0.021), discs.add(body.get(), {0.06, 0.06, 0.08}, 0.021);
  for (int tick = 0; tick < 20; ++tick) {  // through the fixed face, and two targets for the same disc
    discs.set(0, {0, 0, -0.2}), discs.set(1, {0, 0, tick % 2 ? 0.3 : -0.1});
    const LargeOutcome outcome = solved.step(discs);
    EXPECT_GT(outcome.least_volume, 0);
  }
  for (int tick = 0; tick < 100; ++tick) solved.step(none);
  EXPECT_LE(solved.field().cwiseAbs().maxCoeff(), 1e-5);
}

TEST(LargeSolver, AStepAtRestComputesNothingAndATargetThatStaysIsNotSolvedAgain) {
  const LargeBody body(block(0.45), true);
  Solved solved(body.get());
  Discs discs, none;
  EXPECT_EQ(solved.step(none).evaluations, 0);
  discs.add(body.get(), {0.06, 0.06, 0.08}, 0.021);
  discs.set(0, {0, 0, -0.005});
  for (int tick = 0; tick < 20; ++tick) solved.step(discs);
  const VectorXd before = solved.force;
  EXPECT_EQ(solved.step(discs).evaluations, 0);
  EXPECT_EQ(solved.force, before);
}

}  // namespace
}  // namespace palpate::tests
