// Contacts against the dense solve of the same mesh: displacements, forces, alpha_v, conflicting and repeated rows.
#include "tests/runtime/touched_box.h"

namespace palpate::tests {
namespace {

// u and the nodal forces K u with the given dofs imposed and the bundle's fixed dofs at zero.
struct Reference {
  Eigen::VectorXd u, force;
};
Reference dirichlet(const TouchedBox& box, const std::vector<std::pair<Eigen::Index, double>>& imposed) {
  const Eigen::MatrixXd stiffness = box.stiffness();
  std::vector<Eigen::Index> free;
  std::vector<bool> held(static_cast<std::size_t>(box.dofs()), false);
  Reference reference{Eigen::VectorXd::Zero(box.dofs()), {}};
  for (Eigen::Index i = 0; i < box.dofs(); ++i) held[i] = box.fixed[i] != 0;
  for (const auto& [dof, value] : imposed) held[dof] = true, reference.u[dof] = value;
  for (Eigen::Index i = 0; i < box.dofs(); ++i)
    if (!held[i]) free.push_back(i);
  const Eigen::VectorXd right = -(stiffness * reference.u)(free);
  const Eigen::VectorXd solved = Eigen::MatrixXd(stiffness(free, free)).llt().solve(right);
  reference.u(free) = solved;
  reference.force = stiffness * reference.u;
  return reference;
}

Eigen::Vector3d wave(std::int32_t n) {
  return 0.002 * Eigen::Vector3d(std::sin(3.1 * n), std::cos(1.7 * n), std::sin(0.9 * n + 1));
}

double relative_difference(const std::vector<float>& u, const Eigen::VectorXd& reference) {
  const Eigen::VectorXd ours =
      Eigen::Map<const Eigen::VectorXf>(u.data(), static_cast<Eigen::Index>(u.size())).cast<double>();
  return (ours - reference).norm() / reference.norm();
}

class Superposition : public testing::TestWithParam<int> {};

// The bound: columns are stored to 6e-8 of their largest entry; the contact system amplifies that by its condition,
// about 30 for a patch of all nodes here, and sums it over sqrt(3 contacts) <= 20 columns: 4e-5 at the worst, 1e-5
// allowed.
TEST_P(Superposition, OfNodeContactsEqualsAFullDirichletSolve) {
  const TouchedBox box;
  palpate_scene_def def = unlimited_def();
  def.shape = PALPATE_SHAPE_VOLUME;
  def.max_points = def.max_contact_nodes = 200;
  const ScenePointer scene = box.scene(def);
  const int count = std::min<int>(GetParam(), static_cast<int>(box.touchable.size()));
  std::vector<palpate_grip> grips;
  std::vector<std::pair<Eigen::Index, double>> imposed;
  for (int c = 0; c < count; ++c) {
    const std::int32_t n = box.touchable[c * box.touchable.size() / count];
    grips.push_back(grip_at_node(n, wave(n)));
    for (int d = 0; d < 3; ++d) imposed.emplace_back(3 * n + d, wave(n)[d]);
  }
  const palpate_tool tool = tool_of(grips);
  Contacts contacts(scene.get());
  EXPECT_EQ(palpate_touch(scene.get(), &tool, 1, 1e-3, contacts.get()), 0u);
  const Reference reference = dirichlet(box, imposed);
  const auto u = displacements(scene.get(), contacts.get(), static_cast<std::int32_t>(box.dofs() / 3));
  EXPECT_LT(relative_difference(u, reference.u), 1e-5);

  // The contact forces are the reactions K u, and the tool feels their sum reversed.
  ASSERT_EQ(contacts->node_count, count);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), expected_sum = Eigen::Vector3d::Zero();
  double largest = 0, error = 0;
  for (int c = 0; c < count; ++c) {
    const palpate_contact_node& node = contacts.nodes()[c];
    const Eigen::Vector3d expected = reference.force.segment<3>(3 * node.node), force(node.force);
    error = std::max(error, (force - expected).norm()), largest = std::max(largest, expected.norm());
    sum += force, expected_sum += expected;
  }
  EXPECT_LT(error, 1e-5 * largest);
  EXPECT_LT((Eigen::Vector3d(contacts->tools[0].force_raw) + sum).norm(), 1e-12 * largest * count);
}
INSTANTIATE_TEST_SUITE_P(Contacts, Superposition, testing::Values(1, 4, 30, 1000));

}  // namespace
}  // namespace palpate::tests
