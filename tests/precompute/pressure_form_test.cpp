// The pressure form of p1-anp and its factor against K itself.
#include "precompute/elements/pressure_form.h"

#include <gmock/gmock.h>

#include "precompute/solver/column_solver.h"
#include "precompute/solver/elimination.h"
#include "precompute/solver/supernodal_factor.h"
#include "studies/bodies/bodies.h"
#include "tests/precompute/factor_checks.h"

namespace palpate::tests {
namespace {

using Eigen::MatrixXd;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// A box of 4 x 3 x 3 cells, with one region or with three in layers and a speck.
ElasticBody box(const std::vector<Material>& materials) {
  TetrahedralMesh mesh = box_mesh({4, 3, 3}, {1.2, 1, 0.9}, 0.2);
  if (materials.size() == 3) {
    mesh.region_names = {"soft", "stiff", "speck"};
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) mesh.region[t] = t % 17 == 0 ? 2 : t < 72 ? 0 : 1;
  }
  return body_of(mesh, materials);
}

struct Case {
  const char* name;
  ElasticBody body;
};

Material tissue(double poisson) {
  return {5400, poisson, 0};
}
// Dilatation about a corner costs A nothing where only planes through that corner hold the body.
int symmetry_planes(const std::array<double, 3>& p) {
  return (p[0] == 0 ? 1 : 0) | (p[1] == 0 ? 2 : 0) | (p[2] == 0 ? 4 : 0);
}
int one_face(const std::array<double, 3>& p) {
  return p[0] == 0 ? 7 : 0;
}
// Six held dofs, no more than a rigid body needs: K_dev alone is singular.
int six_dofs(const std::array<double, 3>& p) {
  const bool x = p[0] > 1.19, y = p[1] > 0.99, z = p[2] > 0.89;
  if (!x && !y && !z && p[0] == 0 && p[1] == 0 && p[2] == 0) return 7;
  if (x && p[1] == 0 && p[2] == 0) return 6;
  return y && p[0] == 0 && p[2] == 0 ? 4 : 0;
}

std::vector<Case> cases(double poisson) {
  std::vector<Case> all;
  const auto add = [&](const char* name, const std::vector<Material>& materials,
                       int (*which)(const std::array<double, 3>&)) {
    all.push_back({name, box(materials)});
    if (which) hold(all.back().body, which);
  };
  const std::vector<Material> one = {tissue(poisson)}, three = {tissue(poisson), {1e6, 0.3, 0}, {200, 0.49, 0}};
  add("one region, a face held", one, one_face);
  add("one region, symmetry planes", one, symmetry_planes);
  add("one region, six dofs held", one, six_dofs);
  add("three regions, a face held", three, one_face);
  add("three regions, symmetry planes", three, symmetry_planes);
  add("three regions, foundation and springs", three, nullptr);
  ElasticBody& soft = all.back().body;
  std::vector<std::int32_t> triangles;
  for (std::size_t t = 0; t < soft.triangles.size(); t += 2) triangles.push_back(static_cast<std::int32_t>(t));
  soft.foundations.push_back({"soft", 2e4, 1e3, triangles});
  soft.springs.push_back({"ties", {{0, Spring::kWorld, 300, {0, 0, 1}}, {3, 40, 500, {0, 0, 0}}}});
  return all;
}

HeldStiffness held_of(const ElasticBody& body) {
  return remove_held_dofs(assemble_stiffness(body, Element::p1_anp), body.fixed);
}

// A + B^T B, from the blocks of the form.
MatrixXd condensed(const PressureForm& form) {
  MatrixXd a = MatrixXd::Zero(3 * form.rows, 3 * form.rows), b = MatrixXd::Zero(form.rows, 3 * form.rows);
  for (std::int32_t row = 0; row < form.rows; ++row)
    for (auto at = form.first[row]; at < form.first[row + 1]; ++at) {
      const auto& block = form.block[at];
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) a(3 * row + i, 3 * form.column[at] + j) = block[4 * i + j];
        b(row, 3 * form.column[at] + j) = block[12 + j];
      }
      EXPECT_EQ(block[15], row == form.column[at] ? -1.0 : 0.0);
      const auto mirrored = form.block[index_of_block(form, form.column[at], row)];
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) EXPECT_EQ(block[4 * i + j], mirrored[4 * j + i]);
    }
  return a + b.transpose() * b;
}

TEST(PressureForm, IsKWhereThePressuresAreEliminated) {
  for (const double poisson : {0.0, 0.45, 0.4999})
    for (const Case& c : cases(poisson)) {
      const HeldStiffness held = held_of(c.body);
      const MatrixXd k = dense(held.matrix);
      // Sums of some tens of terms, no larger than the largest entry of K, in another order.
      EXPECT_LE((condensed(pressure_form(c.body, held)) - k).cwiseAbs().maxCoeff(), 1e-14 * k.cwiseAbs().maxCoeff())
          << c.name << ", nu " << poisson;
    }
}

TEST(PressureForm, CouplesNeighboursAloneWhereThereIsOneRegion) {
  ElasticBody body = box({tissue(0.45)});
  hold(body, [](const auto& p) { return p[0] == 0 ? 1 : 0; });  // no node loses its row
  const BlockMatrix neighbours = assemble_stiffness(body, Element::p1);
  const PressureForm form = pressure_form(body, held_of(body));
  EXPECT_EQ(form.first, neighbours.first);
  EXPECT_EQ(form.column, neighbours.column);
}

