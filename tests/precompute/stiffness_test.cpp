// Products with K, and the residuals that the solver certifies. The laws of the elements: elements_test.cpp, convergence_test.cpp.
#include <array>
#include <cmath>

#include "precompute/solver/batch_product.h"
#include "precompute/solver/column_solver.h"
#include "tests/precompute/support.h"

namespace palpate::tests {
namespace {

using Point = std::array<double, 3>;

TEST(Stiffness, MultipliesABlockAsItMultipliesEachColumn) {
  const ElasticBody body = body_of(box_mesh({3, 2, 2}, {0.3, 0.2, 0.4}, 0.2), {{5400, 0.45, 0}});
  const BlockMatrix k = assemble_stiffness(body);
  constexpr int kWidth = 48;  // one pass of 32 columns and two of 8
  const std::size_t dofs = 3 * body.nodes.size();
  std::vector<double> x(dofs * kWidth), y(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::sin(0.7 * static_cast<double>(i));
  multiply_batch(k, x.data(), y.data(), kWidth);
  for (std::size_t c = 0; c < kWidth; ++c) {
    std::vector<double> column(dofs);
    for (std::size_t i = 0; i < dofs; ++i) column[i] = x[i * kWidth + c];
    const auto exact = multiply(k, column);
    // The order of the sums is the same; only fused multiply-adds may differ.
    for (std::size_t i = 0; i < dofs; ++i) ASSERT_NEAR(y[i * kWidth + c], exact[i], 1e-12 * 5400);
  }
}

TEST(Solver, CertifiesTheTrueResidualAndRestartsUntilItHolds) {
  ElasticBody body = body_of(box_mesh({5, 5, 5}, {1, 1, 1}, 0.2), {{5400, 0.45, 0}});
  hold(body, [](const Point& p) { return p[0] == 0 ? 7 : 0; });
  const HeldStiffness held = remove_held_dofs(assemble_stiffness(body), body.fixed);
  std::vector<Point> coordinates;
  for (const auto n : held.node_of_row) coordinates.push_back(body.nodes[n]);
  for (const bool cholesky : {true, false}) {
    ColumnSolver solver(held.matrix, coordinates, {.tolerance = 1e-11, .width = 8, .cholesky = cholesky});
    const auto dofs = static_cast<std::size_t>(solver.dofs());
    std::vector<double> b(8 * dofs, 0.0), x(b.size());
    for (std::size_t c = 0; c < 6; ++c)
      b[8 * (17 * c) + c] = std::pow(1000.0, static_cast<double>(c));  // loads 1 to 1e15
    std::vector<ColumnReport> reports(8);
    solver.solve(b.data(), x.data(), reports);
    for (std::size_t c = 0; c < 8; ++c) {
      std::vector<double> column(dofs);
      for (std::size_t i = 0; i < dofs; ++i) column[i] = x[8 * i + c];
      const auto product = multiply(held.matrix, column);
      double residual = 0;
      for (std::size_t i = 0; i < dofs; ++i) residual += std::pow(product[i] - b[8 * i + c], 2);
      if (c < 6) {
        residual = std::sqrt(residual) / std::pow(1000.0, static_cast<double>(c));
        EXPECT_LE(residual, 1.1e-11);
        EXPECT_NEAR(reports[c].residual, residual, 1e-12);  // the same sums in another order
        // The factor's initial guess meets the tolerance; multigrid starts from zero.
        EXPECT_EQ(reports[c].iterations == 0, cholesky) << c;
      } else {
        EXPECT_EQ(reports[c].residual, 0);  // a column without a load
        EXPECT_EQ(residual, 0);
      }
    }
  }
}

}  // namespace
}  // namespace palpate::tests
