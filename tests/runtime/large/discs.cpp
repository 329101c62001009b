#include "tests/runtime/large/discs.h"

namespace palpate::tests {

std::vector<std::int32_t> elimination_order(const HyperelasticBody& body) {
  std::vector<std::int32_t> free;
  std::vector<int> row(static_cast<std::size_t>(body.node_count), -1);
  for (std::int32_t n = 0; n < body.node_count; ++n)
    if (!body.fixed[3 * n] || !body.fixed[3 * n + 1] || !body.fixed[3 * n + 2])
      row[static_cast<std::size_t>(n)] = static_cast<int>(free.size()), free.push_back(n);
  std::vector<Eigen::Triplet<double>> pairs;
  for (std::int32_t c = 0; c < 16 * body.tetrahedron_count; ++c) {
    const int a = row[static_cast<std::size_t>(body.tetrahedra[c / 4])],
              b = row[static_cast<std::size_t>(body.tetrahedra[c / 16 * 4 + c % 4])];
    if (a >= 0 && b >= 0) pairs.emplace_back(a, b, 1.0);
  }
  Eigen::SparseMatrix<double> graph(static_cast<Eigen::Index>(free.size()), static_cast<Eigen::Index>(free.size()));
  graph.setFromTriplets(pairs.begin(), pairs.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(graph.selfadjointView<Eigen::Lower>(), order);
  std::vector<std::int32_t> result;
  for (Eigen::Index i = 0; i < order.size(); ++i) result.push_back(free[static_cast<std::size_t>(order.indices()[i])]);
  return result;
}

void Discs::add(const HyperelasticBody& body, const Eigen::Vector3d& centre, double radius, double compliance) {
  const auto first = static_cast<std::int32_t>(nodes.size()), group = static_cast<std::int32_t>(rows.size());
  for (std::int32_t n = 0; n < body.node_count; ++n)
    if ((Eigen::Vector3d(body.nodes + 3 * n) - centre).norm() <= radius) nodes.push_back(n);
  const auto count = static_cast<std::int32_t>(nodes.size()) - first;
  weights.resize(nodes.size(), 1.0 / count);
  for (int i = 0; i < 3; ++i) {
    LargeRow row = {first, count, {0, 0, 0}, 0, group, 0, {0, 0, 0}};
    row.direction[i] = 1, row.compliance[i] = compliance;
    rows.push_back(row);
  }
}

void Discs::set(std::size_t disc, const Eigen::Vector3d& target) {
  for (std::size_t i = 0; i < 3; ++i) rows[3 * disc + i].target = target[static_cast<Eigen::Index>(i)];
}

LargeContacts Discs::contacts() const {
  return {rows.data(), nodes.data(), weights.data(), static_cast<std::int32_t>(rows.size())};
}

Eigen::MatrixXd Discs::dense(Eigen::Index dofs) const {
  Eigen::MatrixXd w = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), dofs);
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (std::int32_t e = rows[r].first; e < rows[r].first + rows[r].count; ++e)
      for (int i = 0; i < 3; ++i)
        w(static_cast<Eigen::Index>(r), 3 * nodes[static_cast<std::size_t>(e)] + i) +=
            weights[static_cast<std::size_t>(e)] * rows[r].direction[i];
  return w;
}

Eigen::VectorXd Discs::targets() const {
  Eigen::VectorXd d(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t r = 0; r < rows.size(); ++r) d[static_cast<Eigen::Index>(r)] = rows[r].target;
  return d;
}

Solved::Solved(const HyperelasticBody& body, bool renews, bool roughly) : body_(body), memory_(palpate_allocator{}) {
  const auto order = elimination_order(body);
  if (solver.create(memory_, body, order.data(), static_cast<std::int32_t>(order.size()), 30, 1000, nullptr, renews,
                    roughly ? 0 : BlockFactor::kFewestForRough) != LargeSolver::Created::made)
    throw std::runtime_error("not made");
}

LargeOutcome Solved::step(const Discs& discs, int steps) {
  force.resize(static_cast<Eigen::Index>(discs.rows.size()));
  const LargeOutcome outcome = solver.step(discs.contacts(), steps, force.data());
  EXPECT_TRUE(force.allFinite());
  return outcome;
}

Eigen::VectorXd Solved::field() const {
  Eigen::VectorXd u(3 * body_.node_count);
  for (std::int32_t n = 0; n < body_.node_count; ++n) {
    float v[3];
    solver.displacement(n, v);
    for (int i = 0; i < 3; ++i) u[3 * n + i] = static_cast<double>(v[i]);
  }
  EXPECT_TRUE(u.allFinite());
  return u;
}

ElasticBody block(double poisson) {
  ElasticBody body = body_of(box_mesh({6, 6, 4}, {0.12, 0.12, 0.08}, 0.15), {{5400, poisson, 0}});
  hold(body, [](const auto& p) { return p[2] == 0 ? 7 : 0; });
  return body;
}

ElasticBody beam() {
  ElasticBody body = body_of(box_mesh({15, 4, 4}, {0.10, 0.02, 0.02}, 0.1), {{5400, 0.45, 0}});
  hold(body, [](const auto& p) { return p[0] == 0 ? 7 : 0; });
  return body;
}

}  // namespace palpate::tests
