// What a hostile or a long use may do to the solver: closed tours, ten discs, bad tetrahedra, random targets.
#include <cstdio>
#include <random>

#include "studies/hyperelastic/large_reference.h"
#include "tests/runtime/large/discs.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

const Vector3d kTop(0.06, 0.06, 0.08);

// A body that is elastic gives back the work of a closed tour. What a step leaves unsolved may be lost, 0.5 % of the peak, and must
// not be gained: the organ would push a hand round and round.
TEST(LargeTrust, AClosedTourReturnsNoNetWork) {
  for (const bool nodal : {false, true})
    for (const int steps : {1, LargeSolver::kMostSteps}) {
      const LargeBody body(block(0.45), nodal);
      Solved solved(body.get());
      Discs discs;
      discs.add(body.get(), kTop, 0.021);
      Vector3d last = Vector3d::Zero(), force = Vector3d::Zero();
      double work = 0, peak = 0;
      const auto go = [&](const Vector3d& to) {
        discs.set(0, to);
        solved.step(discs, steps);
        work += 0.5 * (force + Vector3d(solved.force)).dot(to - last);
        force = solved.force, last = to, peak = std::max(peak, work);
      };
      for (int tick = 1; tick <= 150; ++tick) go({0, 0, -1e-4 * tick});
      const double begun = work;
      for (int round = 0; round < 3; ++round)
        for (int tick = 1; tick <= 630; ++tick) {  // 10 mm around, at 100 mm/s
          const double angle = 2 * EIGEN_PI * tick / 630;
          go({0.01 * std::sin(angle), 0.01 * (1 - std::cos(angle)), -0.015});
        }
      const double lost = (work - begun) / 3;
      for (int tick = 149; tick >= 0; --tick) go({0, 0, -1e-4 * tick});
      std::printf("tour, %s, %d steps: lost %.3f %% of the peak each; in all %.3f %%\n", nodal ? "p1-anp" : "p1", steps,
                  100 * lost / peak, 100 * work / peak);
      EXPECT_GE(lost, -1e-4 * peak) << nodal << steps;
      EXPECT_LE(lost, 5e-3 * peak) << nodal << steps;
      EXPECT_GE(work, -1e-4 * peak) << nodal << steps;
    }
}

TEST(LargeTrust, TenDiscsAreTheConvergedSolution) {
  const LargeBody body(block(0.45), true);
  Discs discs;
  std::vector<Vector3d> ways;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> part(-1, 1);
  for (int i = 0; i < 10; ++i) {
    const double y = i < 5 ? 0.035 : 0.085;
    discs.add(body.get(), {0.012 + 0.024 * (i % 5), y, 0.08}, 0.012);
    ways.emplace_back(0.3 * part(random), 0.3 * part(random), part(random));
  }
  Solved solved(body.get());
  for (int tick = 1; tick <= 120; ++tick) {
    for (std::size_t i = 0; i < ways.size(); ++i) discs.set(i, 1e-4 * tick * ways[i]);
    EXPECT_FALSE(solved.step(discs).failed);
  }
  const LargeReference reference(body.get());
  VectorXd u = solved.field();
  const VectorXd force = reference.solve(discs.dense(reference.dofs()), discs.targets(), &u);
  EXPECT_LE((solved.field() - u).norm(), 0.01 * u.norm());
  EXPECT_LE((solved.force - force).norm(), 0.02 * force.norm());
}

// A node beside the opposite face of its tetrahedra: some have a thousandth of their size.
TEST(LargeTrust, NearlyFlatTetrahedraAtRestAreFollowedAndReturn) {
  for (const bool nodal : {false, true}) {
    ElasticBody elastic = block(0.45);
    // The free node nearest to the middle goes along an edge until one of its tetrahedra is nearly flat.
    std::size_t moved = 0;
    const Vector3d middle(0.06, 0.06, 0.05);
    for (std::size_t n = 0; n < elastic.nodes.size(); ++n)
      if ((Vector3d(elastic.nodes[n].data()) - middle).norm() < (Vector3d(elastic.nodes[moved].data()) - middle).norm())
        moved = n;
    const auto volume = [&](const auto& t) {
      const Vector3d a(elastic.nodes[t[0]].data()), b(elastic.nodes[t[1]].data()), c(elastic.nodes[t[2]].data()),
          d(elastic.nodes[t[3]].data());
      return (b - a).cross(c - a).dot(d - a) / 6;
    };
    const auto least = [&] {
      double found = INFINITY;
      for (const auto& t : elastic.tetrahedra) found = std::min(found, volume(t));
      return found;
    };
    const double before = least();
    const Vector3d from(elastic.nodes[moved].data()), way(0.7, 0.4, 0.6);
    double low = 0, high = 0.1;
    for (int i = 0; i < 60; ++i) {
      const double half = 0.5 * (low + high);
      for (int d = 0; d < 3; ++d) elastic.nodes[moved][d] = from[d] + half * way[d];
      (least() > 1e-3 * before ? low : high) = half;
    }
    for (int d = 0; d < 3; ++d) elastic.nodes[moved][d] = from[d] + low * way[d];
    ASSERT_NEAR(least(), 1e-3 * before, 1e-6 * before);
    const LargeBody body(elastic, nodal);
    Solved solved(body.get());
    Discs discs, none;
    discs.add(body.get(), kTop, 0.021);
    for (int tick = 1; tick <= 400; ++tick) {
      discs.set(0, {0, 0, -1e-4 * (tick <= 200 ? tick : 400 - tick)});
      const LargeOutcome outcome = solved.step(discs);
      EXPECT_FALSE(outcome.failed) << tick;
      EXPECT_GT(outcome.least_volume, 0) << tick;
    }
    for (int tick = 0; tick < 100; ++tick) solved.step(none);
    EXPECT_LE(solved.field().cwiseAbs().maxCoeff(), 2e-6) << nodal;
  }
}

TEST(LargeTrust, RandomTargetsGiveFiniteForcesAndTheBodyReturns) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const LargeBody body(block(0.45), seed != 2);
    Solved solved(body.get());
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> part(-1, 1);
    Discs none;
    for (int tick = 0; tick < 200; ++tick) {
      Discs discs;
      for (int i = 0; i < 3; ++i)
        if (part(random) > -0.5) discs.add(body.get(), {0.03 + 0.03 * i, 0.06, 0.08}, 0.015);
      for (std::size_t i = 0; i < discs.rows.size() / 3; ++i)
        discs.set(i, 0.06 * Vector3d(part(random), part(random), part(random)));
      const LargeOutcome outcome = solved.step(discs);
      EXPECT_GT(outcome.least_volume, 0) << seed << tick;
    }
    for (int tick = 0; tick < 150; ++tick) solved.step(none);
    EXPECT_LE(solved.field().cwiseAbs().maxCoeff(), 6e-6) << seed;  // 1e-4 of 60 mm
  }
}

}  // namespace
}  // namespace palpate::tests
