// The supernodal factor and the residuals of a batch against dense arithmetic.
#include <gmock/gmock.h>

#include "precompute/solver/elimination.h"
#include "precompute/solver/supernodal_factor.h"
#include "precompute/solver/supernodal_kernels.h"
#include "tests/precompute/factor_checks.h"

namespace palpate::tests {
namespace {

using Eigen::MatrixXd;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

BlockMatrix box_stiffness(std::array<int, 3> cells, double contrast = 1) {
  TetrahedralMesh mesh = box_mesh(cells, {1, 1, 1}, 0.2);
  mesh.region_names = {"soft", "stiff"};
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) mesh.region[t] = t % 3 == 0;
  ElasticBody body = body_of(mesh, {{1000, 0.45, 0}, {1000 * contrast, 0.3, 0}});
  hold(body, [](const auto& p) { return p[0] == 0 ? 7 : p[1] == 0 ? 2 : 0; });
  return remove_held_dofs(assemble_stiffness(body), body.fixed).matrix;
}

BlockMatrix from_dense(const MatrixXd& k) {  // keeps every block that is not zero
  BlockMatrix result;
  result.rows = static_cast<std::int32_t>(k.rows() / 3);
  result.first = {0};
  for (std::int32_t i = 0; i < result.rows; ++i) {
    for (std::int32_t j = 0; j < result.rows; ++j) {
      const RowMajor block = k.block<3, 3>(3 * i, 3 * j);
      if (block.isZero(0) && i != j) continue;
      result.column.push_back(j);
      result.block.emplace_back();
      std::copy(block.data(), block.data() + 9, result.block.back().begin());
    }
    result.first.push_back(static_cast<std::int64_t>(result.column.size()));
  }
  return result;
}

// Couples the neighbours of neighbours as well: the pattern of p1-anp.
BlockMatrix wider(const BlockMatrix& k) {
  const MatrixXd d = dense(k);
  return from_dense(d + d * d / d.norm());
}

std::shared_ptr<const Elimination> eliminated(const BlockMatrix& matrix) {
  return std::make_shared<const Elimination>(analyse_elimination(matrix));
}

void expect_solves(const BlockMatrix& matrix, int width) {
  const MatrixXd k = dense(matrix);
  SupernodalFactor factor(matrix, eliminated(matrix), width);
  const UnitForces unit = expect_factor_solves(factor, k, width);
  const RowMajor &x = unit.columns, b = random_block(k.rows(), width, 7);
  const auto norms = residual_norms(matrix, unit.loads, x.data(), width);
  const Eigen::RowVectorXd expected = (k * x - unit.batch).colwise().norm();
  for (int c = 0; c < width; ++c) EXPECT_NEAR(norms[c], expected[c], kRounding * k.norm() * x.col(c).norm());
  // The same for an x that is no solution: its residual is large, so that rounding does not hide a mistake.
  const auto off = residual_norms(matrix, unit.loads, b.data(), width);
  const Eigen::RowVectorXd far = (k * b - unit.batch).colwise().norm();
  for (int c = 0; c < width; ++c) EXPECT_NEAR(off[c], far[c], 1e-13 * far[c]);
}

// A supernode of five block columns with four block rows below among rows 0 .. 19, its columns being rows 3 .. 7.
struct OneSupernode {
  static constexpr std::int32_t kFirst = 3, kColumns = 5, kBelow = 4, kRows = 20;
  std::vector<std::int32_t> rows = {9, 12, 13, 19};
  MatrixXd l = MatrixXd(random_block(3 * (kColumns + kBelow), 3 * kColumns, 3));
  std::vector<double> values;

