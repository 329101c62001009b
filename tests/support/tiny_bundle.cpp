#include "tests/support/tiny_bundle.h"

namespace palpate::tests {

// Eigen divides its dense products by the sizes of the processor's caches: with sizes of their own, the bundles of the tests have the
// same bits on every processor. A test where surfaces fold or jam is sensitive to the last bit.
[[maybe_unused]] const bool same_on_every_processor = (Eigen::setCpuCacheSizes(32 << 10, 256 << 10, 8 << 20), true);

SurfaceFirst surface_first(const TetrahedralMesh& mesh) {
  SurfaceFirst result{mesh, boundary_triangles(mesh), 0};
  std::vector<bool> on_surface(mesh.nodes.size(), false);
  for (const auto& triangle : result.triangles)
    for (const auto node : triangle) on_surface[node] = true;
  std::vector<std::int32_t> order(mesh.nodes.size()), place(mesh.nodes.size());
  std::iota(order.begin(), order.end(), 0);
  const auto inside = std::stable_partition(order.begin(), order.end(), [&](std::int32_t n) { return on_surface[n]; });
  result.surface_nodes = static_cast<std::int32_t>(inside - order.begin());
  for (std::size_t i = 0; i < order.size(); ++i) {
    place[order[i]] = static_cast<std::int32_t>(i);
    result.mesh.nodes[i] = mesh.nodes[order[i]];
  }
  const auto renumber = [&](auto& elements) {
    for (auto& element : elements)
      for (auto& node : element) node = place[node];
  };
  renumber(result.mesh.tetrahedra);
  renumber(result.triangles);
  for (auto& patch : result.mesh.patches) renumber(patch.triangles);
  return result;
}

Eigen::MatrixXd dense_stiffness(const TetrahedralMesh& mesh, double young, double poisson) {
  const double lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), mu = young / (2 * (1 + poisson));
  Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(3 * mesh.nodes.size(), 3 * mesh.nodes.size());
  for (const auto& t : mesh.tetrahedra) {
    Eigen::Matrix3d edges;
    for (int i = 0; i < 3; ++i)
      for (int d = 0; d < 3; ++d) edges(i, d) = mesh.nodes[t[i + 1]][d] - mesh.nodes[t[0]][d];
    const double volume = edges.determinant() / 6;
    Eigen::Matrix<double, 4, 3> gradient;
    gradient.bottomRows<3>() = edges.inverse().transpose();
    gradient.row(0) = -gradient.bottomRows<3>().colwise().sum();
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        const Eigen::Vector3d ga = gradient.row(a), gb = gradient.row(b);
        stiffness.block<3, 3>(3 * t[a], 3 * t[b]) += volume * (lambda * ga * gb.transpose() + mu * gb * ga.transpose() +
                                                               mu * ga.dot(gb) * Eigen::Matrix3d::Identity());
      }
  }
  return stiffness;
}

DenseBody dense_box(const TinyBox& box) {
  DenseBody dense{surface_first(box_mesh(box.cells, box.size, 0.1)), box.young, box.poisson, box.interior, {}};
  const auto& nodes = dense.body.mesh.nodes;
  dense.fixed.assign(3 * nodes.size(), 0);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (nodes[i][0] == 0.0) dense.fixed[3 * i] = dense.fixed[3 * i + 1] = dense.fixed[3 * i + 2] = 1;
  if (box.single_dof) dense.fixed[3 * (dense.body.surface_nodes - 1)] = 1;
  return dense;
}

