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
    EXPECT_GE(outcome.residual, 0.5 * distance - 5e-4) << tick;  // near the solution single precision hides the rest
  }
}

// A beam that hangs from one end by four times its length in the linear response.
TEST(LargeFollows, ARestThatNewtonsMethodFindsIsFound) {
  ElasticBody elastic = body_of(box_mesh({12, 2, 2}, {0.10, 0.02, 0.02}, 0.1), {{5400, 0.45, 0}});
  hold(elastic, [](const auto& p) { return p[0] == 0 ? 7 : 0; });
  const LargeBody body(elastic, true);
  const LargeReference reference(body.get());
  VectorXd load = VectorXd::Zero(reference.dofs()), exact = load;
  double gradient[3][3];
  for (std::int32_t e = 0; e < body.get().tetrahedron_count; ++e)
    for (int a = 0; a < 4; ++a)  // 8,000 N/m^3
      if (const std::int32_t n = body.get().tetrahedra[4 * e + a]; !body.get().fixed[3 * n])
        load[3 * n + 2] -= 8000 * shape_gradients(body.get(), e, gradient) / 4;
  for (int i = 1; i <= 16; ++i) reference.balance(load * i / 16, &exact, 1e-7);
  // The linear response: held dofs are tied to the world.
  Eigen::MatrixXd k = Eigen::MatrixXd(reference.tangent(VectorXd::Zero(load.size())));
  for (Eigen::Index i = 0; i < load.size(); ++i)
    if (body.get().fixed[i]) k.row(i).setZero(), k.col(i).setZero(), k(i, i) = 1;
  const VectorXd linear = k.llt().solve(load);
  SceneMemory memory{palpate_allocator{}};
  LargeSolver solver;
  const auto order = elimination_order(body.get());
  ASSERT_EQ(
      solver.create(memory, body.get(), order.data(), static_cast<std::int32_t>(order.size()), 3, 10, linear.data()),
      LargeSolver::Created::made);
  double missed = 0, largest = 0;
  for (std::int32_t n = 0; n < body.get().node_count; ++n) {
    float rest[3];
    solver.rest_displacement(n, rest);
    for (int i = 0; i < 3; ++i)
      missed = std::max(missed, std::abs(static_cast<double>(rest[i]) - exact[3 * n + i])),
      largest = std::max(largest, std::abs(exact[3 * n + i]));
  }
  EXPECT_GT(largest, 0.1);
  EXPECT_LE(missed, 2e-3 * largest);  // kRestEnough
  memory.release_all();
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
