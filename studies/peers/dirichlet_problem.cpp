#include "studies/peers/dirichlet_problem.h"

namespace palpate::studies {
namespace {

using Entry = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>;

HeldStiffness with_node_held(const Push& push, std::int32_t node) {
  auto fixed = push.body.fixed;
  fixed[node] = {1, 1, 1};
  return remove_held_dofs(push.stiffness, fixed);
}

}  // namespace

DirichletProblem::DirichletProblem(const Push& p, std::int32_t n) : push(p), node(n), held(with_node_held(p, n)) {
  load_of_unit.setZero(3 * held.matrix.rows, 3);
  for (std::int64_t at = push.stiffness.first[node]; at < push.stiffness.first[node + 1]; ++at) {
    const std::int32_t other = push.stiffness.column[at], row = held.row_of_node[other];
    if (row < 0) continue;
    const Entry entry(push.stiffness.block[at].data());
    for (int i = 0; i < 3; ++i)
      if (!push.body.fixed[other][i])
        load_of_unit.row(3 * row + i) = -entry.col(i);  // the transpose of the 3 x 3 entry
  }
}

void DirichletProblem::read(const Eigen::Ref<const Eigen::VectorXd>& solution, const Eigen::Vector3d& displacement,
                            Answer& answer) const {
  const auto at = [&](std::int32_t n) -> Eigen::Vector3d {
    if (n == node) return displacement;
    const std::int32_t row = held.row_of_node[n];
    return row < 0 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(solution.segment<3>(3 * row));
  };
  answer.surface.resize(3 * push.body.surface_count);
  for (std::int32_t n = 0; n < push.body.surface_count; ++n) answer.surface.segment<3>(3 * n) = at(n);
  answer.force.setZero();
  for (std::int64_t b = push.stiffness.first[node]; b < push.stiffness.first[node + 1]; ++b)
    answer.force += Entry(push.stiffness.block[b].data()) * at(push.stiffness.column[b]);
}

}  // namespace palpate::studies
