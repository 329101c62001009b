#include "studies/validation/tensor_answer.h"

namespace palpate::validation {

Vector3d displacement_under(const NodeTensor& tensor, const Vector3d& force, std::int32_t n) {
  const Vector3d moved = Eigen::Map<const Eigen::Matrix3d>(tensor.stiffness.data()).inverse() * force;
  const std::size_t run = tensor.displacement.size() / 3;
  Vector3d u = Vector3d::Zero();
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = 0; i < 3; ++i)
      u[static_cast<Eigen::Index>(i)] +=
          tensor.displacement[run * j + 3 * static_cast<std::size_t>(n) + i] * moved[static_cast<Eigen::Index>(j)];
  return u;
}

std::vector<Vector3d> superpose(const ElasticBody& body, Element element, std::span<const std::int32_t> contacts,
                                std::span<const Vector3d> displacement) {
  const auto tensors = solve_node_tensors(body, element, contacts, 1e-12);
  const auto count = static_cast<Eigen::Index>(contacts.size());
  Eigen::MatrixXd w(3 * count, 3 * count);
  Eigen::VectorXd target(3 * count);
  for (Eigen::Index j = 0; j < count; ++j) {
    target.segment<3>(3 * j) = displacement[static_cast<std::size_t>(j)];
    for (Eigen::Index i = 0; i < count; ++i)
      for (int d = 0; d < 3; ++d)
        w.block<3, 1>(3 * i, 3 * j + d) = displacement_under(tensors[static_cast<std::size_t>(j)], Vector3d::Unit(d),
                                                             contacts[static_cast<std::size_t>(i)]);
  }
  const Eigen::VectorXd force = w.llt().solve(target);
  std::vector<Vector3d> u(body.nodes.size(), Vector3d::Zero());
  for (std::size_t c = 0; c < tensors.size(); ++c)
    for (std::size_t n = 0; n < u.size(); ++n)
      u[n] += displacement_under(tensors[c], force.segment<3>(3 * static_cast<Eigen::Index>(c)),
                                 static_cast<std::int32_t>(n));
  return u;
}

}  // namespace palpate::validation
