// The contact laws on systems whose matrices the test makes: the solution obeys the laws, costs no more than it may, and tells by
// how much it misses.
#include "runtime/contact/law_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>
#include <vector>

#include "runtime/dense/dense_lu.h"

namespace palpate::tests {
namespace {

// Contacts on a plane: the compliance between two of them falls with their distance. Rows: normal and two tangents.
struct Touching {
  explicit Touching(int contacts, double friction, unsigned seed, double spread = 3) : count(contacts) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(-1, 1);
    const int rows = 3 * contacts;
    stride = static_cast<std::size_t>(rows);
    matrix.resize(stride * stride), soft.assign(stride, 0), target.resize(stride);
    Eigen::MatrixXd place = Eigen::MatrixXd::NullaryExpr(2, contacts, [&] { return spread * any(random); });
    Eigen::Matrix3d own;
    own << 1, 0.1, 0.05, 0.1, 1.2, 0, 0.05, 0, 1.1;
    for (int p = 0; p < contacts; ++p)
      for (int q = 0; q < contacts; ++q) {
        const double near = std::exp(-(place.col(p) - place.col(q)).squaredNorm());
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) at(3 * p + i, 3 * q + j) = kOwn * own(i, j) * (p == q ? 1 : 0.9 * near);
      }
    for (double& d : target) d = 0.003 * any(random);
    for (int p = 0; p < contacts; ++p) {
      ContactConstraint constraint = {};
      constraint.law = ContactLaw::coulomb, constraint.friction = friction;
      target[3 * p] += 0.003;  // most push
      constraints.push_back(constraint);
      rows_of.push_back({{3 * p, 3 * p + 1, 3 * p + 2}});
    }
  }
  double& at(int i, int j) { return matrix[i * stride + j]; }
  double largest() const {
    return Eigen::Map<const Eigen::VectorXd>(target.data(), 3 * count).lpNorm<Eigen::Infinity>();
  }
  ContactSystem system() const {
    ContactSystem system;
    system.matrix = matrix.data(), system.stride = stride, system.rows_end = 3 * count, system.soft = soft.data();
    system.target = target.data(), system.constraints = constraints.data(), system.rows = rows_of.data();
    system.constraint_count = count;
    return system;
  }
  // (H W H^T + soft) r - d, with Eigen.
  Eigen::VectorXd ahead(const std::vector<double>& r) const {
    const Eigen::Map<const Eigen::VectorXd> force(r.data(), 3 * count), d(target.data(), 3 * count);
    const Eigen::Map<const Eigen::MatrixXd> a(matrix.data(), 3 * count, 3 * count);
    return a * force + Eigen::Map<const Eigen::VectorXd>(soft.data(), 3 * count).cwiseProduct(force) - d;
  }

  static constexpr double kOwn = 0.01;  // m/N, a soft organ under a small disc
  int count;
  std::size_t stride = 0;
  std::vector<double> matrix, soft, target;
  std::vector<ContactConstraint> constraints;
  std::vector<RowsOfConstraint> rows_of;
};

struct Solver {
  explicit Solver(int rows) : memory(palpate_allocator{}) { EXPECT_TRUE(laws.create(memory, rows)); }
  ~Solver() { memory.release_all(); }
  SceneMemory memory;
  LawSolver laws;
};

// Signorini's and Coulomb's laws as docs/method.md writes them, each to `off` metres.
void expect_laws(const Touching& touching, const std::vector<double>& r, double off) {
  const Eigen::VectorXd w = touching.ahead(r);
  const double force_off = 2 * off / Touching::kOwn;
  for (int p = 0; p < touching.count; ++p) {
    const double push = r[3 * p], gap = w[3 * p], friction = touching.constraints[p].friction;
    const Eigen::Vector2d hold(r[3 * p + 1], r[3 * p + 2]), slip(w[3 * p + 1], w[3 * p + 2]);
    ASSERT_GE(push, 0) << p;
    ASSERT_GE(gap, -off) << p;
    ASSERT_TRUE(push <= force_off || gap <= off) << p << " pushes by " << push << " N over a gap of " << gap << " m";
    ASSERT_LE(hold.norm(), friction * push * (1 + 1e-12)) << p;
    if (hold.norm() < friction * push - force_off) {
      ASSERT_LE(slip.norm(), 2 * off) << p << " slips although it need not";
    } else if (hold.norm() > force_off && slip.norm() > 2 * off) {
      // The slip is opposite to the friction, up to what `off` can turn either of them.
      ASSERT_LE((slip.normalized() + hold.normalized()).norm(), 2 * off / slip.norm() + force_off / hold.norm()) << p;
    }
  }
}

