// T^u and T^f against dense solves of the equations in the paper.
#include "precompute/tensors/tensors.h"
#include "precompute/tensors/probe_columns.h"
#include "tests/precompute/support.h"

namespace palpate::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// A box of distorted tetrahedra, one half softer, held at x = 0, on rollers (held in z) at z = 0, and with one more
// node held in y.
ElasticBody small_organ(double poisson) {
  TetrahedralMesh mesh = box_mesh({3, 3, 3}, {0.06, 0.05, 0.04}, 0.15);
  part_in_two(mesh, 0.03, {"soft", "stiff"});
  ElasticBody body = body_of(mesh, {{3000, poisson, 0}, {20000, 0.3, 0}});
  hold(body, [](const auto& p) {
    if (p[0] == 0) return 7;
    if (p[0] == 0.06 && p[1] == 0.05 && p[2] == 0.04) return 2;
    return p[2] == 0 ? 4 : 0;
  });
  return body;
}

// Eq. 2 of the paper: [K G^T; G 0] [u; lambda] = [0; u*], one constraint per free dof of node k, the one of dof j moved
// by 1. Returns u over the free dofs, then lambda.
VectorXd lagrange(const MatrixXd& k_free, const std::vector<Eigen::Index>& dofs, std::int32_t k, int j) {
  std::vector<Eigen::Index> constrained;
  Eigen::Index moved = -1;
  for (std::size_t f = 0; f < dofs.size(); ++f)
    if (dofs[f] / 3 == k) {
      if (dofs[f] % 3 == j) moved = static_cast<Eigen::Index>(constrained.size());
      constrained.push_back(static_cast<Eigen::Index>(f));
    }
  const Eigen::Index n = k_free.rows(), c = static_cast<Eigen::Index>(constrained.size());
  MatrixXd system = MatrixXd::Zero(n + c, n + c);
  system.topLeftCorner(n, n) = k_free;
  for (Eigen::Index i = 0; i < c; ++i) system(constrained[i], n + i) = system(n + i, constrained[i]) = 1;
  VectorXd right = VectorXd::Zero(n + c);
  if (moved >= 0) right[n + moved] = 1;
  return system.fullPivLu().solve(right);
}

void expect_equal_to_lagrange(double poisson, Element element) {
  const ElasticBody body = small_organ(poisson);
  const auto dofs = free_dofs(body);
  const MatrixXd k = dense(assemble_stiffness(body, element))(dofs, dofs);
  // One node that is held in y, two on rollers, and some that are free.
  std::vector<std::int32_t> nodes;
  for (const auto n : body.touchable)
    if (body.fixed[n][1] || (body.fixed[n][2] && nodes.size() < 3) || n % 11 == 0) nodes.push_back(n);
  ASSERT_GE(nodes.size(), 5u);
  for (const auto& tensor : solve_node_tensors(body, element, nodes)) {
    double force_scale = 0;
    for (const double f : tensor.stiffness) force_scale = std::max(force_scale, std::abs(f));
    for (int j = 0; j < 3; ++j) {
      const double* row = &tensor.displacement[3 * body.nodes.size() * static_cast<std::size_t>(j)];
      if (body.fixed[tensor.node][j]) {
        for (std::size_t i = 0; i < 3 * body.nodes.size(); ++i) ASSERT_EQ(row[i], 0.0);
        continue;
      }
      const VectorXd exact = lagrange(k, dofs, tensor.node, j);
      VectorXd whole = VectorXd::Zero(static_cast<Eigen::Index>(3 * body.nodes.size()));
      for (std::size_t f = 0; f < dofs.size(); ++f) whole[dofs[f]] = exact[static_cast<Eigen::Index>(f)];
      // Two solves in double of a matrix of condition 1e4 to 1e5: 1e-16 * 1e5, and room.
      for (Eigen::Index i = 0; i < whole.size(); ++i) ASSERT_NEAR(row[i], whole[i], 1e-10) << tensor.node << ' ' << j;
      // lambda = -T^f u*
      Eigen::Index at = static_cast<Eigen::Index>(dofs.size());
      for (int i = 0; i < 3; ++i) {
        const double force = body.fixed[tensor.node][i] ? 0.0 : -exact[at++];
        ASSERT_NEAR(tensor.stiffness[static_cast<std::size_t>(3 * i + j)], force, 1e-10 * force_scale);
      }
    }
  }
}

TEST(Tensors, EqualALiteralDenseSolveOfTheLagrangeSystemAlsoWhereSomeDofsAreHeld) {
  expect_equal_to_lagrange(0.45, Element::p1);
  expect_equal_to_lagrange(0.45, Element::p1_anp);
}
TEST(Tensors, EqualALiteralDenseSolveOfTheLagrangeSystemNearIncompressibility) {
  expect_equal_to_lagrange(0.499, Element::p1);
  expect_equal_to_lagrange(0.499, Element::p1_anp);
}

}  // namespace
}  // namespace palpate::tests