  OneSupernode() {
    l.topRows(3 * kColumns) = MatrixXd(l.topRows(3 * kColumns).triangularView<Eigen::Lower>());
    l.diagonal().array() += 4;
    for (Eigen::Index panel = 0; panel < l.cols(); panel += 6)
      for (Eigen::Index i = panel; i < l.rows(); ++i)
        for (Eigen::Index j = panel; j < std::min<Eigen::Index>(panel + 6, l.cols()); ++j)
          values.push_back(i == j ? 1 / l(i, j) : l(i, j));
  }
  Supernode<double> part() const { return {kFirst, kColumns, kBelow, rows.data(), values.data()}; }
  RowMajor below(const RowMajor& y) const {
    RowMajor result(3 * kBelow, y.cols());
    for (std::int32_t i = 0; i < kBelow; ++i) result.middleRows(3 * i, 3) = y.middleRows(3 * rows[i], 3);
    return result;
  }
};

TEST(Supernodal, KernelsOfEveryRegisterWidthAgreeWithDenseArithmetic) {
  const OneSupernode supernode;
  ASSERT_EQ(static_cast<std::int64_t>(supernode.values.size()),
            supernode_numbers(OneSupernode::kColumns, OneSupernode::kBelow, 3));
  const MatrixXd l11 = supernode.l.topRows(15), l21 = supernode.l.bottomRows(12);
  for (const int lanes : {2, 4, 8}) {
    if (lanes > lanes_here()) continue;
    const SupernodalKernels<double> kernels = supernodal_kernels<double>(3, lanes);
    for (const int width : {8, 24, 56, 96}) {
      const RowMajor y = random_block(3 * OneSupernode::kRows, width, 11);
      const MatrixXd own = y.middleRows(9, 15), below = supernode.below(y);
      RowMajor z = y;
      kernels.forward(supernode.part(), z.data(), width);
      const MatrixXd solved = l11.triangularView<Eigen::Lower>().solve(own);
      // Sums of at most 30 products of numbers below 10: some tens of rounding errors.
      EXPECT_LE((z.middleRows(9, 15) - solved).lpNorm<Eigen::Infinity>(), 1e-13) << lanes << ' ' << width;
      EXPECT_LE((supernode.below(z) - (below - l21 * solved)).lpNorm<Eigen::Infinity>(), 1e-13) << lanes;
      for (const std::int32_t other : {0, 1, 2, 8, 10, 11, 14, 15, 16, 17, 18})
        EXPECT_EQ(z.middleRows(3 * other, 3), y.middleRows(3 * other, 3)) << other;

      z = y;
      kernels.backward(supernode.part(), false, z.data(), width);
      const MatrixXd back = l11.transpose().triangularView<Eigen::Upper>().solve(own - l21.transpose() * below);
      EXPECT_LE((z.middleRows(9, 15) - back).lpNorm<Eigen::Infinity>(), 1e-13) << lanes << ' ' << width;
      z = y;
      z.middleRows(9, 15).setConstant(std::numeric_limits<double>::quiet_NaN());
      kernels.backward(supernode.part(), true, z.data(), width);
      const MatrixXd from_zero = l11.transpose().triangularView<Eigen::Upper>().solve(-(l21.transpose() * below));
      EXPECT_LE((z.middleRows(9, 15) - from_zero).lpNorm<Eigen::Infinity>(), 1e-13) << lanes << ' ' << width;
    }
  }
}

TEST(Supernodal, SolvesAsADenseFactorDoesForAnyWidth) {
  const BlockMatrix k = box_stiffness({4, 4, 4});
  for (const int width : {8, 16, 24, 40, 48, 72, 96, 104}) expect_solves(k, width);
}

TEST(Supernodal, SolvesOneRowTwoRowsAndManySupernodes) {
  MatrixXd one(3, 3);
  one << 4, 1, 0, 1, 5, 2, 0, 2, 6;
  expect_solves(from_dense(one), 8);
  MatrixXd two = MatrixXd::Identity(6, 6) * 7;
  two.topRightCorner(3, 3) = one / 2;
  two.bottomLeftCorner(3, 3) = one / 2;
  expect_solves(from_dense(two), 8);
  expect_solves(box_stiffness({9, 5, 5}), 24);
}

TEST(Supernodal, AColumnHasTheSameBitsInAnyBlock) {
  const BlockMatrix k = box_stiffness({6, 6, 6});
  SupernodalFactor narrow(k, eliminated(k), 8), wide(k, eliminated(k), 96);
  const std::int64_t dofs = 3 * static_cast<std::int64_t>(k.rows);
  RowMajor alone(dofs, 8), among(dofs, 96);
  narrow.apply_to_loads(std::vector<Load>{{100, 0, 1.0}}, alone.data());
  std::vector<Load> loads;
  for (std::int32_t c = 0; c < 96; ++c) loads.push_back({c == 61 ? 100 : (37 * c) % dofs, c, 1.0});
  wide.apply_to_loads(loads, among.data());
  EXPECT_EQ(alone.col(0), among.col(61));
}

TEST(Supernodal, SolvesPartsThatAreNotConnected) {
  const MatrixXd part = dense(box_stiffness({2, 2, 2}));
  MatrixXd both = MatrixXd::Zero(2 * part.rows() + 3, 2 * part.rows() + 3);
  both.topLeftCorner(part.rows(), part.rows()) = part;
  both.block(part.rows(), part.rows(), part.rows(), part.rows()) = 10 * part;
  both.bottomRightCorner(3, 3).setIdentity();
  expect_solves(from_dense(both), 16);
}

TEST(Supernodal, SolvesTheWiderPatternOfNodalAverages) {
  expect_solves(wider(box_stiffness({4, 3, 3})), 24);
}

TEST(Supernodal, StaysBackwardStableAtAContrastOfAMillion) {
  expect_solves(box_stiffness({4, 4, 4}, 1e6), 8);
}

TEST(Supernodal, TakesAMatrixInEliminationOrderWithoutMovingIt) {
  const BlockMatrix k = box_stiffness({5, 4, 4});
  const Elimination first = analyse_elimination(k);
  const RowMajor d = dense(k);
  MatrixXd permuted(d.rows(), d.cols());
  for (std::int32_t i = 0; i < k.rows; ++i)
    for (std::int32_t j = 0; j < k.rows; ++j)
      permuted.block<3, 3>(3 * first.place[i], 3 * first.place[j]) = d.block<3, 3>(3 * i, 3 * j);
  expect_solves(from_dense(permuted), 16);
}

TEST(Supernodal, CountsWhatItStores) {
  const BlockMatrix k = box_stiffness({6, 6, 6});
  const Elimination e = analyse_elimination(k);
  // The factor of the permuted matrix, entry by entry: supernodes may add zeros, and must not lack an entry.
  MatrixXd permuted(3 * k.rows, 3 * k.rows);
  const MatrixXd d = dense(k);
  for (std::int32_t i = 0; i < k.rows; ++i)
    for (std::int32_t j = 0; j < k.rows; ++j)
      permuted.block<3, 3>(3 * e.place[i], 3 * e.place[j]) = d.block<3, 3>(3 * i, 3 * j);
  const MatrixXd l = Eigen::LLT<MatrixXd>(permuted).matrixL();
  const auto filled = ((l.array().abs() > 1e-14 * l.cwiseAbs().maxCoeff()).cast<double>().sum());
  EXPECT_GE(static_cast<double>(e.numbers()), filled);
  EXPECT_LE(static_cast<double>(e.numbers()), 1.5 * filled);  // amalgamation's zeros, 5 to 20 % on meshes
  const SupernodalFactor factor(k, std::make_shared<const Elimination>(e), 8);
  const double ratio = l.diagonal().minCoeff() / l.diagonal().maxCoeff();
  EXPECT_NEAR(factor.reciprocal_condition(), ratio * ratio, 1e-9 * ratio * ratio);  // rounding of the factors
}

TEST(Supernodal, RefusesAMatrixThatIsNotPositiveDefinite) {
  MatrixXd d = dense(box_stiffness({3, 3, 3}));
  d -= 0.5 * d.diagonal().maxCoeff() * MatrixXd::Identity(d.rows(), d.cols());
  const BlockMatrix k = from_dense(d);
  EXPECT_THAT([&] { SupernodalFactor(k, eliminated(k), 8); },
              ThrowsMessage<OperationError>(HasSubstr("not positive definite")));
}

TEST(Supernodal, NamesTheNodeAtWhichTheFactorisationFails) {
  const BlockMatrix k = from_dense(-MatrixXd::Identity(3, 3));
  const std::vector<std::int32_t> node = {41};
  const std::vector<std::array<double, 3>> position = {{0.5, -0.25, 2}};
  EXPECT_THAT(
      [&] {
        SupernodalFactor(k, eliminated(k), 8, {node, position});
      },
      ThrowsMessage<OperationError>(HasSubstr("node 41 at (0.5, -0.25, 2) m")));
}

// The rows are renumbered before they are factored; the error must give the number of the node in the mesh.
TEST(Supernodal, NamesTheMeshsNodeAndNotItsPlaceInTheElimination) {
  MatrixXd d = dense(box_stiffness({4, 4, 4}));
  constexpr int kBad = 17;
  d.row(3 * kBad).setZero(), d.col(3 * kBad).setZero(), d(3 * kBad, 3 * kBad) = -1;
  HeldStiffness held;
  held.matrix = from_dense(d);
  for (std::int32_t row = 0; row < held.matrix.rows; ++row) {
    held.node_of_row.push_back(1000 + row);
    held.row_of_node.resize(1001 + static_cast<std::size_t>(row), -1);
    held.row_of_node.back() = row;
  }
  const auto elimination = put_in_order(held, analyse_elimination(held.matrix));
  EXPECT_THAT(
      [&] {
        SupernodalFactor(held.matrix, elimination, 8, {held.node_of_row, {}});
      },
      ThrowsMessage<OperationError>(HasSubstr("fails at node 1017")));
}

}  // namespace
}  // namespace palpate::tests