// As a needle's place that slides: the row along the shaft stays at its limit, and the two across it, which are nearly alike here, are met in
// the same sweep. Row by row they were not: 0.97^2 of what is missed is left in each round.
TEST(LawSolver, SolvesARowAtItsLimitAndTheTwoBesideItInOneSweep) {
  Touching one(1, 0, 3);
  Eigen::Matrix3d own;
  own << 1, 0.5, 0.5, 0.5, 1, 0.97, 0.5, 0.97, 1;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) one.at(i, j) = Touching::kOwn * own(i, j);
  one.constraints[0].law = ContactLaw::sticking, one.constraints[0].limit = 0.02;
  for (const double along : {0.01, -0.01}) {
    one.target = {along, 0.003, -0.001};
    std::vector<double> r(3, 0.0);
    sweep_contacts(one.system(), r.data());
    EXPECT_EQ(r[0], along > 0 ? 0.02 : -0.02);
    EXPECT_LT(one.ahead(r).tail<2>().norm(), 1e-15);
  }
}

TEST(LawSolver, MeetsTheLawsOfOneToManyContacts) {
  for (const int contacts : {1, 2, 3, 8, 24, 64})
    for (const double friction : {0.0, 0.3, 1.0})
      for (unsigned seed = 0; seed < 5; ++seed) {
        const Touching touching(contacts, friction, seed);
        Solver solver(3 * contacts);
        std::vector<double> r(3 * contacts);
        const double tolerance = 1e-10 * touching.largest();
        const double missed = solver.laws.solve(touching.system(), tolerance, std::int64_t{1} << 40, r.data());
        ASSERT_LE(missed, tolerance) << contacts << " contacts, friction " << friction << ", seed " << seed;
        // Rounding of sums of 192 products may add to what is missed.
        expect_laws(touching, r, 2 * tolerance);
      }
}

// Contacts all over an organ that moves as a whole on its supports, translations and turns: each contact moves all others nearly as far as itself.
Touching on_a_swinging_organ(double friction, double spread, double along, unsigned seed) {
  Touching touching(34, friction, seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(-1, 1);
  const int rows = 3 * touching.count;
  Eigen::MatrixXd places = Eigen::MatrixXd::NullaryExpr(3, touching.count, [&] { return any(random); });
  places.topRows<2>() *= spread;
  Eigen::MatrixXd as_a_whole(rows, 6);
  for (int p = 0; p < touching.count; ++p) {
    const Eigen::Vector3d x = places.col(p);
    Eigen::Matrix3d turns;
    turns << 0, -x[2], x[1], x[2], 0, -x[0], -x[1], x[0], 0;
    as_a_whole.middleRows<3>(3 * p) << Eigen::Matrix3d::Identity(), turns;
  }
  const Eigen::MatrixXd swing = as_a_whole * as_a_whole.transpose();
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < rows; ++j) touching.at(i, j) = 0.1 * touching.at(i, j) + Touching::kOwn * swing(i, j);
  for (int i = 0; i < rows; ++i)
    touching.target[i] = 0.003 * any(random) * (i % 3 == 0 ? 1 : along) + (i % 3 == 0 ? 0.001 : 0);
  return touching;
}