BundleParts dense_bundle(const DenseBody& dense) {
  using formats::SectionId;
  const SurfaceFirst& body = dense.body;
  const std::vector<std::uint8_t>& fixed = dense.fixed;
  const auto& nodes = body.mesh.nodes;
  const std::size_t n = nodes.size(), ns = body.surface_nodes;

  // Touchable: every surface node with a free dof.
  std::vector<std::int32_t> touchable;
  for (std::size_t i = 0; i < ns; ++i)
    if (!fixed[3 * i] || !fixed[3 * i + 1] || !fixed[3 * i + 2]) touchable.push_back(static_cast<std::int32_t>(i));

  // Compliance: the inverse on the free dofs, zero elsewhere.
  std::vector<Eigen::Index> free;
  for (std::size_t i = 0; i < 3 * n; ++i)
    if (!fixed[i]) free.push_back(static_cast<Eigen::Index>(i));
  const Eigen::MatrixXd stiffness =
      dense.stiffness.size() > 0 ? dense.stiffness : dense_stiffness(body.mesh, dense.young, dense.poisson);
  Eigen::MatrixXd compliance = Eigen::MatrixXd::Zero(stiffness.rows(), stiffness.cols());
  const Eigen::MatrixXd unit_loads = Eigen::MatrixXd::Identity(free.size(), free.size());
  const Eigen::MatrixXd on_free_dofs = Eigen::MatrixXd(stiffness(free, free)).llt().solve(unit_loads);
  compliance(free, free) = on_free_dofs;

  const std::size_t s = touchable.size(), ni = n - ns;
  std::vector<float> surface(9 * s * ns), interior(9 * s * ni);
  std::vector<double> force(9 * s, 0.0);
  for (std::size_t k = 0; k < s; ++k) {
    const Eigen::Index node = touchable[k];
    std::vector<Eigen::Index> dofs;
    for (int d = 0; d < 3; ++d)
      if (!fixed[3 * node + d]) dofs.push_back(d);
    Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
    const Eigen::Matrix3d self = compliance.block<3, 3>(3 * node, 3 * node);
    const Eigen::MatrixXd self_inverse = Eigen::MatrixXd(self(dofs, dofs)).inverse();
    inverse(dofs, dofs) = self_inverse;
    inverse = (0.5 * (inverse + inverse.transpose())).eval();
    const Eigen::MatrixXd field = compliance.middleCols(3 * node, 3) * inverse;
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) force[9 * k + 3 * i + j] = inverse(i, j);
      for (std::size_t i = 0; i < 3 * n; ++i) {
        const auto value = static_cast<float>(field(static_cast<Eigen::Index>(i), j));
        if (i < 3 * ns)
          surface[(3 * k + j) * 3 * ns + i] = value;
        else
          interior[(3 * k + j) * 3 * ni + i - 3 * ns] = value;
      }
    }
  }

  BundleParts parts;
  parts.provenance = R"({"format":"palpate bundle","version":2,"organ":"box","boundary":"face","element":"p1",)"
                     R"("frame":"none","length_unit":"m","mesh_sha256":"","solver":"dense Cholesky","tolerance":1e-12,)"
                     R"("program_version":"test","preload":false})";
  const auto flat = [](const auto& rows) {
    std::vector<typename std::decay_t<decltype(rows[0])>::value_type> numbers;
    for (const auto& row : rows) numbers.insert(numbers.end(), row.begin(), row.end());
    return numbers;
  };
  const std::size_t e = body.mesh.tetrahedra.size(), f = body.triangles.size();
  parts.set(SectionId::nodes, {n, 3}, flat(nodes));
  parts.set(SectionId::tetrahedra, {e, 4}, flat(body.mesh.tetrahedra));
  parts.set(SectionId::region, {e}, body.mesh.region);
  parts.set(SectionId::triangles, {f, 3}, flat(body.triangles));
  parts.set(SectionId::fixed, {n, 3}, fixed);
  parts.set(SectionId::young, {1}, std::vector<double>{dense.young});
  parts.set(SectionId::poisson, {1}, std::vector<double>{dense.poisson});
  parts.set_text(SectionId::region_names, "box\n");
  parts.set(SectionId::touchable, {s}, touchable);
  parts.set(SectionId::displacement_surface, {s, 3, ns, 3}, surface);
  if (dense.interior && ni > 0) parts.set(SectionId::displacement_interior, {s, 3, ni, 3}, interior);
  parts.set(SectionId::force, {s, 3, 3}, force);
  parts.set(SectionId::residual, {s, 3}, std::vector<double>(3 * s, 1e-15));
  parts.set(SectionId::iterations, {s, 3}, std::vector<std::int32_t>(3 * s, 1));
  return parts;
}

}  // namespace palpate::tests
