#include "tests/support/box_corridor.h"

namespace palpate::tests {

Eigen::MatrixXd dense_compliance(const DenseBody& dense) {
  const Eigen::MatrixXd k =
      dense.stiffness.size() > 0 ? dense.stiffness : dense_stiffness(dense.body.mesh, dense.young, dense.poisson);
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < k.rows(); ++i)
    if (!dense.fixed[i]) free.push_back(i);
  Eigen::MatrixXd compliance = Eigen::MatrixXd::Zero(k.rows(), k.cols());
  const auto unit =
      Eigen::MatrixXd::Identity(static_cast<Eigen::Index>(free.size()), static_cast<Eigen::Index>(free.size()));
  const Eigen::MatrixXd inverse = Eigen::MatrixXd(k(free, free)).llt().solve(unit);
  compliance(free, free) = 0.5 * (inverse + inverse.transpose());
  return compliance;
}

Eigen::VectorXd solve_imposed(const Eigen::MatrixXd& k, const std::vector<bool>& imposed, Eigen::VectorXd u,
                              const Eigen::VectorXd& load) {
  std::vector<Eigen::Index> free, given;
  for (Eigen::Index i = 0; i < k.rows(); ++i) (imposed[i] ? given : free).push_back(i);
  const Eigen::VectorXd right = load(free) - k(free, given) * u(given);
  const Eigen::VectorXd solved = Eigen::MatrixXd(k(free, free)).llt().solve(right);
  u(free) = solved;
  return u;
}

void add_corridor(BundleParts& parts, const DenseBody& dense, const std::vector<std::int32_t>& nodes) {
  using formats::SectionId;
  const Eigen::MatrixXd c = dense_compliance(dense);
  const std::size_t n = dense.fixed.size() / 3, ns = static_cast<std::size_t>(dense.body.surface_nodes);
  const std::size_t k = nodes.size();
  std::vector<float> compliance, surface, interior;
  std::vector<double> residual;
  for (const std::int32_t node : nodes)
    for (Eigen::Index j = 0; j < 3; ++j) {
      const Eigen::VectorXd u = c.col(3 * node + j);
      for (Eigen::Index i = 0; i < u.size(); ++i)
        (static_cast<std::size_t>(i) < 3 * ns ? surface : interior).push_back(static_cast<float>(u(i)));
      for (const std::int32_t other : nodes)
        for (Eigen::Index i = 0; i < 3; ++i) compliance.push_back(static_cast<float>(u(3 * other + i)));
      residual.push_back(u.isZero(0) ? 0 : 1e-15);
    }
  parts.set(SectionId::corridor_nodes, {k}, nodes);
  parts.set(SectionId::corridor_compliance, {k, 3, k, 3}, compliance);
  parts.set(SectionId::corridor_surface, {k, 3, ns, 3}, surface);
  if (dense.interior) parts.set(SectionId::corridor_interior, {k, 3, n - ns, 3}, interior);
  parts.set(SectionId::corridor_residual, {k, 3}, residual);
}

void add_cut(BundleParts& parts, const DenseBody& dense, const std::vector<std::int32_t>& nodes) {
  using formats::SectionId;
  const Eigen::MatrixXd c = dense_compliance(dense);
  std::vector<double> compliance, residual;
  for (std::size_t a = 0; a < nodes.size(); ++a) {
    for (std::size_t b = 0; b <= a; ++b)
      for (Eigen::Index i = 0; i < 9; ++i) compliance.push_back(c(3 * nodes[a] + i / 3, 3 * nodes[b] + i % 3));
    for (Eigen::Index j = 0; j < 3; ++j) residual.push_back(c.col(3 * nodes[a] + j).isZero(0) ? 0 : 1e-15);
  }
  const std::uint64_t count = nodes.size();
  parts.set(SectionId::cut_nodes, {count}, nodes);
  parts.set(SectionId::cut_compliance, {count * (count + 1) / 2, 3, 3}, compliance);
  parts.set(SectionId::cut_residual, {count, 3}, residual);
  parts.set(SectionId::cut_reserve, {2}, std::vector<std::int32_t>{dense.body.surface_nodes, 0});
}

BundleParts cut_box(const TinyBox& box, std::int32_t reserve) {
  DenseBody dense = dense_box(box);
  auto& nodes = dense.body.mesh.nodes;
  std::vector<std::int32_t> all(nodes.size());
  std::iota(all.begin(), all.end(), 0);
  const std::array<double, 3> waits = nodes.back();
  nodes.resize(nodes.size() + static_cast<std::size_t>(reserve), waits);
  dense.fixed.resize(3 * nodes.size(), 1);
  dense.body.surface_nodes = static_cast<std::int32_t>(nodes.size());
  BundleParts parts = dense_bundle(dense);
  add_cut(parts, dense, all);
  parts.set(formats::SectionId::cut_reserve, {2},
            std::vector<std::int32_t>{dense.body.surface_nodes - reserve, reserve});
  return parts;
}

DenseBody box_that_can_be_cut(std::int32_t reserve, const TinyBox& form) {
  DenseBody box = dense_box(form);
  auto& nodes = box.body.mesh.nodes;
  nodes.insert(nodes.end(), static_cast<std::size_t>(reserve), std::array(nodes[0]));
  box.fixed.resize(3 * nodes.size(), 1);
  box.body.surface_nodes = static_cast<std::int32_t>(nodes.size()), box.interior = false;
  return box;
}

void add_cut_region(BundleParts& parts, const DenseBody& dense, std::int32_t reserve) {
  const std::int32_t first = dense.body.surface_nodes - reserve;
  std::vector<std::int32_t> nodes(static_cast<std::size_t>(first));
  std::iota(nodes.begin(), nodes.end(), 0);
  add_cut(parts, dense, nodes);
  parts.set(formats::SectionId::cut_reserve, {2}, std::vector<std::int32_t>{first, reserve});
}

void add_whole_corridor(BundleParts& parts, const DenseBody& dense) {
  std::vector<std::int32_t> inside(dense.body.mesh.nodes.size() - static_cast<std::size_t>(dense.body.surface_nodes));
  std::iota(inside.begin(), inside.end(), dense.body.surface_nodes);
  add_corridor(parts, dense, inside);
}

}  // namespace palpate::tests