TEST(PressureFactor, SolvesKForEveryKindOfSupportAndPoissonsRatio) {
  constexpr int kWidth = 24;
  for (const double poisson : {0.3, 0.45, 0.49, 0.499, 0.4999})
    for (const Case& c : cases(poisson)) {
      HeldStiffness held = held_of(c.body);
      PressureForm form = pressure_form(c.body, held);
      auto elimination = std::make_shared<const Elimination>(analyse_elimination(form));
      for (const bool renumbered : {false, true}) {
        if (renumbered) elimination = put_in_order(held, *elimination, &form);
        const MatrixXd k = dense(held.matrix);
        PressureFactor factor(form, elimination, kWidth);
        SCOPED_TRACE(fmt::format("{}, nu {}", c.name, poisson));
        expect_factor_solves(factor, k, kWidth);  // as K's own factor, whatever nu is
      }
    }
}

// The solution itself, and not only its residual: two factors of one K may differ by rounding times K's condition.
TEST(PressureFactor, GivesTheColumnsThatKsOwnFactorGives) {
  constexpr int kWidth = 8;
  for (const double poisson : {0.45, 0.4999})
    for (const Case& c : cases(poisson)) {
      const HeldStiffness held = held_of(c.body);
      const PressureForm form = pressure_form(c.body, held);
      const auto of_k = std::make_shared<const Elimination>(analyse_elimination(held.matrix));
      const auto of_form = std::make_shared<const Elimination>(analyse_elimination(form));
      const RowMajor b = random_block(3 * held.matrix.rows, kWidth, 5);
      RowMajor x(b.rows(), kWidth), y(b.rows(), kWidth);
      SupernodalFactor(held.matrix, of_k, kWidth).apply(b.data(), x.data());
      PressureFactor(form, of_form, kWidth).apply(b.data(), y.data());
      const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<MatrixXd>(dense(held.matrix)).eigenvalues();
      const double condition = values.maxCoeff() / values.minCoeff();
      EXPECT_LE((x - y).norm(), 1e-15 * condition * x.norm()) << c.name << ", nu " << poisson;
    }
}

// Below some hundred nodes separators are as thick as the body, and K's own factor is the smaller one.
TEST(PressureFactor, IsSmallerThanThatOfK) {
  ElasticBody body = body_of(box_mesh({12, 12, 12}, {1, 1, 1}, 0.2), {tissue(0.45)});
  hold(body, one_face);
  const HeldStiffness held = held_of(body);
  EXPECT_LT(static_cast<double>(analyse_elimination(pressure_form(body, held)).numbers()),
            0.75 * static_cast<double>(analyse_elimination(held.matrix).numbers()));  // seen: 0.6
}

// In single precision one solve leaves some 1e-5 of a column; CG with residuals in double precision takes two to four.
TEST(PressureFactor, InSinglePrecisionCgReachesTheSameColumns) {
  for (const double poisson : {0.45, 0.4999})
    for (const Case& c : cases(poisson)) {
      HeldStiffness held = held_of(c.body);
      PressureForm form = pressure_form(c.body, held);
      const auto elimination = put_in_order(held, analyse_elimination(form), &form);
      std::vector<Load> loads;
      for (std::int32_t column = 0; column < 8; ++column) loads.push_back({20 + 3 * column, column, 1.0});
      std::vector<double> x[2];
      for (const bool single : {false, true}) {
        ColumnSolver solver(
            held.matrix, {},
            {.width = 8, .single = single, .form = std::make_shared<PressureForm>(form), .elimination = elimination});
        x[single].resize(static_cast<std::size_t>(8 * solver.dofs()));
        std::vector<ColumnReport> reports(8);
        solver.solve(loads, x[single].data(), reports);
        for (const auto& report : reports) {
          EXPECT_LE(report.residual, 1e-9) << c.name;
          EXPECT_EQ(report.iterations > 0, single);
          EXPECT_LE(report.iterations, poisson > 0.49 ? 8 : 5) << c.name << ", nu " << poisson;
        }
        EXPECT_EQ(solver.description().find("in single precision") != std::string::npos, single);
      }
      const Eigen::Map<Eigen::VectorXd> exact(x[0].data(), static_cast<Eigen::Index>(x[0].size()));
      const Eigen::Map<Eigen::VectorXd> found(x[1].data(), exact.size());
      EXPECT_LE((exact - found).norm(), 1e-5 * exact.norm()) << c.name << ", nu " << poisson;
    }
}

TEST(PressureFactor, NamesTheNodeWhosePivotHasTheWrongSign) {
  const ElasticBody body = cases(0.45).front().body;
  const HeldStiffness held = held_of(body);
  for (const int of_block : {0, 5, 10, 15}) {  // u_x, u_y, u_z, p
    PressureForm form = pressure_form(body, held);
    constexpr std::int32_t kBad = 11;
    auto& block = form.block[index_of_block(form, kBad, kBad)];
    block[of_block] = of_block == 15 ? 1e9 : -1e9;
    EXPECT_THAT(
        [&] {
          PressureFactor(form, std::make_shared<const Elimination>(analyse_elimination(form)), 8,
                         {held.node_of_row, {}});
        },
        ThrowsMessage<OperationError>(HasSubstr(fmt::format("fails at node {}", held.node_of_row[kBad]))));
  }
}

}  // namespace
}  // namespace palpate::tests