// In one of a hundred of these Newton's method alone wanders among states of sticking and slipping until all operations are spent.
TEST(LawSolver, MeetsTheLawsOfManyContactsOnAnOrganThatSwings) {
  for (const double friction : {0.05, 0.1, 0.3})
    for (const double spread : {1.0, 3.0})
      for (const double along : {1.0, 3.0})
        for (unsigned seed = 440; seed < 490; ++seed) {
          const Touching touching = on_a_swinging_organ(friction, spread, along, seed);
          Solver solver(3 * touching.count);
          std::vector<double> r(3 * touching.count);
          const double tolerance = 1e-10 * touching.largest();
          // 20 million operations: ten times the mean. The last correction of the forces may miss by some tolerances again.
          ASSERT_LE(solver.laws.solve(touching.system(), tolerance, 20'000'000, r.data()), 10 * tolerance)
              << "friction " << friction << ", spread " << spread << ", along " << along << ", seed " << seed;
        }
}

TEST(LawSolver, AgreesWithGaussSeidelCarriedToItsEnd) {
  const Touching touching(24, 0.3, 7);
  Solver solver(72);
  std::vector<double> r(72), slow(72);
  const double tolerance = 1e-12 * touching.largest();
  ASSERT_LE(solver.laws.solve(touching.system(), tolerance, std::int64_t{1} << 40, r.data()), tolerance);
  ASSERT_LE(solver.laws.sweep(touching.system(), 0.01 * tolerance, std::int64_t{1} << 40, slow.data()), tolerance);
  for (int i = 0; i < 72; ++i) EXPECT_NEAR(r[i], slow[i], 1e-9 * touching.largest() / Touching::kOwn) << i;
}

