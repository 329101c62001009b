// The solver follows its contacts, or says that it does not.
#include <cstdio>

#include "studies/hyperelastic/large_reference.h"
#include "tests/runtime/large/discs.h"
#include "tests/runtime/large/energy_account.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

const Vector3d kTop(0.06, 0.06, 0.08);

// The linear response to a jump gives such a tissue some 10^10 times the energy of the solution.
TEST(LargeFollows, AJumpIntoATissueThatStiffensIsGoneInPartsThatItCanFollow) {
  for (const bool nodal : {false, true}) {
    const LargeBody body(block(0.45), nodal, {32});
    Solved solved(body.get());
    const LargeReference reference(body.get());
    Discs discs;
    discs.add(body.get(), kTop, 0.021);
    discs.set(0, {0, 0, -0.02});
    VectorXd u = VectorXd::Zero(reference.dofs()), force;
    for (int i = 1; i <= 20; ++i)
      force = reference.solve(discs.dense(reference.dofs()), discs.targets() * i / 20, &u, 1e-7);
    EnergyAccount account;
    VectorXd of_energy;
    bool followed = false;
    for (int tick = 0; tick < 400 && !followed; ++tick) {
      const LargeOutcome outcome = solved.step(discs, LargeSolver::kFewestSteps);
      followed = !outcome.cut && !outcome.given_up && !outcome.unfinished;
      EXPECT_LE(solved.force.norm(), 3 * force.norm()) << tick;
      account.add(reference.energy(solved.field(), &of_energy),
                  discs.dense(reference.dofs()).transpose() * solved.force, solved.field());
    }
    EXPECT_TRUE(followed);
    EXPECT_LE(account.gained(), 0.05);
    EXPECT_LE((solved.force - force).norm(), 0.05 * force.norm());
    // And it comes back in the stated time.
    for (int tick = 0; tick <= LargeSolver::kStepsToRest; ++tick) solved.step(Discs{}, LargeSolver::kFewestSteps);
    EXPECT_EQ(solved.field().norm(), 0);
  }
}

// At nu 0.49 the tangent of a compressed body is many times stiffer than K, and a distance in K^-1 alone tells a fifth of the true one.
TEST(LargeFollows, TheResidualTellsTheDistanceInTheEnergy) {
  const LargeBody body(block(0.49), true);
  Solved solved(body.get());
  Discs discs;
  discs.add(body.get(), kTop, 0.021);
  const LargeReference reference(body.get());
  for (int tick = 1; tick <= 250; ++tick) {
    discs.set(0, Vector3d(0.3, 0, -1) * 1e-4 * tick);
    const LargeOutcome outcome = solved.step(discs, LargeSolver::kFewestSteps);
    if (tick % 50 != 0) continue;
    VectorXd u = solved.field(), force;
    const double here = reference.energy(u, &force);
    reference.solve(discs.dense(reference.dofs()), discs.targets(), &u);
    const double least = reference.energy(u, &force), distance = std::sqrt(std::max(here - least, 0.0) / least);
    std::printf("told %.2f %%, true %.2f %%\n", 100 * outcome.residual, 100 * distance);
    EXPECT_GE(outcome.residual, 0.5 * distance) << tick;
  }
}

TEST(LargeFollows, TargetsThatStandStillAreSolvedFurther) {
  for (const double poisson : {0.45, 0.49}) {
    const LargeBody body(block(poisson), true);
    Solved solved(body.get());
    Discs discs;
    discs.add(body.get(), kTop, 0.021);
    LargeOutcome outcome;
    for (int tick = 1; tick <= 250; ++tick) {
      discs.set(0, Vector3d(0.3, 0, -1) * 1e-4 * std::min(tick, 200));
      outcome = solved.step(discs, LargeSolver::kFewestSteps);
    }
    EXPECT_EQ(outcome.evaluations, 0) << "it is never done";
    EXPECT_LE(outcome.residual, LargeSolver::kStillTolerance);
    const LargeReference reference(body.get());
    VectorXd u = solved.field();
    const VectorXd force = reference.solve(discs.dense(reference.dofs()), discs.targets(), &u);
    EXPECT_LE((solved.field() - u).norm(), 3e-3 * u.norm()) << poisson;
    EXPECT_LE((solved.force - force).norm(), 2e-3 * force.norm()) << poisson;
  }
}

}  // namespace
}  // namespace palpate::tests
