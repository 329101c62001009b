#include "tests/support/box_motions.h"

namespace palpate::tests {

Eigen::Vector3d node_of(const DenseBody& dense, std::size_t n) {
  return Eigen::Vector3d(dense.body.mesh.nodes[n].data());
}

namespace {

Eigen::Vector3d area_of(const DenseBody& dense, std::size_t triangle) {
  Eigen::Vector3d p[3];
  for (std::size_t v = 0; v < 3; ++v)
    p[v] = node_of(dense, static_cast<std::size_t>(dense.body.triangles[triangle][v]));
  return (p[1] - p[0]).cross(p[2] - p[0]) / 2;
}

// On the face x = 0.06.
bool is_pressed(const DenseBody& dense, std::size_t triangle) {
  return area_of(dense, triangle).normalized()[0] >= 0.9;
}

}  // namespace

DenseMotions dense_motions(const DenseBody& dense) {
  const Eigen::MatrixXd k = dense_stiffness(dense.body.mesh, dense.young, dense.poisson);
  const auto n = dense.body.mesh.nodes.size();
  DenseMotions result{Eigen::MatrixXd::Zero(k.rows(), kMotions), Eigen::VectorXd::Zero(k.rows())};
  Eigen::MatrixXd force = Eigen::MatrixXd::Zero(k.rows(), kMotions);
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d p = node_of(dense, i);
    // The nodes of the face x = 0 move; what else is held stays.
    if (dense.fixed[3 * i] && p[0] == 0) {
      result.field.block<3, 1>(static_cast<Eigen::Index>(3 * i), kPiston) = Eigen::Vector3d(1, 0, 0);
      result.field.block<3, 1>(static_cast<Eigen::Index>(3 * i), kTurn) =
          Eigen::Vector3d(0, 1, 0).cross(p - Eigen::Vector3d(0, 0, 0.02));
    }
    force(static_cast<Eigen::Index>(3 * i) + 2, kWeight) = 1e-3;
  }
  for (std::size_t t = 0; t < dense.body.triangles.size(); ++t)
    if (is_pressed(dense, t))
      for (const auto v : dense.body.triangles[t]) result.sweep.segment<3>(3 * v) -= area_of(dense, t) / 3;
  force.col(kFilling) = result.sweep;
  std::vector<Eigen::Index> free, held;
  for (Eigen::Index i = 0; i < k.rows(); ++i) (dense.fixed[i] ? held : free).push_back(i);
  const Eigen::MatrixXd load = force(free, Eigen::all) - k(free, held) * result.field(held, Eigen::all);
  const Eigen::MatrixXd solved = Eigen::MatrixXd(k(free, free)).llt().solve(load);
  result.field(free, Eigen::all) = solved;
  return result;
}

void add_motions(BundleParts& parts, const DenseBody& dense) {
  using formats::SectionId;
  const DenseMotions motions = dense_motions(dense);
  const std::size_t ns = static_cast<std::size_t>(dense.body.surface_nodes), n = dense.body.mesh.nodes.size();
  std::vector<float> surface, interior;
  for (Eigen::Index m = 0; m < kMotions; ++m)
    for (std::size_t i = 0; i < 3 * n; ++i)
      (i < 3 * ns ? surface : interior).push_back(static_cast<float>(motions.field(static_cast<Eigen::Index>(i), m)));
  std::vector<double> volume(kMotions * kMotions, 0.0);
  for (Eigen::Index m = 0; m < kMotions; ++m) volume[kFilling * kMotions + m] = motions.sweep.dot(motions.field.col(m));
  parts.set_text(SectionId::motion_names, "piston\nturn\nfilling\nweight\n");
  parts.set(SectionId::motion_kinds, {kMotions}, std::vector<std::int32_t>{1, 2, 4, 5});
  parts.set(SectionId::motion_surface, {kMotions, ns, 3}, surface);
  if (!interior.empty()) parts.set(SectionId::motion_interior, {kMotions, n - ns, 3}, interior);
  parts.set(SectionId::motion_volume, {kMotions, kMotions}, volume);
  std::vector<std::uint8_t> pressed(kMotions * dense.body.triangles.size(), 0);
  for (std::size_t t = 0; t < dense.body.triangles.size(); ++t)
    pressed[kFilling * dense.body.triangles.size() + t] = is_pressed(dense, t);
  parts.set(SectionId::motion_pressed, {kMotions, dense.body.triangles.size()}, pressed);
  parts.set(SectionId::motion_residual, {kMotions}, std::vector<double>(kMotions, 1e-15));
}

DenseBody box_on_supports(bool two) {
  DenseBody dense = dense_box({});
  for (std::size_t i = 0; two && i < dense.body.mesh.nodes.size(); ++i)
    if (dense.body.mesh.nodes[i][1] > 0.05 - 1e-9)
      dense.fixed[3 * i] = dense.fixed[3 * i + 1] = dense.fixed[3 * i + 2] = 1;
  return dense;
}

}  // namespace palpate::tests