// Two contacts hold one place, the second one a little deeper. Gauss-Seidel hands the force from the first to the second, by the
// same small amount in each sweep: one sweep for each part of the depth by which they differ.
TEST(LawSolver, HandsAForceOverAtOnceWhereTwoContactsHoldOnePlace) {
  Touching touching(2, 0.3, 1);
  const double depth = 0.005, deeper = 5e-6;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      touching.at(i, 3 + j) = touching.at(3 + i, j) = touching.at(3 + i, 3 + j) = touching.at(i, j);
  for (int i = 0; i < 6; ++i) touching.soft[i] = 1e-6 * touching.at(i, i);
  touching.target = {depth, 0, 0, depth + deeper, 0.0005, 0};
  const std::vector<double> start = {depth / Touching::kOwn, 0, 0, 0, 0, 0};
  const double tolerance = 1e-9 * depth;
  Solver solver(6);
  std::vector<double> r = start;
  ASSERT_LE(solver.laws.solve(touching.system(), tolerance, 100'000, r.data()), tolerance);
  EXPECT_EQ(r[0], 0);
  expect_laws(touching, r, 2 * tolerance);
  // The case is what it claims to be.
  r = start;
  EXPECT_GT(solver.laws.sweep(touching.system(), tolerance, 100'000, r.data()), 0.5 * deeper);
}

TEST(LawSolver, SpendsNoMoreThanItMayAndTellsWhatItMisses) {
  for (const double friction : {0.3, 20.0})
    for (unsigned seed = 0; seed < 4; ++seed) {
      const Touching touching(32, friction, seed, 1.5);
      const ContactSystem system = touching.system();
      const std::int64_t least = LawSolver::fewest_operations(system);
      int inexact = 0;
      for (const std::int64_t most : {std::int64_t{0}, least, 2 * least, 4 * least, 16 * least, 256 * least}) {
        Solver solver(96);
        std::vector<double> r(96);
        // Even from a start far from the laws.
        for (int i = 0; i < 96; ++i) r[i] = 100 * ((i * 37) % 11 - 5);
        const double missed = solver.laws.solve(system, 1e-10 * touching.largest(), most, r.data());
        EXPECT_LE(solver.laws.effort().operations, std::max(most, LawSolver::operations_to_look(system)));
        EXPECT_EQ(solver.laws.effort().sweeps >= 1, most >= least);
        std::vector<double> ahead(96);
        find_ahead(system, r.data(), ahead.data());
        // A start that is made to obey is scaled after it was measured: rounding of a sum of 96 terms.
        EXPECT_NEAR(law_residual(system, r.data(), ahead.data()).displacement, missed,
                    most < least ? 1e-13 * missed : 0);
        inexact += missed > 1e-6 * touching.largest();
        double work = 0, offered = 0;
        for (int p = 0; p < 32; ++p) {
          EXPECT_GE(r[3 * p], 0);
          EXPECT_LE(std::hypot(r[3 * p + 1], r[3 * p + 2]), friction * r[3 * p] * (1 + 1e-12));
          for (int i = 3 * p; i < 3 * p + 3; ++i) work += r[i] * ahead[i], offered += r[i] * touching.target[i];
        }
        EXPECT_LE(work, 1e-8 * std::abs(offered)) << friction << " " << seed << " " << most;
      }
      EXPECT_GT(inexact, 0);
      if (friction < 1) {
        EXPECT_LT(inexact, 6);
      }
    }
}

TEST(LawSolver, KeepsEveryReactionWithinItsLimitWhereverItEnds) {
  int at_limit = 0;
  for (const double friction : {0.3, 20.0})
    for (unsigned seed = 0; seed < 4; ++seed) {
      const Touching touching(32, friction, seed, 1.5);
      // Half of what a row alone would need for the largest target: the laws ask for more.
      const std::vector<double> most(96, 0.5 * touching.largest() / Touching::kOwn);
      ContactSystem system = touching.system();
      system.most = most.data();
      const std::int64_t least = LawSolver::fewest_operations(system);
      for (const std::int64_t operations : {std::int64_t{0}, least, 4 * least, 256 * least}) {
        Solver solver(96);
        std::vector<double> r(96);
        for (int i = 0; i < 96; ++i) r[i] = 100 * ((i * 37) % 11 - 5);
        solver.laws.solve(system, 1e-10 * touching.largest(), operations, r.data());
        for (int i = 0; i < 96; ++i) {
          EXPECT_LE(std::abs(r[i]), most[0] * (1 + 1e-12)) << friction << " " << seed << " " << operations;
          at_limit += std::abs(r[i]) > 0.999 * most[0];
        }
      }
    }
  EXPECT_GT(at_limit, 0);
}

TEST(FactorLu, SolvesTheSystemWithTheSameBitsWithAllInstructions) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> any(-1, 1);
  for (const int n : {1, 2, 7, 8, 9, 16, 31, 61, 130}) {
    const std::size_t stride = static_cast<std::size_t>(n) + 21;
    std::vector<double> start(stride * static_cast<std::size_t>(n) + 16, 0);
    Eigen::MatrixXd a(n, n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) a(i, j) = start[i * stride + j] = any(random) + (i == j ? 0.7 * n : 0);
    // The definition, entry by entry.
    std::vector<double> expected = start;
    const auto entry = [&](int i, int j) -> double& { return expected[i * stride + j]; };
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        for (int k = 0; k < std::min(i, j); ++k) {
          const volatile double product = entry(i, k) * entry(k, j);
          entry(i, j) -= product;
        }
        if (j < i) entry(i, j) /= entry(j, j);
      }
    Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(n, [&] { return any(random); });
    for (int set = 0; set <= static_cast<int>(best_instructions()); ++set) {
      std::vector<double> lu = start;
      ASSERT_TRUE(factor_lu(static_cast<Instructions>(set), n, lu.data(), stride));
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
          ASSERT_EQ(lu[i * stride + j], entry(i, j)) << set << " " << n << " " << i << " " << j;
      Eigen::VectorXd x = b;
      solve_lu(n, lu.data(), stride, x.data());
      // Rounding: the diagonal dominates, so no factor grows.
      EXPECT_LT((a * x - b).norm(), 1e-13 * n * b.norm());
    }
  }
  std::vector<double> singular(2 * 32, 1.0);
  EXPECT_FALSE(factor_lu(2, singular.data(), 32));
  singular[0] = NAN;
  EXPECT_FALSE(factor_lu(2, singular.data(), 32));
}

}  // namespace
}  // namespace palpate::tests
