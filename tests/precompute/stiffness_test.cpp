// Laws of p1 and of the solver: affine fields (patch test), rigid motions, several materials, order of convergence.
#include <cmath>
#include <numbers>

#include "precompute/solver/batch_product.h"
#include "studies/bodies/imposed.h"
#include "tests/precompute/support.h"

namespace palpate::tests {
namespace {

int hold_surface_of_unit_box(const Point& p) {
  for (int d = 0; d < 3; ++d)
    if (p[d] == 0 || p[d] == 1) return 7;
  return 0;
}

TEST(Stiffness, ReproducesAffineFieldsOnADistortedBox) {
  for (const double poisson : {0.0, 0.3, 0.45, 0.499}) {
    ElasticBody body = body_of(box_mesh({4, 4, 4}, {1, 1, 1}, 0.2), {{5400, poisson, 0}});
    hold(body, hold_surface_of_unit_box);
    const Field affine = [](const Point& p) {
      return Point{0.1 + 0.3 * p[0] - 0.2 * p[1] + 0.05 * p[2], -0.4 + 0.15 * p[0] + 0.25 * p[1] - 0.1 * p[2],
                   0.2 - 0.35 * p[0] + 0.1 * p[1] + 0.45 * p[2]};
    };
    const auto u = solve_with_imposed(body, affine, std::vector<double>(3 * body.nodes.size(), 0.0));
    // The error of a direct solve is 1e-15 times the condition of K (1e4 at 0.499).
    for (std::size_t n = 0; n < body.nodes.size(); ++n)
      for (std::size_t d = 0; d < 3; ++d) ASSERT_NEAR(u[3 * n + d], affine(body.nodes[n])[d], 1e-11) << poisson;
  }
}

TEST(Stiffness, StoresNoEnergyInARigidMotion) {
  const ElasticBody body = body_of(box_mesh({4, 3, 5}, {0.3, 0.2, 0.4}, 0.2), {{5400, 0.45, 0}});
  const BlockMatrix k = assemble_stiffness(body);
  double largest = 0;
  for (const auto& block : k.block)
    for (const double v : block) largest = std::max(largest, std::abs(v));
  for (int motion = 0; motion < 6; ++motion) {
    std::vector<double> u(3 * body.nodes.size(), 0.0);
    for (std::size_t n = 0; n < body.nodes.size(); ++n) {
      const std::size_t a = static_cast<std::size_t>(motion) % 3, b = (a + 1) % 3, c = (a + 2) % 3;
      if (motion < 3)
        u[3 * n + a] = 1;
      else
        u[3 * n + b] = -body.nodes[n][c], u[3 * n + c] = body.nodes[n][b];
    }
    // Sums of about 100 products of size largest * 1 that cancel: each within half an ulp.
    for (const double f : multiply(k, u)) ASSERT_LE(std::abs(f), 1e-13 * largest) << motion;
  }
}

TEST(Stiffness, IsSymmetricToTheLastBit) {
  const ElasticBody body = body_of(box_mesh({3, 3, 3}, {0.3, 0.2, 0.4}, 0.2), {{5400, 0.45, 0}});
  const Eigen::MatrixXd k = dense(assemble_stiffness(body));
  EXPECT_EQ(k, k.transpose());
}

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

TEST(Stiffness, TwoMaterialsInARowShareTheStressOfABar) {
  // With nu = 0 the bar stretches along x only: the displacement is linear in each half, and its slope is proportional
  // to 1 / E.
  TetrahedralMesh mesh = box_mesh({4, 2, 2}, {1, 1, 1});
  mesh.region_names = {"left", "right"};
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    double x = 0;
    for (const auto n : mesh.tetrahedra[t]) x += mesh.nodes[n][0] / 4;
    mesh.region[t] = x > 0.5;
  }
  ElasticBody body = body_of(mesh, {{1000, 0, 0}, {4000, 0, 0}});
  hold(body, [](const Point& p) { return p[0] == 0 || p[0] == 1 ? 7 : 0; });
  const auto u = solve_with_imposed(
      body,
      [](const Point& p) {
        return Point{p[0] == 1 ? 1.0 : 0.0, 0, 0};
      },
      std::vector<double>(3 * body.nodes.size()));
  for (std::size_t n = 0; n < body.nodes.size(); ++n) {
    const double x = body.nodes[n][0];
    const double exact = x <= 0.5 ? 0.8 * 2 * x : 0.8 + 0.2 * 2 * (x - 0.5);
    ASSERT_NEAR(u[3 * n], exact, 1e-12);  // rounding of a well-conditioned solve
    ASSERT_NEAR(u[3 * n + 1], 0, 1e-12);
  }
}

// Root mean square error of the displacement in the unit box, held on its surface, against the imposed field
// u = (s(x) s(y) s(z), 0, 0) with s(t) = sin(pi t).
double manufactured_error(int cells) {
  constexpr double kYoung = 1, kPoisson = 0.3, pi = std::numbers::pi;
  const double mu = kYoung / (2 * (1 + kPoisson)), lambda = kYoung * kPoisson / ((1 + kPoisson) * (1 - 2 * kPoisson));
  ElasticBody body = body_of(box_mesh({cells, cells, cells}, {1, 1, 1}), {{kYoung, kPoisson, 0}});
  hold(body, hold_surface_of_unit_box);
  // -div sigma = -(lambda + mu) grad div u - mu laplace u
  const auto force = [&](const Point& p) {
    const double sx = std::sin(pi * p[0]), sy = std::sin(pi * p[1]), sz = std::sin(pi * p[2]);
    const double cx = std::cos(pi * p[0]), cy = std::cos(pi * p[1]), cz = std::cos(pi * p[2]);
    const double a = (lambda + mu) * pi * pi;
    return Point{a * sx * sy * sz + 3 * mu * pi * pi * sx * sy * sz, -a * cx * cy * sz, -a * cx * sy * cz};
  };
  std::vector<double> load(3 * body.nodes.size(), 0.0);
  for (const auto& t : body.tetrahedra) {  // four-point rule of degree 2 on each tetrahedron
    const double volume = 1.0 / (6.0 * cells * cells * cells);
    for (int q = 0; q < 4; ++q) {
      constexpr double kNear = 0.58541019662496852, kFar = 0.13819660112501052;
      Point p{};
      for (int a = 0; a < 4; ++a)
        for (std::size_t d = 0; d < 3; ++d) p[d] += (a == q ? kNear : kFar) * body.nodes[t[a]][d];
      const Point f = force(p);
      for (int a = 0; a < 4; ++a)
        for (std::size_t d = 0; d < 3; ++d)
          load[3 * static_cast<std::size_t>(t[a]) + d] += volume / 4 * (a == q ? kNear : kFar) * f[d];
    }
  }
  const auto u = solve_with_imposed(
      body, [](const Point&) { return Point{}; }, load);
  double sum = 0;
  for (std::size_t n = 0; n < body.nodes.size(); ++n) {
    const auto& p = body.nodes[n];
    const double exact = std::sin(pi * p[0]) * std::sin(pi * p[1]) * std::sin(pi * p[2]);
    sum += std::pow(u[3 * n] - exact, 2) + std::pow(u[3 * n + 1], 2) + std::pow(u[3 * n + 2], 2);
  }
  return std::sqrt(sum / std::pow(cells, 3));  // the integral, by the trapezoidal rule
}

TEST(Stiffness, RefinementGainsTheSecondOrderOfLinearTetrahedra) {
  const double coarse = manufactured_error(9), fine = manufactured_error(18);
  // Theory: order 2 as the mesh size goes to zero. These meshes are within 0.15 of it.
  EXPECT_NEAR(std::log2(coarse / fine), 2.0, 0.15) << coarse << ' ' << fine;
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
